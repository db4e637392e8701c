"""Captures that are cut off, cancelled or killed, on virtual time."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from app.core.base.errors import Cancelled
from app.core.environment.environment import read_environment
from app.devices.capture.capture_steps import ENVIRONMENT
from app.devices.capture.session import Session
from app.devices.capture.status import Stage
from app.devices.errors import CameraNotReady, DeviceError, Unreachable
from app.devices.simulated.commands import begin_picture
from app.devices.simulated.exchange import Reply, Request
from tests.helpers.cameras import Rig
from tests.helpers.captures import (
    Killed,
    Weather,
    asked,
    capture,
    rig,
    when,
    without_merging,
    without_waiting_for_the_disk,
)
from tests.helpers.cases import sample_first
from tests.helpers.simulated import stored


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    without_waiting_for_the_disk(monkeypatch)
    without_merging(monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("model", sample_first(["V", "SC2", "S", "X", "A1"], 2))
@pytest.mark.parametrize("words", ["startCapture", "takePicture", "_autoBracket", "iso"])
def test_a_drop_while_shooting_is_recovered(tmp_path: Path, model: str, words: str) -> None:
    made = rig(tmp_path, model)
    before = copy.deepcopy(made.camera.options)
    weather = Weather(made)
    when(made, words, lambda: weather.lose(12.0))
    result = made.shoot()
    assert len(result.frames) == 3
    assert len({file.take and file.take.exposure.ev for file in stored(made.camera)[-3:]}) == 3
    assert made.camera.options == before


def test_a_bracket_that_was_heard_is_not_taken_twice(tmp_path: Path) -> None:
    made = rig(tmp_path, "Z1")
    weather = Weather(made)
    when(made, "startCapture", lambda: weather.lose(12.0))
    made.shoot()
    assert asked(made, "startCapture") == 1
    assert len(stored(made.camera)) == 3


def test_a_lost_camera_ends_in_a_sentence_and_the_journal_keeps_its_settings(
    tmp_path: Path,
) -> None:
    made = rig(tmp_path)
    before = copy.deepcopy(made.camera.options)
    weather = Weather(made)
    when(made, "startCapture", lambda: weather.lose(1e6))
    with pytest.raises(Unreachable) as caught:
        made.shoot()
    assert "Wi-Fi" in caught.value.hint
    assert "open this session again" in caught.value.hint
    assert made.clock.now() < 400.0
    assert Session.open(made.folder).journal.settings_to_restore["exposureProgram"] == 2
    # The camera went on by itself; later the session goes on from there.
    weather.lost_until = made.clock.now()
    result = made.shoot()
    assert len(result.frames) == 3
    assert asked(made, "startCapture") == 1
    assert made.camera.options == before


def test_another_camera_does_not_go_on_with_a_session(tmp_path: Path) -> None:
    made = rig(tmp_path, "V")
    weather = Weather(made)
    when(made, "startCapture", lambda: weather.lose(1e6))
    with pytest.raises(DeviceError):
        made.shoot()
    with pytest.raises(CameraNotReady, match="A different camera"):
        rig(tmp_path, "Z1").shoot()


def test_a_finished_session_needs_no_camera(tmp_path: Path) -> None:
    made = rig(tmp_path)
    first = made.shoot()
    light = first.environment.read_bytes()
    weather = Weather(made)
    weather.lose(1e6)
    again = made.shoot()
    assert again.frames == first.frames
    assert again.plan == first.plan
    assert again.info is None
    assert read_environment(again.environment).radiance.tobytes() == (
        read_environment(first.environment).radiance.tobytes()
    )
    assert light


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("V", "_filter"),
        ("V", "takePicture"),
        ("V", "shutterSpeedSupport"),
        ("V", "startCapture"),
        ("SC2", "startCapture"),
        ("A1", "dynamicLoad"),
        ("S", "startSession"),
    ],
)
def test_cancelling_gives_the_camera_back(tmp_path: Path, model: str, words: str) -> None:
    made = rig(tmp_path, model)
    before = copy.deepcopy(made.camera.options)
    when(made, words, made.token.cancel)
    with pytest.raises(Cancelled):
        made.shoot()
    assert made.seen[-1].stage is Stage.CANCELLED
    assert not made.camera.shooter.busy
    assert made.camera.options == before
    assert not (made.folder / ENVIRONMENT).exists()


def test_cancelling_during_the_self_timer(tmp_path: Path) -> None:
    made = rig(tmp_path)
    when(made, "startCapture", made.token.cancel)
    with pytest.raises(Cancelled):
        capture(made, delay_s=10).run()
    assert asked(made, "_stopSelfTimer") == 1
    assert stored(made.camera) == ()


def test_cancelling_while_files_come_keeps_them(tmp_path: Path) -> None:
    made = rig(tmp_path)
    tell = made.seen.append

    def stop_at_the_second(status: Any) -> None:
        tell(status)
        if sum(row.done for row in status.frames) == 1:
            made.token.cancel()

    made.seen = Listener(stop_at_the_second, made.seen)
    with pytest.raises(Cancelled):
        made.shoot()
    assert len(list((made.folder / "originals").glob("*.JPG"))) == 1
    made.token = type(made.token)()
    made.seen = []
    assert len(made.shoot().frames) == 3
    assert asked(made, "startCapture") == 1


class Listener(list[Any]):
    """A list whose `append` does something else."""

    def __init__(self, append: Callable[[Any], None], items: list[Any]) -> None:
        super().__init__(items)
        self._append = append

    def append(self, item: Any) -> None:
        self._append(item)


KILLED = [
    *(
        (m, w)
        for m in ("V", "S", "SC2", "A1")
        for w in ("captureMode", "takePicture", "type=thumb")
    ),
    *((model, "startCapture") for model in ("V", "S", "SC2", "X")),
    ("A1", "dynamicLoad"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("model", "words"), KILLED)
def test_a_killed_capture_goes_on(tmp_path: Path, model: str, words: str) -> None:
    made = rig(tmp_path, model)
    before = copy.deepcopy(made.camera.options)
    weather = Weather(made)
    when(made, words, lambda: setattr(weather, "dead", True))
    with pytest.raises(Killed):
        made.shoot()
    weather.dead = False
    made.clock.sleep(2.0)
    result = made.shoot()
    assert len(result.frames) == 3
    assert made.camera.options == before
    check_nothing_surplus(made)


def check_nothing_surplus(made: Rig) -> None:
    """The camera holds the three frames of the bracket and nothing else."""
    here = sorted(path.read_bytes() for path in (made.folder / "originals").glob("*.JPG"))
    assert sorted(file.data for file in stored(made.camera)) == here
    assert len(here) == 3


def kill(made: Rig, words: str, number: int = 1, *, heard: bool = True) -> None:
    """End the program when so many requests with these words have been sent."""
    weather = Weather(made)
    answer, count = made.camera.answer, 0

    def wrapped(request: Request) -> Reply:
        nonlocal count
        count += words in request.body.decode()
        if count == number and words in request.body.decode():
            if heard:
                answer(request)
            raise Killed
        return answer(request)

    made.camera.answer = wrapped  # type: ignore[method-assign]
    with pytest.raises(Killed):
        made.shoot()
    made.camera.answer = weather.answer  # type: ignore[method-assign]


@pytest.mark.parametrize("wait_s", [0.5, 600.0])
@pytest.mark.parametrize(
    ("model", "words", "number"),
    [
        ("V", "takePicture", 1),
        ("SC2", "takePicture", 1),
        ("insta360", "takePicture", 1),
        ("insta360", "takePicture", 3),
        ("A1", "takePicture", 2),
        ("A1", "takePicture", 4),
        ("A1", "dynamicLoad", 1),
    ],
)
def test_a_killed_capture_leaves_no_surplus_picture(
    tmp_path: Path, model: str, words: str, number: int, wait_s: float
) -> None:
    made = rig(tmp_path, model)
    kill(made, words, number)
    made.clock.sleep(wait_s)
    assert len(made.shoot().frames) == 3
    check_nothing_surplus(made)


@pytest.mark.parametrize(("model", "number"), [("V", 1), ("A1", 1), ("A1", 3), ("insta360", 2)])
def test_a_picture_of_the_photographer_is_never_deleted(
    tmp_path: Path, model: str, number: int
) -> None:
    made = rig(tmp_path, model)
    kill(made, "takePicture", number, heard=False)
    made.clock.sleep(90.0)
    begin_picture(made.camera)
    made.clock.sleep(90.0)
    own = stored(made.camera)[-1]
    result = made.shoot()
    assert len(result.frames) == 3
    left = [file.data for file in stored(made.camera)]
    assert own.data in left
    assert len(left) == 4


@pytest.mark.slow
@pytest.mark.parametrize("model", sample_first(["V", "SC2", "S", "X", "A1"], 2))
@pytest.mark.parametrize("heard", [True, False])
def test_a_drop_at_any_moment(tmp_path: Path, model: str, heard: bool) -> None:
    made = rig(tmp_path / "whole", model)
    weather = Weather(made)
    made.shoot()
    for at in range(1, weather.requests + 1, 3):
        made = rig(tmp_path / str(at), model, shape=(32, 64))
        before = copy.deepcopy(made.camera.options)
        weather = Weather(made)
        weather.at[at] = partial(weather.lose, 8.0)
        weather.heard = heard
        result = made.shoot()
        assert len(result.frames) == 3
        assert made.camera.options == before
