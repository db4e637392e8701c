"""What may go wrong between the first and the last exposure of a bracket, on virtual time."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.core.base.errors import Cancelled, CoreError
from app.devices.capture.session import Session
from app.devices.capture.status import Stage, Status
from app.devices.errors import CaptureFailed
from app.devices.simulated.exchange import Reply, Request
from app.devices.simulated.scene import Scene
from app.words.remarks import sentences
from tests.helpers.cameras import Rig, room
from tests.helpers.captures import (
    Weather,
    asked,
    capture,
    rig,
    when,
    without_merging,
    without_waiting_for_the_disk,
)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    without_waiting_for_the_disk(monkeypatch)
    without_merging(monkeypatch)


class CancelAt(list[Status]):
    """Notes what it is told, and cancels when an exposure begins."""

    def __init__(self, made: Rig, shot: int) -> None:
        super().__init__()
        self._made, self._shot = made, shot

    def append(self, status: Status) -> None:
        super().append(status)
        if status.stage is Stage.EXPOSING and status.shot == self._shot:
            self._made.token.cancel()


def when_number(made: Rig, words: str, number: int, act: Callable[[], None]) -> None:
    """Do something when a request with these words in it was answered so many times."""
    answer = made.camera.answer
    seen: list[Request] = []

    def wrapped(request: Request) -> Reply:
        reply = answer(request)
        if words in request.body.decode():
            seen.append(request)
            if len(seen) == number:
                act()
        return reply

    made.camera.answer = wrapped  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("model", "faults", "seconds"), [("SC2", (), 55.0), ("V", ("never-done",), 58.0)]
)
def test_a_bracket_that_ended_unheard_is_no_failure(
    tmp_path: Path, model: str, faults: tuple[str, ...], seconds: float
) -> None:
    made = rig(tmp_path, model, faults=faults)
    weather = Weather(made)
    when(made, "startCapture", lambda: weather.lose(seconds))
    assert len(made.shoot().frames) == 3
    assert asked(made, "startCapture") == 1


def test_a_link_lost_while_asking_how_far_it_is(tmp_path: Path) -> None:
    made = rig(tmp_path, "V", faults=("never-done",))
    weather = Weather(made)

    def lose() -> None:
        weather.lose(58.0)

    when(made, "startCapture", lambda: when(made, "osc/commands/status", lose))
    assert len(made.shoot().frames) == 3
    assert asked(made, "startCapture") == 1


@pytest.mark.parametrize("model", ["SC2", "V"])
def test_a_bracket_that_never_ends_is_given_up(tmp_path: Path, model: str) -> None:
    made = rig(tmp_path, model)

    def last_for_ever() -> None:
        job = made.camera.shooter.job
        assert job is not None
        job.frames[-1] = replace(job.frames[-1], end=1e6)

    when(made, "startCapture", last_for_ever)
    with pytest.raises(CaptureFailed, match="did not finish the bracket"):
        made.shoot()
    assert made.clock.now() < 300.0


def test_cancelling_waits_for_a_long_single_exposure(tmp_path: Path) -> None:
    made = rig(tmp_path, "A1", scene=Scene(0.1 * room()))
    before = copy.deepcopy(made.camera.options)
    when_number(made, "takePicture", 2, made.token.cancel)
    with pytest.raises(Cancelled) as caught:
        made.shoot()
    assert asked(made, "stopCapture") == 1
    assert not made.camera.shooter.busy
    assert made.camera.options == before
    assert caught.value.hint == ""
    assert len(Session.open(made.folder).journal.frames) == 1


def test_a_full_disk_while_cancelling_does_not_keep_the_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rig(tmp_path)
    before = copy.deepcopy(made.camera.options)

    def full(session: Session, entries: Any) -> Any:
        if made.token.cancelled:
            raise CoreError("The disk is full.")

    monkeypatch.setattr(Session, "set_frames", full)
    when(made, "startCapture", made.token.cancel)
    with pytest.raises(Cancelled):
        made.shoot()
    assert made.camera.options == before


@pytest.mark.parametrize("model", ["A1", "V"])
def test_a_bracket_cut_short_is_shot_again(tmp_path: Path, model: str) -> None:
    made = rig(tmp_path, model)
    made.seen = CancelAt(made, 5)
    with pytest.raises(Cancelled):
        made.shoot("full")
    cut = Session.open(made.folder).journal
    assert cut.plan is not None
    assert 3 <= len(cut.frames) < len(cut.plan.shots)
    made.token, made.seen = type(made.token)(), []
    result = made.shoot("full")
    assert len(result.frames) == len(result.plan.shots)
    assert any("shot again" in sentence for sentence in sentences(result.warnings))


@pytest.mark.parametrize("model", ["generic", "V"])
def test_a_self_timer_that_does_not_run_is_said(tmp_path: Path, model: str) -> None:
    made = rig(tmp_path, model)
    answer = made.camera.answer

    def without_timer(request: Request) -> Reply:
        body = re.sub(rb'("exposureDelay": ?)10', rb"\g<1>99", request.body)
        return answer(replace(request, body=body))

    made.camera.answer = without_timer  # type: ignore[method-assign]
    result = capture(made, delay_s=10).run()
    assert any("self-timer" in sentence for sentence in sentences(result.warnings))
    assert not any(status.message == "Self-timer" for status in made.seen)
