"""Test whether the live preview names the right styles on the way to a spot, and how soon.

    python benchmarks/light/live_probe.py [--places DIR ...] [--model S] [--only NAME ...]
                                          [-o FILE.json]

Each panorama is shown at a plausible brightness to a simulated camera, which meters it, clips, and
sends a small JPEG. The best three styles from one such picture are compared with the bracket that
the same camera takes afterwards (full plan, merged as always): the share of the place's potential
that their turns lose, and whether those that lose more than a tenth were marked as needing the
bracket. The same places are also used with all light limited to the preview's range: veiled windows
and shaded lamps, where nothing is clipped.

Rate and delay are those of the Probe screen's own presenter, with its jobs and its timer, from a
camera in another process: every picture carries its number, and the sender records when it left.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT: Final = Path(__file__).resolve().parents[2]
SHARED: Final = ROOT.parent / "shared"

import numpy as np  # noqa: E402

from app.core.base.arrays import Bytes  # noqa: E402
from app.core.base.atomic_files import atomic_write_text  # noqa: E402
from app.core.base.colour import FloatImage  # noqa: E402
from app.core.camera_catalogue import camera_facts  # noqa: E402
from app.core.environment.environment import energy, read_environment, reduce_light  # noqa: E402
from app.core.measure.finish.clip_audit import given_up  # noqa: E402
from app.core.measure.single.preview import preview_light, rough_answers  # noqa: E402
from app.core.solver.solve import solve_all  # noqa: E402
from app.core.styles.style_pack import StylePack  # noqa: E402
from app.core.styles.style_pack_file import load_named_pack  # noqa: E402
from app.devices.mjpeg import decode  # noqa: E402
from app.devices.simulated import preview as sender  # noqa: E402
from app.devices.simulated.cameras import personality_named  # noqa: E402
from app.devices.simulated.optics import meter, saturation_cd_m2, view_of  # noqa: E402
from app.devices.simulated.scene import Scene  # noqa: E402
from benchmarks.speed.plain_search import choose  # noqa: E402
from tests.helpers.cameras import Rig  # noqa: E402

FOLDERS: Final = (
    SHARED / "data" / "hdri",
    ROOT / "resources" / "demo" / "scenes",
    ROOT / "resources" / "demo" / "location",
)
from tests.helpers.live_marks import read_number  # noqa: E402

BAD: Final = 0.10
HELD: Final = 0.01  # of the light, for a preview without clipping
_FRAME: Final = (512, 1024)
_NIGHT_CD_M2, _ROOM_CD_M2, _DAY_CD_M2 = 3.0, 60.0, 2000.0
_NIGHT: Final = ("night",)
_ROOM: Final = ("studio", "cellar", "warehouse", "interior", "probe-")


def places(folders: tuple[Path, ...]) -> dict[str, Path]:
    """Return all panoramas in some folders, by name."""
    files = [file for folder in folders for file in sorted(folder.glob("*")) if file.is_file()]
    return {file.stem: file for file in files if file.suffix in (".hdr", ".exr")}


def brightened(path: Path) -> FloatImage:
    """Return a panorama in cd/m2, at the usual level of a room, a night or a day."""
    light = read_environment(path).radiance
    name = path.stem
    wanted = _ROOM_CD_M2 if any(word in name for word in _ROOM) else _DAY_CD_M2
    wanted = _NIGHT_CD_M2 if any(word in name for word in _NIGHT) else wanted
    return np.asarray(light * np.float32(wanted / float(np.median(light))), np.float32)


def held(light: FloatImage, model: str) -> FloatImage:
    """Return the same place limited to the preview's range."""
    for _ in range(8):
        white = saturation_cd_m2(meter(light, personality_named(model).camera))
        light = np.minimum(light, np.float32(0.8 * white))
    return light


def lost_share(light: FloatImage, model: str, shape: tuple[int, int]) -> float:
    """Return the share of the light that a preview of that size clips."""
    white = saturation_cd_m2(meter(light, personality_named(model).camera))
    seen = view_of(light, shape).band(0, shape[0])
    whole = energy(seen).sum()
    return float((whole - energy(np.minimum(seen, np.float32(white))).sum()) / whole)


def previewed(rig: Rig, model: str) -> Bytes:
    """Return the first picture of the camera's preview."""
    client = rig.client()
    facts = camera_facts(model)
    assert facts is not None
    with client.live_preview(facts.previews[0]) as pictures:
        picture = decode(next(pictures))
    client.link.close()
    assert picture is not None
    return picture


def bracketed(rig: Rig) -> FloatImage:
    """Return the light of the camera's full bracket."""
    return rig.shoot("full").probe.merged.radiance


def held_against(
    picture: Bytes, truth: FloatImage, pack: StylePack
) -> tuple[float, list[dict[str, Any]]]:
    """Return the best styles for a picture, and the loss of their turns under a light."""
    size = pack.header.environment
    seen = preview_light(picture, size)
    assert seen is not None
    light = reduce_light(truth, size)
    best = choose(pack, light)
    grades = {one.name: one.grade for one in solve_all(pack, light)}
    rows = []
    for answer in rough_answers(seen, pack):
        result, row = answer.result, pack.index(answer.result.name)
        turns = best.turns.copy()
        turns[row] = result.turn_index
        rows.append(
            {
                "style": result.name,
                "grade": result.grade,
                "grade_by_bracket": grades[result.name],
                "given_up": round(float(given_up(best, turns)[row]), 4),
                "unsure": answer.unsure,
            }
        )
    return seen.clipped_share, rows


def measured(path: Path, model: str, pack: StylePack, *, soft: bool = False) -> dict[str, Any]:
    """Compare the preview of one place with its bracket."""
    light = brightened(path)
    light = held(light, model) if soft else light
    with tempfile.TemporaryDirectory() as folder:
        rig = Rig(Path(folder), model, shape=_FRAME, scene=Scene(light))
        picture = previewed(rig, model)
        share, rows = held_against(picture, bracketed(rig), pack)
    return {
        "place": path.stem,
        "soft": soft,
        "lost": round(lost_share(light, model, picture.shape[:2]), 4),
        "clipped_by_preview": round(share, 4),
        "named": rows,
    }


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return shares over all named styles, with bootstrap intervals over places."""

    def shares(some: list[dict[str, Any]]) -> dict[str, float]:
        named = [one for row in some for one in row["named"]]
        good = [one for one in named if one["given_up"] <= BAD]
        bad = [one for one in named if one["given_up"] > BAD]
        right = len(good) + sum(one["unsure"] for one in bad)
        return {
            "within": len(good) / max(len(named), 1),
            "within_or_marked": right / max(len(named), 1),
            "good_marked": sum(one["unsure"] for one in good) / max(len(good), 1),
            "bad_marked": sum(one["unsure"] for one in bad) / max(len(bad), 1),
            "out_of_reach_by_bracket": sum(one["grade_by_bracket"] == "no" for one in named)
            / max(len(named), 1),
            "mean_given_up": float(np.mean([one["given_up"] for one in named])) if named else 0.0,
        }

    found: dict[str, Any] = {}
    sets = {
        "all": [row for row in rows if not row["soft"]],
        "clips_under_1_percent": [row for row in rows if row["lost"] < HELD],
    }
    dice = np.random.default_rng(1)
    for name, some in sets.items():
        if not some:
            found[name] = {"places": 0}
            continue
        draws = [
            shares([some[k] for k in dice.integers(0, len(some), len(some))])["within_or_marked"]
            for _ in range(1000)
        ]
        found[name] = {
            "places": len(some),
            "named": sum(len(row["named"]) for row in some),
            **{key: round(value, 3) for key, value in shares(some).items()},
            "within_or_marked_90": [round(float(np.percentile(draws, q)), 3) for q in (5, 95)],
        }
    return found


def serve(path: Path, model: str) -> None:
    """Run as the camera: print the address, and when stdin ends, the departure of each picture."""
    from app.devices.clock import SystemClock
    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.server import CameraServer

    times: list[float] = []
    pieces = sender.preview_pieces

    def noted(*words: Any) -> Iterator[Any]:
        for piece in pieces(*words):
            if isinstance(piece, bytes) and piece.startswith(b"\xff\xd8"):
                times.append(time.monotonic())
            yield piece

    sender.preview_pieces = noted  # type: ignore[assignment]
    clock = SystemClock()
    camera = SimulatedCamera(Scene(brightened(path)), model, clock)
    with CameraServer(camera, clock=clock) as server:
        print(server.url, flush=True)
        sys.stdin.read()
    print(json.dumps(times), flush=True)


def paced(path: Path, model: str, seconds: float) -> dict[str, float]:
    """Return the screen's answers per second, and the age of their pictures."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from PySide6.QtCore import QCoreApplication, QTimer

    from app.core.portrait.head import load_head
    from app.devices.clock import SystemClock
    from app.devices.device_sets import RealDevices
    from app.ui.presenters.services import Folders, Services
    from app.ui.presenters.undo_stack import UndoStack
    from app.ui.presenters.window_model import CameraSeen, Model
    from app.ui.screens.probe.capture.camera import CameraFinder
    from app.ui.screens.probe.live import LivePreview
    from app.ui.screens.probe.screen import BEAT_MS
    from app.ui.shell.jobs import QtRunner
    from tests.helpers.told import Told

    application = QCoreApplication.instance() or QCoreApplication([])
    answers: list[tuple[float, int]] = []
    with (
        tempfile.TemporaryDirectory() as home,
        subprocess.Popen(
            [sys.executable, __file__, "--serve", str(path), "--model", model],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        ) as camera,
    ):
        assert camera.stdout is not None
        clock, runner = SystemClock(), QtRunner(print)
        devices, model_ = RealDevices(clock), Model()
        model_.update(head=load_head("generic"))
        found = devices.look_at(camera.stdout.readline().strip())
        model_.update(camera=CameraSeen(found))
        folder = Path(home)
        services = Services(
            model=model_,
            runner=runner,
            notify=Told(),
            undo=UndoStack(),
            clock=clock,
            today=lambda: datetime.now(UTC),
            devices=devices,
            folders=Folders(folder, folder, folder, folder, folder),
        )

        def changed() -> None:
            live = preview.live
            number = None if live is None or live.picture is None else read(live.picture)
            if number is not None:
                answers.append((time.monotonic(), number))

        preview = LivePreview(services, CameraFinder(services, lambda: None), changed)
        read = read_number
        beat = QTimer()
        beat.timeout.connect(preview.tick)
        beat.start(BEAT_MS)
        preview.toggle()
        end = time.monotonic() + 60.0
        while not answers and time.monotonic() < end:
            application.processEvents()
        answers.clear()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            application.processEvents()
            time.sleep(0.001)
        preview.stop()
        runner.shutdown()
        sent = np.array(json.loads(camera.communicate(timeout=30)[0]))
    ages = []
    for now, number in answers:
        newest = int(np.searchsorted(sent, now)) - 1
        ages.append(now - sent[newest - (newest - number) % sender.LOOP])
    return {
        "answers_per_s": round(len(answers) / seconds, 2),
        "late_s_median": round(float(np.median(ages)), 3),
        "late_s_95": round(float(np.percentile(ages, 95)), 3),
        "late_s_99": round(float(np.percentile(ages, 99)), 3),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--places", type=Path, nargs="*", default=[])
    parser.add_argument("--model", default="S")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("-o", type=Path)
    args = parser.parse_args()
    if args.serve:
        serve(args.serve, args.model)
        return
    started = time.monotonic()
    pack = load_named_pack("generic")
    found = places((*FOLDERS, *args.places))
    files = [file for name, file in found.items() if not args.only or name in args.only]
    rows = []
    for file in files:
        for soft in (False, True):
            rows.append(measured(file, args.model, pack, soft=soft))
            print(json.dumps(rows[-1]), flush=True)
    pace = {name: paced(files[-1], name, args.seconds) for name in dict.fromkeys((args.model, "V"))}
    facts = {
        "model": args.model,
        "summary": summary(rows),
        "pace": pace,
        "commit": subprocess.run(
            ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, cwd=ROOT
        ).stdout.strip(),
        "machine": f"{platform.machine()}, {os.cpu_count()} processors",
        "seconds": round(time.monotonic() - started, 1),
        "rows": rows,
    }
    print(json.dumps({key: facts[key] for key in ("summary", "pace", "seconds")}, indent=1))
    if args.o:
        atomic_write_text(args.o, json.dumps(facts, indent=1) + "\n")


if __name__ == "__main__":
    main()
