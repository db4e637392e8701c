"""Captures with everything that can go wrong, alone and in pairs, on virtual time.

Each trial is one seed: it draws the model, the plan, one trouble or two, and when they strike. It
must end in success or in a clear failure with a next step, in bounded time, without losing a frame,
without touching anything outside its folder, and with the camera's settings as they were.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import pytest

from app.core.errors import CoreError
from app.core.probe.bracket import read_bracket
from app.devices.capture.session import Session
from app.devices.errors import DeviceError
from app.devices.simulated.faults import FAULTS, LASTING
from tests.helpers.cameras import Rig

NAMES = sorted(FAULTS)
MODELS = ("S", "SC", "SC2", "V", "V-old", "Z1", "X", "A1", "generic")
SLOW_RUNS = 560
# Troubles that no patience outlasts, and equal exposures, which must never pass for a bracket.
LASTS = LASTING | {"equal-exposures"}
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
        held = {file.data for file in rig.camera.stored_files}
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
    """The camera keeps every frame of a bracket, and has its settings back where it was reached."""
    for file in rig.deleted:
        metered = file.take is not None and file.take.program == 2 and not file.group
        assert metered, f"{what}: {file.name} was deleted"
    if "404-router-in-place-of-the-camera" in rig.faults or "401" in rig.faults:
        return
    after = rig.camera.options
    changed = {key: (before[key], after[key]) for key in before if before[key] != after.get(key)}
    assert not changed or owed(rig), f"{what}: {changed}"


def owed(rig: Rig) -> bool:
    """Whether the session still holds what must be put back, because the camera was gone."""
    return bool(Session.open(rig.folder).journal.settings_to_restore)


@pytest.mark.parametrize("name", NAMES)
def test_every_trouble_alone(name: str, tmp_path: Path) -> None:
    trial(NAMES.index(name), tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_troubles_in_pairs(tmp_path: Path) -> None:
    outcomes = {seed: trial(seed, tmp_path / str(seed)) for seed in range(SLOW_RUNS)}
    # A program that gives up on everything would pass so far: what goes away must be outlasted.
    passing = [word for seed, word in outcomes.items() if not LASTS & {*draw(seed)[2]}]
    assert len(passing) >= 0.3 * SLOW_RUNS
    assert passing.count("done") >= 0.97 * len(passing), Counter(passing)
