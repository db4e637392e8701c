"""What a file of tests leaves behind is freed."""

from __future__ import annotations

import gc
from functools import cache

import pytest
import shiboken6
from PySide6.QtCore import QObject

from tests.plugins.memory import Peaks, empty_caches, empty_destroyed
from tests.plugins.workers import WORKER_BYTES


class Owner(QObject):
    """Holds something large."""

    def __init__(self) -> None:
        super().__init__()
        self.large: list[int] | None = [1, 2, 3]


@cache
def answer() -> object:
    return object()


def test_destroyed_objects_are_emptied_and_others_are_not() -> None:
    gone, alive = Owner(), Owner()
    shiboken6.delete(gone)
    empty_destroyed()
    assert vars(gone) == {}
    assert alive.large == [1, 2, 3]


def test_caches_of_one_owner_are_emptied() -> None:
    first = answer()
    empty_caches("app.")
    assert answer() is first
    empty_caches()
    assert answer() is not first


def test_nothing_is_frozen_while_tests_run() -> None:
    before = gc.get_freeze_count()
    gc.freeze()
    assert gc.get_freeze_count() == before


def test_only_a_new_peak_counts() -> None:
    peaks = Peaks()
    for used, test in ((5_000_000, "a"), (9_000_000, "b"), (7_000_000, "c")):
        peaks.add("gw0", used, test)
    assert peaks.lines() == ["gw0: at most 9 MB, in b"]
    assert not peaks.over()
    peaks.add("gw1", WORKER_BYTES + 1, "d")
    assert peaks.over()


def test_a_worker_may_hold_a_gigabyte() -> None:
    assert pytest.approx(1e9) == WORKER_BYTES
