"""Whole captures against the simulated camera, on virtual time."""

from __future__ import annotations

import copy
import errno
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from app.core.base.errors import Cancelled, CoreError
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.fisheye.remarks import CirclesStitched
from app.core.measure.fisheye.stitch import Stitching
from app.devices.capture import camera_settings
from app.devices.capture.capture_steps import ENVIRONMENT
from app.devices.capture.exposures import bracket, metering
from app.devices.capture.session import Session
from app.devices.capture.status import Stage
from app.devices.errors import CameraNotReady, CaptureFailed, not_written
from app.devices.simulated.scene import Scene
from app.words.remarks import sentences
from tests.faulty_camera.models import PERSONALITIES, personality_named
from tests.helpers.cameras import Rig, room
from tests.helpers.captures import (
    TINY,
    Weather,
    asked,
    capture,
    rig,
    when,
    without_merging,
    without_waiting_for_the_disk,
)
from tests.helpers.simulated import stored

MODELS = [personality.name for personality in PERSONALITIES]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    without_waiting_for_the_disk(monkeypatch)
    if "real_merge" not in request.fixturenames:
        without_merging(monkeypatch)


@pytest.fixture
def real_merge() -> None:
    """Ask for frames that are really merged."""


@pytest.mark.slow
@pytest.mark.parametrize("plan", ["paper", "full"])
@pytest.mark.parametrize("model", MODELS)
def test_every_camera_takes_every_bracket(
    tmp_path: Path, model: str, plan: Literal["paper", "full"]
) -> None:
    made = rig(tmp_path, model)
    before = copy.deepcopy(made.camera.options)
    result = made.shoot(plan)
    assert made.camera.options == before
    assert len(result.frames) == len(result.plan.shots)
    if plan == "paper":
        assert [round(shot.wanted_ev) for shot in result.plan.shots] == [0, 2, -2]
    else:
        assert len(result.plan.shots) > 3
    # Each file is the camera's own, in the order of shooting; the picture for metering is gone.
    written = stored(made.camera)
    assert [path.read_bytes() for path in result.frames] == [file.data for file in written]
    for shot, file in zip(result.plan.shots, written, strict=True):
        assert file.take is not None
        assert file.take.exposure.ev == pytest.approx(shot.exposure.ev, abs=1e-3)
    assert not [
        line for line in sentences(result.warnings) if "instead of" in line or "equal" in line
    ]
    assert result.environment == tmp_path / "session" / ENVIRONMENT
    assert read_environment(result.environment).radiance.shape[1] >= 64
    journal = Session.open(made.folder).journal
    assert journal.stage == "done"
    assert journal.settings_to_restore == {}
    assert [frame.done for frame in journal.frames] == [True] * len(result.frames)
    assert set(result.seconds) == {"metering", "exposing", "download", "merge"}


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("S", '"_mode":"bracket"'),
        ("SC2", '"_mode":"bracket"'),
        ("Z1", '"_mode":"bracket"'),
        ("X", '"_shootingMethod":"bracket","_autoBracket"'),
    ],
)
def test_the_camera_brackets_by_itself(tmp_path: Path, model: str, words: str) -> None:
    made = rig(tmp_path, model)
    made.shoot()
    assert any(words in r.body.decode().replace(" ", "") for r in made.camera.log)
    assert asked(made, "takePicture") == 1  # for metering


@pytest.mark.parametrize("model", ["A1", "generic", "insta360"])
def test_cameras_without_a_bracket_take_single_pictures(tmp_path: Path, model: str) -> None:
    made = rig(tmp_path, model)
    made.shoot()
    assert asked(made, "takePicture") == 4
    assert asked(made, "startCapture") == 0


@pytest.mark.usefixtures("real_merge")
def test_an_insta360_that_stitches_nothing_is_stitched_here(tmp_path: Path) -> None:
    made = rig(tmp_path, "insta360", shape=(320, 640))
    result = made.shoot()
    assert asked(made, "photoStitchingSupport") == 1
    stitching = result.probe.of(Stitching)
    assert stitching is not None
    assert stitching.up_deg == 90.0
    assert any(isinstance(each, CirclesStitched) for each in result.warnings)
    truth = reduce_radiance(made.camera.scene.environment, (32, 64)).ravel()
    seen = reduce_radiance(result.probe.merged.radiance, (32, 64)).ravel()
    assert np.corrcoef(np.log(truth + 1e-3), np.log(seen + 1e-3))[0, 1] > 0.9


@pytest.mark.parametrize(
    ("kin", "model", "sizes", "mode"),
    [
        ("Z1", "RICOH THETA Z2", ((3840, 7680),), True),
        ("X", "RICOH THETA X2", ((8192, 16384), (4096, 8192)), False),
        ("V", "RICOH THETA W", ((2688, 5376),), True),
    ],
)
def test_a_theta_of_tomorrow_brackets_by_itself_as_it_says(
    tmp_path: Path, kin: str, model: str, sizes: tuple[tuple[int, int], ...], mode: bool
) -> None:
    made = rig(tmp_path, replace(personality_named(kin), model=model, sizes=sizes))
    before = copy.deepcopy(made.camera.options)
    result = made.shoot()
    assert (result.profile.title, len(result.frames)) == ("Ricoh Theta", 3)
    assert result.profile.picture == (sizes[-1][1], sizes[-1][0])
    assert asked(made, "takePicture") == 1
    assert asked(made, '"_mode"') == mode
    assert made.camera.options == before


def test_an_insta360_is_asked_for_few_files_at_a_time(tmp_path: Path) -> None:
    made = rig(tmp_path, "insta360", scene=Scene(np.float32(5.0) * room()))
    made.shoot("full")
    counts = [
        json.loads(request.body)["parameters"]["entryCount"]
        for request in made.camera.log
        if b"listFiles" in request.body
    ]
    assert max(counts) <= 10
    assert asked(made, "takePicture") <= 10


def test_seams_are_kept_from_the_first_single_picture(tmp_path: Path) -> None:
    made = rig(tmp_path, "A1")
    made.shoot()
    assert asked(made, "dynamicSave") == asked(made, "ApplySave") == 1
    assert asked(made, "dynamicLoad") == asked(made, "ApplyLoad") == 2


def test_an_sc2_is_watched_and_found_done(tmp_path: Path) -> None:
    made = rig(tmp_path, "SC2")
    made.shoot()
    bracket = next(k for k, r in enumerate(made.camera.log) if b"startCapture" in r.body)
    later = made.camera.log[bracket + 1 :]
    states = [r for r in later if r.target == "/osc/state"]
    assert len(states) > 4
    assert not [r for r in later if r.target == "/osc/commands/status"]


def test_a_refused_bracket_becomes_single_pictures(tmp_path: Path) -> None:
    made = rig(tmp_path, "V")
    object.__setattr__(made.camera.personality.bracket, "most", 1)
    try:
        result = made.shoot()
    finally:
        object.__setattr__(made.camera.personality.bracket, "most", 19)
    assert asked(made, "takePicture") == 4
    assert len(result.frames) == 3


USED: dict[str, Any] = {
    "exposureProgram": 1,
    "shutterSpeed": 0.008,
    "iso": 200,
    "whiteBalance": "incandescent",
    "sleepDelay": 300,
    "offDelay": 900,
    "exposureDelay": 5,
}


@pytest.mark.parametrize("model", MODELS)
def test_the_users_own_settings_come_back(tmp_path: Path, model: str) -> None:
    made = rig(tmp_path, model)
    made.camera.store.set({**USED})
    if made.camera.personality.ricoh:
        made.camera.store.set({"whiteBalance": "_colorTemperature", "_colorTemperature": 3200})
        made.camera.store.set({"whiteBalance": "shade"})
    made.camera.store.set({"captureMode": "video"})
    before = copy.deepcopy(made.camera.options)
    made.shoot()
    assert made.camera.options == before


def test_a_filter_comes_back(tmp_path: Path) -> None:
    made = rig(tmp_path, "V")
    made.camera.store.set({"_filter": "hdr"})
    before = copy.deepcopy(made.camera.options)
    made.shoot()
    assert made.camera.options == before


@pytest.mark.usefixtures("real_merge")
@pytest.mark.parametrize("model", ["Z1", "A1"])
def test_frames_become_an_environment(tmp_path: Path, model: str) -> None:
    made = rig(tmp_path, model)
    result = made.shoot()
    light = read_environment(result.environment).radiance
    assert light.shape == (*TINY, 3)
    assert np.array_equal(light, result.probe.merged.radiance)
    assert set(result.probe.warnings) <= set(result.warnings)


def test_what_the_status_says(tmp_path: Path) -> None:
    made = rig(tmp_path)
    made.shoot("full")
    stages = list(dict.fromkeys(status.stage for status in made.seen))
    assert stages == [
        Stage.CONNECTING,
        Stage.METERING,
        Stage.EXPOSING,
        Stage.DOWNLOADING,
        Stage.MERGING,
        Stage.DONE,
    ]
    fractions = [status.fraction for status in made.seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    exposing = [s for s in made.seen if s.stage is Stage.EXPOSING and s.shot]
    shots = [status.shot for status in exposing]
    assert shots == sorted(shots)
    assert set(shots) == set(range(1, exposing[-1].shots + 1))
    left = [s.seconds_left for s in exposing if s.seconds_left is not None]
    assert left == sorted(left, reverse=True)
    moving = [status.may_move for status in made.seen]
    assert moving == sorted(moving)
    assert not any(s.may_move for s in exposing if s.shot < s.shots)
    last = made.seen[-1]
    assert all(row.done and row.thumbnail is not None for row in last.frames)


def test_a_preview_has_time_to_end_before_the_camera_is_asked(tmp_path: Path) -> None:
    made = rig(tmp_path)
    asked_at: list[float] = []
    when(made, "/osc/info", lambda: asked_at.append(made.clock.now()))
    capture(made).run()
    assert asked_at[0] >= 0.5


def test_a_self_timer_runs_once(tmp_path: Path) -> None:
    for model in ("V", "A1"):
        made = rig(tmp_path / model, model)
        capture(made, delay_s=5).run()
        assert asked(made, '"exposureDelay": 5') + asked(made, '"exposureDelay":5') == 1


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda camera: setattr(camera, "battery", 0.05), r"bracket \(5%\)"),
        (
            lambda camera: setattr(camera, "errors", lambda: ("NO_MEMORY",)),
            "storage is full",
        ),
        (
            lambda camera: setattr(camera, "errors", lambda: ("HIGH_TEMPERATURE",)),
            "too hot",
        ),
        (
            lambda camera: setattr(camera, "errors", lambda: ("CAPTURE_HW_FAILED",)),
            "CAPTURE_HW_FAILED",
        ),
        (
            lambda camera: setattr(camera, "free_bytes", lambda: 5_000_000),
            "room for 1 more",
        ),
    ],
)
def test_a_camera_that_cannot_shoot_is_left_alone(
    tmp_path: Path, spoil: Callable[[Any], None], words: str
) -> None:
    made = rig(tmp_path)
    spoil(made.camera)
    with pytest.raises(CameraNotReady, match=words) as caught:
        made.shoot()
    assert caught.value.hint
    assert made.seen[-1].stage is Stage.FAILED
    assert asked(made, "setOptions") == 0


@pytest.mark.parametrize("word", ["ELECTRONIC_COMPASS_CALIBRATION", "NO_DATE_SETTING", "NEW_ONE"])
def test_harmless_words_do_not_stop_a_capture(tmp_path: Path, word: str) -> None:
    made = rig(tmp_path)
    made.camera.errors = lambda: (word,)  # type: ignore[method-assign]
    made.shoot()


def test_old_firmware_is_refused(tmp_path: Path) -> None:
    made = rig(tmp_path, "S")
    object.__setattr__(made.camera.personality, "firmware", "01.42")
    try:
        with pytest.raises(CameraNotReady, match=r"01\.42 is too old"):
            made.shoot()
    finally:
        object.__setattr__(made.camera.personality, "firmware", "01.82")


@pytest.mark.parametrize("model", ["V", "A1"])
def test_equal_exposures_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: str
) -> None:
    made = rig(tmp_path, model)
    shooter = made.camera.shooter
    first: list[dict[str, Any]] = []
    take = shooter.plan

    def same(settings: Any, *rest: Any) -> Any:
        if settings.get("exposureProgram") == 1:
            first.append(dict(settings))
            settings = first[0]
        return take(settings, *rest)

    monkeypatch.setattr(shooter, "plan", same)
    before = copy.deepcopy(made.camera.options)
    with pytest.raises(CaptureFailed, match="three identical exposures") as caught:
        made.shoot()
    assert "kept" in caught.value.hint
    assert len(list((made.folder / "originals").glob("*.JPG"))) == 3
    assert not (made.folder / ENVIRONMENT).exists()
    assert made.camera.options == before


class Listener(list[Any]):
    """A list that acts when a stage is shown."""

    def __init__(self, stage: Stage, act: Callable[[], None]) -> None:
        super().__init__()
        self.stage, self.act = stage, act

    def append(self, item: Any) -> None:
        super().append(item)
        if item.stage is self.stage:
            self.act()


def owing(tmp_path: Path) -> tuple[Rig, Weather, dict[str, Any]]:
    """A capture that is finished, but whose camera was out of reach at the end."""
    made = rig(tmp_path)
    before = copy.deepcopy(made.camera.options)
    weather = Weather(made)
    made.seen = Listener(Stage.MERGING, lambda: weather.lose(1e6))
    result = made.shoot()
    assert any("still using the capture settings" in line for line in sentences(result.warnings))
    assert made.camera.options != before
    return made, weather, before


def test_settings_that_are_owed_are_given_back_later(tmp_path: Path) -> None:
    made, weather, before = owing(tmp_path)
    journal = Session.open(made.folder).journal
    assert journal.finished
    assert journal.settings_to_restore
    weather.lost_until = made.clock.now()
    made.seen = []
    assert capture(made).give_back() == ""
    assert made.camera.options == before
    assert Session.open(made.folder).journal.settings_to_restore == {}


def test_a_session_that_is_only_merged_gives_back_what_it_owes(tmp_path: Path) -> None:
    made, weather, before = owing(tmp_path)
    Session.open(made.folder).update(finished="", stage="merging")
    weather.lost_until = made.clock.now()
    made.seen = []
    made.shoot()
    assert made.camera.options == before


def test_another_camera_does_not_get_what_is_owed(tmp_path: Path) -> None:
    owed = Session.open(owing(tmp_path)[0].folder)
    other = rig(tmp_path, "Z1")
    with pytest.raises(CameraNotReady, match="A different camera"):
        capture(other).give_back()
    # A session that only has to be merged does not need its camera, and takes no other for it.
    owed.update(finished="", stage="merging")
    result = other.shoot()
    assert any("still using the capture settings" in line for line in sentences(result.warnings))
    assert asked(other, "setOptions") == 0
    assert Session.open(other.folder).journal.settings_to_restore


def test_a_full_disk_while_stopping_does_not_keep_the_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rig(tmp_path)
    before = copy.deepcopy(made.camera.options)
    stop = bracket.stop

    def stop_and_fail(job: Any) -> None:
        stop(job)
        raise CoreError("The disk is full.")

    monkeypatch.setattr(bracket, "stop", stop_and_fail)
    when(made, "startCapture", made.token.cancel)
    with pytest.raises(Cancelled):
        made.shoot()
    assert made.seen[-1].stage is Stage.CANCELLED
    assert made.camera.options == before


@pytest.mark.parametrize("stated", [{}, {"offDelay": "off\n"}, {"offDelay": [0] * 1000}])
def test_what_could_not_be_put_back_is_not_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stated: dict[str, Any]
) -> None:
    made = rig(tmp_path)
    before = copy.deepcopy(made.camera.options)
    read = camera_settings.read

    def spoiled(contact: Any, names: Any) -> dict[str, Any]:
        found = read(contact, names)
        if found.pop("offDelay", None) is not None:
            found |= stated
        return found

    monkeypatch.setattr(camera_settings, "read", spoiled)
    made.shoot()
    sent = [request.body for request in made.camera.log if b"setOptions" in request.body]
    assert sent
    assert not [body for body in sent if b"offDelay" in body]
    assert made.camera.options == before


@pytest.mark.parametrize("stated", [[5000], [1e-9], [0.1]])
def test_lists_that_are_no_exposures_give_way_to_the_known_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stated: list[float]
) -> None:
    made = rig(tmp_path)
    read = camera_settings.read
    monkeypatch.setattr(
        camera_settings,
        "read",
        lambda contact, names: {
            name: stated if name == "apertureSupport" else value
            for name, value in ({"apertureSupport": None} | read(contact, names)).items()
        },
    )
    result = made.shoot()
    assert {shot.exposure.aperture for shot in result.plan.shots} == {2.0}


def test_a_full_disk_while_metering_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = rig(tmp_path)

    def full(path: Path, *arguments: Any, **options: Any) -> Any:
        if path.name == ".metering.jpg":
            raise OSError(errno.ENOSPC, "No space left on device")
        return open(path, *arguments, **options)

    monkeypatch.setattr(metering, "open", full, raising=False)
    with pytest.raises(CaptureFailed, match=r"Cannot write to .*: no space left") as caught:
        made.shoot()
    assert caught.value.hint == not_written(CaptureFailed, tmp_path, OSError(errno.ENOSPC, "")).hint
    assert caught.value.code == "disk"
    assert asked(made, "takePicture") == 1
