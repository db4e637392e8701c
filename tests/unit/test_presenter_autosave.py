"""Keeping a place: the newest state, once, whatever comes in between."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any
from unittest.mock import MagicMock

import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token, silent
from app.core.places.place import Place, PlaceError
from app.core.places.place_folder import create_place, read_place, write_place
from app.devices.clock import VirtualClock
from app.ui.presenters.autosave import Autosave
from app.ui.presenters.services import Services

if TYPE_CHECKING:
    from pathlib import Path


class Later:
    """A runner whose work is done when the test says so."""

    def __init__(self) -> None:
        self.work: list[Any] = []

    def submit(self, key: str, work: Any, **_rest: Any) -> None:
        self.work.append(work)

    def run(self, token: Token | None = None) -> None:
        work, self.work = self.work, []
        for one in work:
            one(token or Token(), silent)


@pytest.fixture
def runner() -> Later:
    return Later()


@pytest.fixture
def keeper(runner: Later) -> Autosave:
    services = MagicMock(spec=Services)
    services.runner, services.clock = runner, VirtualClock()
    return Autosave(services, MagicMock(), MagicMock())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return create_place(tmp_path, "here", datetime.now(UTC))


def place_with(folder: Path, needle_deg: float) -> Place:
    return replace(read_place(folder), needle_deg=needle_deg)


def test_only_the_last_of_what_moves_is_written(
    keeper: Autosave, runner: Later, folder: Path
) -> None:
    for needle in range(50):
        keeper.keep(folder, place_with(folder, float(needle)))
    assert len(runner.work) == 1
    assert read_place(folder).needle_deg is None
    runner.run()
    assert read_place(folder).needle_deg == 49.0


def test_what_is_written_at_once_is_not_overtaken(
    keeper: Autosave, runner: Later, folder: Path
) -> None:
    keeper.keep(folder, place_with(folder, 1.0))
    keeper.keep_now(folder, place_with(folder, 2.0))
    runner.run()
    assert read_place(folder).needle_deg == 2.0


def test_stopped_work_still_writes_what_was_handed_over(
    keeper: Autosave, runner: Later, folder: Path
) -> None:
    keeper.keep(folder, place_with(folder, 5.0))
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        runner.run(token)
    assert read_place(folder).needle_deg == 5.0


def test_two_places_are_both_kept(keeper: Autosave, runner: Later, tmp_path: Path) -> None:
    now = datetime.now(UTC)
    first, second = create_place(tmp_path, "a", now), create_place(tmp_path, "b", now)
    keeper.keep(first, place_with(first, 1.0))
    keeper.keep(second, place_with(second, 2.0))
    runner.run()
    assert [read_place(one).needle_deg for one in (first, second)] == [1.0, 2.0]


def full(patch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    patch.setattr("app.core.base.atomic_files.os.replace", refuse)


def test_what_a_full_disk_refused_is_written_once_there_is_room(
    keeper: Autosave, runner: Later, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = datetime.now(UTC)
    first, second = create_place(tmp_path, "a", now), create_place(tmp_path, "b", now)
    with monkeypatch.context() as patch:
        full(patch)
        keeper.keep(first, place_with(first, 1.0))
        with pytest.raises(PlaceError, match="no space left"):
            runner.run()
        kept = keeper.unkept(first)
        assert kept is not None
        assert kept.needle_deg == 1.0
        with pytest.raises(PlaceError):
            keeper.keep_now(first, place_with(first, 2.0))
    keeper.keep(second, place_with(second, 3.0))
    runner.run()
    assert [read_place(one).needle_deg for one in (first, second)] == [2.0, 3.0]
    assert keeper.unkept(first) is None


def test_who_hands_over_never_waits_for_the_disk(
    keeper: Autosave, runner: Later, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def slow(*given: Any) -> None:
        # As from another thread, in the middle of writing.
        keeper.keep(folder, place_with(folder, 2.0))
        write_place(*given)

    with monkeypatch.context() as patch:
        patch.setattr("app.ui.presenters.autosave.write_place", slow)
        keeper.keep(folder, place_with(folder, 1.0))
        runner.run()
    assert read_place(folder).needle_deg == 1.0
    assert len(runner.work) == 1
    runner.run()
    assert read_place(folder).needle_deg == 2.0
