"""Captures over a line with one failing request in ten, and captures that are killed.

    python benchmarks/cameras/bad_line.py [--runs 20] [--models V,SC2] [--kinds reset,stall]
                                          [--real] [--kills 3] [-o FILE.json]

Every model, every kind of fault, on virtual time; a failed capture is resumed once over the same
line. With --kills, each capture is also killed at every third request, once before and once after
the camera receives it, and resumed over a good line. With --real, each kind also runs once over
real sockets at normal speed (twenty minutes; only these are merged). Counted: captures that finish
by themselves and after one resume; frames that are lost, wrong or shot twice; settings and surplus
pictures left on the camera.
"""

from __future__ import annotations

import argparse
import copy
import json
import os
import platform
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]

from app.core.base.errors import CoreError  # noqa: E402
from app.core.base.progress import Token  # noqa: E402
from app.devices.capture.capture_steps import Capture, CaptureResult  # noqa: E402
from app.devices.capture.session import Session  # noqa: E402
from app.devices.clock import SystemClock  # noqa: E402
from app.devices.errors import DeviceError  # noqa: E402
from app.devices.simulated.camera import SimulatedCamera  # noqa: E402
from app.devices.theta.client import OscClient  # noqa: E402
from app.devices.theta.endpoint import Endpoint  # noqa: E402
from app.devices.theta.link import Link  # noqa: E402
from tests.faulty_camera.bad_line import KINDS, BadLine  # noqa: E402
from tests.faulty_camera.camera import FaultyCamera  # noqa: E402
from tests.faulty_camera.server import FaultyServer  # noqa: E402
from tests.helpers.cameras import Rig, lit_room, pack  # noqa: E402
from tests.helpers.captures import (  # noqa: E402
    Killed,
    Weather,
    without_merging,
    without_waiting_for_the_disk,
)

MODELS = ("S", "SC", "SC2", "V", "V-old", "Z1", "X", "X-old", "A1", "generic", "insta360")
SHAPE = (128, 256)


def judged(
    camera: SimulatedCamera, before: dict[str, Any], results: list[CaptureResult | str]
) -> dict[str, Any]:
    """Report the end of a capture of at most two runs, and the final state of the camera."""
    camera.shooter.settle()
    stored = camera.storage.files
    last = results[-1]
    facts: dict[str, Any] = {
        "by_itself": len(results) == 1 and not isinstance(last, str),
        "after_resume": not isinstance(last, str),
        "wrong_frames": 0,
        "settings_left": sorted(n for n in before if before[n] != camera.options.get(n)),
        "surplus_left": len(stored) - 3,
        "errors": [each for each in results if isinstance(each, str)],
    }
    if not isinstance(last, str):
        frames = [path.read_bytes() for path in last.frames]
        takes = {file.data: file.take for file in stored}
        evs = [take.exposure.ev for data in frames if (take := takes.get(data)) is not None]
        plan = [shot.exposure.ev for shot in last.plan.shots]
        sound = len(set(frames)) == len(evs) == len(plan) == 3
        sound = sound and all(abs(a - b) < 0.01 for a, b in zip(evs, plan, strict=True))
        facts["wrong_frames"] = 0 if sound else 1
    return facts


def virtual(model: str, kind: str, seed: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as place:
        rig = Rig(Path(place) / "session", model, shape=SHAPE, seed=seed)
        before = copy.deepcopy(rig.camera.options)
        line = BadLine(rig.camera, kind, seed=seed)
        results: list[CaptureResult | str] = []
        while len(results) < 2 and not (results and not isinstance(results[-1], str)):
            try:
                results.append(rig.shoot())
            except (DeviceError, CoreError) as error:
                results.append(f"{type(error).__name__}: {error}")
        facts = judged(rig.camera, before, results)
        return facts | {"seconds": rig.clock.now(), "struck": line.struck}


def killed(model: str, at: int, *, heard: bool) -> dict[str, Any] | None:
    """Kill a capture at a request and resume it; return None if it ends before that request."""
    with tempfile.TemporaryDirectory() as place:
        rig = Rig(Path(place) / "session", model, shape=SHAPE)
        before = copy.deepcopy(rig.camera.options)
        weather = Weather(rig)
        weather.heard = heard

        def die() -> None:
            raise Killed

        weather.at[at] = die
        try:
            rig.shoot()
        except Killed:
            pass
        else:
            return None
        rig.clock.sleep(20.0 if at % 2 else 0.5)
        rig.camera.reconnect()
        began = rig.clock.now()
        results: list[CaptureResult | str] = []
        try:
            results.append(rig.shoot())
        except (DeviceError, CoreError) as error:
            results.append(f"{type(error).__name__}: {error}")
        facts = judged(rig.camera, before, results)
        if facts["surplus_left"] > 0 or not facts["after_resume"]:
            facts["errors"].append(f"at {at}, {heard=}: {rig.camera.log[-1].target}")
        return facts | {"seconds": rig.clock.now() - began, "struck": 1}


def kills(model: str, step: int) -> list[dict[str, Any]]:
    """Kill a capture at every `step` requests, before and after the camera receives it."""
    trials: list[dict[str, Any]] = []
    at = 1
    while True:
        pair = [killed(model, at, heard=heard) for heard in (False, True)]
        trials += [each for each in pair if each is not None]
        if None in pair:
            return trials
        at += step


def real(model: str, kind: str, seed: int) -> dict[str, Any]:
    clock = SystemClock()
    camera = FaultyCamera(lit_room(), model, clock, shape=SHAPE)
    before = copy.deepcopy(camera.options)
    line = BadLine(camera, kind, seed=seed)
    began = time.monotonic()
    results: list[CaptureResult | str] = []
    with tempfile.TemporaryDirectory() as place, FaultyServer(camera, clock=clock) as server:
        while len(results) < 2 and not (results and not isinstance(results[-1], str)):
            session = Session.open_or_create(Path(place) / "session")
            link = Link(Endpoint.parse(server.url), clock)
            capture = Capture(
                OscClient(link, clock),
                session,
                clock,
                plan="paper",
                pack=pack(),
                on_status=lambda status: None,
                token=Token(),
            )
            try:
                results.append(capture.run())
            except (DeviceError, CoreError) as error:
                results.append(f"{type(error).__name__}: {error}")
            link.close()
        facts = judged(camera, before, results)
    camera.close()
    return facts | {"seconds": time.monotonic() - began, "struck": line.struck}


def summed(model: str, kind: str, trials: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "model": model,
        "kind": kind,
        "runs": len(trials),
        "by_itself": sum(each["by_itself"] for each in trials),
        "after_resume": sum(each["after_resume"] for each in trials),
        "wrong_frames": sum(each["wrong_frames"] for each in trials),
        "settings_left": sum(bool(each["settings_left"]) for each in trials),
        "surplus_left": sum(max(each["surplus_left"], 0) for each in trials),
        "requests_struck": sum(each["struck"] for each in trials),
        "median_s": round(sorted(each["seconds"] for each in trials)[len(trials) // 2], 1),
        "longest_s": round(max(each["seconds"] for each in trials), 1),
        "errors": sorted({words for each in trials for words in each["errors"]}),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--models", type=lambda text: text.split(","), default=MODELS)
    parser.add_argument("--kinds", type=lambda text: text.split(","), default=KINDS)
    parser.add_argument("--kills", type=int, default=0, metavar="STEP")
    parser.add_argument("--real", action="store_true")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    began = time.monotonic()
    rows, kill_rows, real_rows = [], [], []
    with pytest.MonkeyPatch.context() as patch:
        without_waiting_for_the_disk(patch)
        without_merging(patch)
        for model in args.models:
            for kind in args.kinds if args.runs else ():
                trials = [virtual(model, kind, seed) for seed in range(args.runs)]
                rows.append(summed(model, kind, trials))
                print(json.dumps(rows[-1]), flush=True)
            if args.kills:
                kill_rows.append(summed(model, "kill", kills(model, args.kills)))
                print(json.dumps(kill_rows[-1]), flush=True)
    for number, kind in enumerate(args.kinds if args.real else ()):
        model = args.models[number % len(args.models)]
        real_rows.append(summed(model, kind, [real(model, kind, 100)]))
        print("real:", json.dumps(real_rows[-1]), flush=True)
    if args.output is not None:
        words = ["git", "rev-parse", "--short", "HEAD"]
        commit = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
        facts = {
            "commit": commit.stdout.strip(),
            "machine": f"{platform.machine()}, {os.cpu_count()} processors",
            "seconds": round(time.monotonic() - began),
            "virtual": rows,
            "kills": kill_rows,
            "real": real_rows,
        }
        args.output.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
