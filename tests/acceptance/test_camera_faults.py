"""Captures with everything that can go wrong, alone and in pairs, on virtual time.

Each trial is one seed: it draws the model, the plan, one trouble or two, and when they strike. It
must end in success or in a clear failure with a next step, in bounded time, without losing a frame,
without touching anything outside its folder, and with the camera's settings as they were.
"""

from __future__ import annotations

import contextlib
import random
from collections.abc import Mapping
from pathlib import Path

import pytest

from app.core.base.errors import CoreError
from app.core.measure.bracket.grouping import read_bracket
from app.devices.capture.session import Session
from app.devices.errors import DeviceError
from tests.faulty_camera.faults import FAULTS
from tests.faulty_camera.models import PERSONALITIES
from tests.helpers.cameras import Rig
from tests.helpers.cases import sample_first
from tests.helpers.simulated import stored

NAMES = sorted(FAULTS)
MODELS = tuple(person.name for person in PERSONALITIES)
SLOW_RUNS, BLOCK = 560, 35
# How a capture may end with a trouble that lasts; with all others it is done. Equal exposures go
# away, but must never pass for a bracket.
ENDS = {
    "401": {"PasswordNeeded", "NotACamera"},
    # With another trouble the router may not answer either.
    "404-router-in-place-of-the-camera": {"NotACamera", "Unreachable"},
    "battery-low": {"CameraNotReady"},
    "equal-exposures": {"CaptureFailed"},
    # A listing whose every URL is refused names no frame; asking again mostly helps.
    "hostile-urls": {"CaptureFailed", "done"},
    "overheating": {"CameraNotReady", "CameraRefused", "CaptureFailed", "done"},
    "storage-full": {"CameraNotReady", "CameraRefused", "CaptureFailed", "done"},
}
# Longest capture that is still worth waiting for: a full bracket of a slow camera, every pause for
# a link that is gone, and every file fetched several times.
LONGEST_S = 20 * 60.0


def draw(seed: int) -> tuple[str, str, tuple[str, ...]]:
    """Model, plan and troubles of a trial: first every trouble alone, then random pairs."""
    dice = random.Random(seed)
    model, plan = dice.choice(MODELS), dice.choice(("paper", "full"))
    if seed < 4 * len(NAMES):
        return model, plan, (NAMES[seed % len(NAMES)],)
    return model, plan, tuple(sorted(dice.sample(NAMES, 2)))


def trial(seed: int, place: Path) -> str:
    """Run one capture; the outcome in a word."""
    model, plan, faults = draw(seed)
    outside = place / "outside"
    outside.mkdir(parents=True)
    (outside / "keep.txt").write_text("mine", encoding="utf-8")
    rig = Rig(place / "session", model, faults, seed=seed)
    before = dict(rig.camera.options)
    started = rig.clock.now()
    failure: DeviceError | CoreError | None = None
    what = f"seed {seed}: {model}, {plan}, {' and '.join(faults)}"
    try:
        result = rig.shoot("full" if plan == "full" else "paper")
    except (DeviceError, CoreError) as error:
        failure = error
    else:
        assert result.environment.is_file(), what
        bracket = read_bracket(result.frames)
        assert len(bracket.frames) == len(result.frames), what
        held = {file.data for file in stored(rig.camera)}
        assert all(path.read_bytes() in held for path in result.frames), what
    if failure is not None:
        assert failure.message.endswith("."), f"{what}: {failure}"
        assert failure.hint, f"{what}: no next step in {failure.message!r}"
    assert rig.clock.now() - started <= LONGEST_S, what
    check_folders(place, what)
    check_camera(rig, before, what)
    return "done" if failure is None else type(failure).__name__


def check_folders(place: Path, what: str) -> None:
    """Nothing lies or was changed outside the session's folder."""
    assert sorted(path.name for path in place.iterdir()) in (
        ["outside"],
        ["outside", "session"],
    ), what
    assert [path.name for path in (place / "outside").iterdir()] == ["keep.txt"], what
    assert (place / "outside" / "keep.txt").read_text(encoding="utf-8") == "mine", what
    for path in (place / "session").rglob("*"):
        assert not path.is_symlink(), what


def check_camera(rig: Rig, before: Mapping[str, object], what: str) -> None:
    """The camera keeps every frame of a bracket, and has its settings back."""
    for file in rig.deleted:
        metered = file.take is not None and file.take.program == 2 and not file.group
        assert metered, f"{what}: {file.name} was deleted"
    if {"404-router-in-place-of-the-camera", "401"} & {*rig.faults}:
        return
    if owed(rig):
        # The camera was gone at the end. The session knows what it owes, and gives it back.
        with contextlib.suppress(DeviceError, CoreError):
            rig.shoot()
    after = rig.camera.options
    changed = {key: (before[key], after[key]) for key in before if before[key] != after.get(key)}
    assert not changed, f"{what}: {changed}"
    assert not owed(rig), what


def owed(rig: Rig) -> bool:
    """Whether the session still holds what must be put back."""
    if not (rig.folder / "session.json").exists():
        return False
    return bool(Session.open(rig.folder).journal.settings_to_restore)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_trouble_alone(name: str, tmp_path: Path) -> None:
    assert trial(NAMES.index(name), tmp_path) in ENDS.get(name, {"done"})


@pytest.mark.slow
@pytest.mark.parametrize("start", sample_first(range(0, SLOW_RUNS, BLOCK), 1))
def test_troubles_in_pairs(start: int, tmp_path: Path) -> None:
    seeds = range(start, start + BLOCK)
    outcomes = {seed: trial(seed, tmp_path / str(seed)) for seed in seeds}
    strange = {
        (seed, *draw(seed), word)
        for seed, word in outcomes.items()
        if word not in set().union({"done"}, *(ENDS.get(name, set()) for name in draw(seed)[2]))
    }
    # A program that gives up on everything would pass without this: what goes away is outlasted.
    assert not strange
