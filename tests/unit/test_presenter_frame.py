"""The frame around the screens: words for place, camera and what is to be known."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from app.devices.theta.camera_identity import FoundCamera
from app.devices.theta.endpoint import Endpoint
from app.ui.presenters.services import Services, View
from app.ui.presenters.undo_stack import Undoable, UndoStack
from app.ui.presenters.window_frame import STROKES_KEPT, FramePresenter, camera_words
from app.ui.presenters.window_model import CameraSeen, Model, Step
from app.ui.screens.registry import SCREENS

CEST = timezone(timedelta(hours=2))
NOW = datetime(2026, 11, 21, 14, 5, tzinfo=CEST)
FOUND = FoundCamera("THETA", Endpoint("192.168.1.1"), "RICOH THETA V", "00112358", "access point")


@pytest.fixture
def services() -> Any:
    made = MagicMock(spec=Services)
    made.model, made.undo, made.today = Model(), UndoStack(), lambda: NOW
    return made


def test_a_camera_is_said_with_what_it_tells() -> None:
    seen = CameraSeen(FOUND, 0.82, 1_900_000_000)
    assert camera_words(seen) == "THETA V, 82%, 1.9 GB free"
    assert camera_words(replace(seen, battery=None, free_bytes=None)) == "THETA V"


@pytest.mark.parametrize(
    ("battery", "free", "warning"),
    [
        (0.15, 200_000_000, ""),
        (0.149, 10**9, "Battery low"),
        (0.5, 199_000_000, "Card almost full"),
        (None, None, ""),
    ],
)
def test_a_camera_that_needs_looking_after_says_so(
    services: Any, battery: float | None, free: int | None, warning: str
) -> None:
    services.model.update(camera=CameraSeen(FOUND, battery, free))
    assert FramePresenter(services).resolve().camera_warning == warning


def results(*attainable: bool) -> tuple[Any, ...]:
    """Results of styles of the user's own, which are no pairs."""
    facts = {"grade": None, "match": 50.0, "same_picture": ()}
    return tuple(
        SimpleNamespace(name=str(i), attainable=one, **facts) for i, one in enumerate(attainable)
    )


@pytest.mark.parametrize(
    ("reach", "numbers"),
    [((True, True), ["2", "2"]), ((True, False), ["1", "2"]), ((False,) * 3, ["0", "3"])],
)
def test_the_foot_says_how_many_styles_the_place_gives(
    services: Any, reach: tuple[bool, ...], numbers: list[str]
) -> None:
    services.model.update(step=Step.STYLES, light=object(), results=results(*reach))
    assert re.findall("[0-9]+", FramePresenter(services).resolve().status) == numbers


def test_the_foot_of_painting_and_turning(services: Any) -> None:
    presenter = FramePresenter(services)
    services.model.update(step=Step.STYLES, painting="top")
    assert presenter.resolve().status == STROKES_KEPT
    services.model.update(step=Step.TURN, painting=None)
    assert presenter.resolve().status_icon == "sound"
    services.model.update(settings=services.model.settings.with_("sounds", False))
    assert presenter.resolve().status == "Sound off"


def test_steps_are_done_when_they_have_what_they_are_for(services: Any) -> None:
    model = services.model

    def done() -> set[str]:
        return {spec.key for spec in SCREENS if spec.done(model)}

    assert done() == set()
    model.update(light=object())
    assert done() == {Step.PROBE}
    model.update(goal_deg=3.0)
    assert done() == {Step.PROBE, Step.STYLES}
    model.update(reached=model.aim)
    assert done() == {Step.PROBE, Step.STYLES, Step.TURN}
    # Where the photographer stands is no other goal; another turn, another style are.
    model.update(front_deg=10.0, goal_deg=-7.0)
    assert Step.TURN in done()
    for change in ({"goal_deg": -8.0}, {"goal_deg": -7.0, "chosen": "top"}, {"goal_deg": None}):
        model.update(**change)
        assert Step.TURN not in done()


def test_the_rail_is_told_when_the_goal_is_reached(services: Any) -> None:
    view = MagicMock(spec=View)
    FramePresenter(services).attach(view)
    services.model.update(reached=(None, "top", 3.0))
    assert view.show_state.call_count == 2


def test_the_view_is_told_of_what_it_shows_and_of_nothing_else(services: Any) -> None:
    view = MagicMock(spec=View)
    FramePresenter(services).attach(view)
    services.model.update(needle_deg=4.0)
    assert view.show_state.call_count == 1
    services.model.update(step=Step.LIGHT)
    services.undo.push(Undoable("stroke", lambda: None, lambda: None))
    assert view.show_state.call_count == 3
    assert view.show_state.call_args.args[0].undo == "stroke"
