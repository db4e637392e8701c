"""A background is learnt once, by whichever thread needs it first."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token, silent
from app.core.localization import features
from app.ui.presenters.backgrounds import Backgrounds
from tests.helpers.styles_screen import Table, lamp_light
from tests.helpers.waiting import PATIENCE_S


def place(seed: int) -> Any:
    chance = np.random.default_rng(seed)
    return MagicMock(display=chance.integers(0, 255, (64, 128, 3), np.uint8))


class Builder:
    """Builds an index when it may, and counts."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.built = 0
        self.begun, self.may_end = threading.Event(), threading.Event()
        patch.setattr(features, "build_index", self._build)

    def _build(self, panorama: object, token: Token, report: object) -> object:
        del panorama, report
        self.built += 1
        self.begun.set()
        while not self.may_end.wait(0.01):
            token.check()
        return object()


@pytest.fixture
def builder(monkeypatch: pytest.MonkeyPatch) -> Builder:
    return Builder(monkeypatch)


def test_who_comes_second_waits_for_the_first(builder: Builder) -> None:
    backgrounds, light, found = Backgrounds(), place(1), []

    def find() -> None:
        found.append(backgrounds.find(light, None, Token(), silent))

    threads = [threading.Thread(target=find) for _ in range(2)]
    for thread in threads:
        thread.start()
    assert builder.begun.wait(PATIENCE_S)
    assert backgrounds.at_hand(light) is None
    builder.may_end.set()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert builder.built == 1
    assert found[0] is found[1] is backgrounds.at_hand(light)


def test_who_waits_can_be_cancelled(builder: Builder) -> None:
    backgrounds = Backgrounds()
    first = threading.Thread(target=backgrounds.find, args=(place(1), None, Token(), silent))
    first.start()
    assert builder.begun.wait(PATIENCE_S)
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        backgrounds.find(place(2), None, token, silent)
    builder.may_end.set()
    first.join(PATIENCE_S)


def test_who_is_cancelled_leaves_the_work_to_the_next(builder: Builder) -> None:
    backgrounds, token = Backgrounds(), Token()
    token.cancel()
    with pytest.raises(Cancelled):
        backgrounds.find(place(1), None, token, silent)
    builder.may_end.set()
    assert backgrounds.find(place(1), None, Token(), silent) is backgrounds.at_hand(place(1))


def test_only_the_latest_places_take_memory(builder: Builder) -> None:
    builder.may_end.set()
    backgrounds = Backgrounds()
    for seed in (1, 2, 3, 1, 4):
        backgrounds.find(place(seed), None, Token(), silent)
    assert builder.built == 4
    assert [backgrounds.at_hand(place(seed)) is not None for seed in (1, 2, 3, 4)] == [
        True, False, True, True,
    ]  # fmt: skip


def test_the_gallery_learns_the_background_once_its_pictures_are_done(
    tmp_path: Path, builder: Builder
) -> None:
    builder.may_end.set()
    table = Table(tmp_path, backgrounds=Backgrounds())
    light = lamp_light(60.0)
    table.runner.held.add("styles-background")
    table.open(light)
    assert "styles-pictures-larger" in table.runner.ran
    ran = table.runner.ran
    assert ran.index("styles-background") > ran.index("styles-pictures-larger")
    assert table.services.backgrounds.at_hand(light) is None
    table.runner.release("styles-background")
    assert table.services.backgrounds.at_hand(light) is not None
    assert builder.built == 1


def test_small_pictures_come_first_at_each_new_place(tmp_path: Path) -> None:
    """Also if the screen is drawn between the light of a place and its answers."""
    table = Table(tmp_path)
    table.open(lamp_light(60.0))
    table.presenter.attach(MagicMock())
    table.runner.ran.clear()
    table.runner.held.update({"solve", "styles-pictures-larger"})
    # as the place controller does
    table.model.update(light=lamp_light(-30.0), results=(), answered=None)
    table.runner.release("solve")
    snapshot = table.presenter._pictures.snapshot
    assert snapshot is not None
    assert snapshot.results
    assert snapshot.quick
    table.runner.release("styles-pictures-larger")
    snapshot = table.presenter._pictures.snapshot
    assert snapshot is not None
    assert not snapshot.quick
