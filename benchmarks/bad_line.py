"""Captures over a line on which one request in ten goes wrong, in one of eight ways.

    python benchmarks/bad_line.py [--runs 20] [--real] [-o FILE.json]

V and S, each kind of fault so many times on virtual time; with --real also once a kind over real
sockets at normal speed (some ten minutes; only these are merged). A capture that fails is opened
once more over the same line. Counted: captures that finish by themselves and after one resume;
frames that are lost, wrong or shot twice; settings and metering pictures left on the camera.
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
ROOT = Path(__file__).resolve().parent.parent

from app.core.base.errors import CoreError  # noqa: E402
from app.core.base.progress import Token  # noqa: E402
from app.devices.capture.machine import Capture, CaptureResult  # noqa: E402
from app.devices.capture.session import Session  # noqa: E402
from app.devices.clock import SystemClock  # noqa: E402
from app.devices.errors import DeviceError  # noqa: E402
from app.devices.simulated.camera import SimulatedCamera  # noqa: E402
from app.devices.simulated.server import CameraServer  # noqa: E402
from app.devices.theta.client import OscClient  # noqa: E402
from app.devices.theta.endpoint import Endpoint  # noqa: E402
from app.devices.theta.link import Link  # noqa: E402
from tests.helpers.bad_line import KINDS, BadLine  # noqa: E402
from tests.helpers.cameras import Rig, lit_room, pack  # noqa: E402
from tests.helpers.captures import (  # noqa: E402
    without_merging,
    without_waiting_for_the_disk,
)

MODELS = ("V", "S")
SHAPE = (128, 256)


def judged(
    camera: SimulatedCamera, before: dict[str, Any], results: list[CaptureResult | str]
) -> dict[str, Any]:
    """Say how a capture of at most two goes ended, and how it left the camera."""
    camera.shooter.settle()
    stored = camera.storage.files
    held = [file for file in stored if file.take is not None and file.take.program == 1]
    last = results[-1]
    facts: dict[str, Any] = {
        "by_itself": len(results) == 1 and not isinstance(last, str),
        "after_resume": not isinstance(last, str),
        "wrong_frames": 0,
        "settings_left": sorted(n for n in before if before[n] != camera.options.get(n)),
        "metering_left": len(stored) - len(held),
        "errors": [each for each in results if isinstance(each, str)],
    }
    if not isinstance(last, str):
        here = [path.read_bytes() for path in last.frames]
        meant = [shot.exposure.ev for shot in last.plan.shots]
        taken = [file.take.exposure.ev for file in held if file.take is not None]
        sound = here == [file.data for file in held] and len(here) == len(meant) == 3
        sound = sound and all(abs(a - b) < 0.01 for a, b in zip(meant, taken, strict=True))
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


def real(model: str, kind: str, seed: int) -> dict[str, Any]:
    clock = SystemClock()
    camera = SimulatedCamera(lit_room(), model, clock, shape=SHAPE, seed=seed)
    before = copy.deepcopy(camera.options)
    line = BadLine(camera, kind, seed=seed)
    began = time.monotonic()
    results: list[CaptureResult | str] = []
    with tempfile.TemporaryDirectory() as place, CameraServer(camera, clock=clock) as server:
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
        "metering_left": sum(each["metering_left"] for each in trials),
        "requests_struck": sum(each["struck"] for each in trials),
        "median_s": round(sorted(each["seconds"] for each in trials)[len(trials) // 2], 1),
        "longest_s": round(max(each["seconds"] for each in trials), 1),
        "errors": sorted({words for each in trials for words in each["errors"]}),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--real", action="store_true")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    began = time.monotonic()
    rows, real_rows = [], []
    with pytest.MonkeyPatch.context() as patch:
        without_waiting_for_the_disk(patch)
        without_merging(patch)
        for model in MODELS:
            for kind in KINDS:
                trials = [virtual(model, kind, seed) for seed in range(args.runs)]
                rows.append(summed(model, kind, trials))
                print(json.dumps(rows[-1]), flush=True)
    for number, kind in enumerate(KINDS if args.real else ()):
        model = MODELS[number % 2]
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
            "real": real_rows,
        }
        args.output.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
