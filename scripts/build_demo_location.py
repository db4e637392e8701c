"""Render ``resources/demo/cafe/``, which ``turnlight --demo`` shows, and ``location/`` around it.

Usage::

    pip install mitsuba-oidn nanobind-backend     # denoiser of the views, only for this
    python scripts/build_demo_location.py --minutes 70

It may be stopped at any time and goes on where it stopped; passes are kept in ``--work``. The
files in ``--out`` are whole at any time after the first round. It says how long a round took.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from scenes.demo_location.frame import Stand
    from scenes.demo_location.render import Studio

_ROOT: Final = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(_ROOT))
_OUT: Final = _ROOT / "resources" / "demo"
_WORK: Final = _ROOT / "build" / "demo-location"
# Samples of the large panorama, of the two others, and of the views after each round.
ROUNDS: Final = (
    (6, 8, 4), (32, 32, 4), (64, 64, 4), (64, 64, 8), (96, 128, 8),
    (144, 160, 8), (144, 200, 12), (192, 256, 16), (256, 320, 24),
)  # fmt: skip

_SAME_M: Final = 1e-6


class _TimeUp(Exception):
    """The minutes given are over."""


def _say(words: str) -> None:
    sys.stdout.write(f"{time.strftime('%H:%M:%S')}  {words}\n")
    sys.stdout.flush()


def build(work: Path, out: Path, minutes: float, rounds: int) -> None:
    """Render rounds until they are done or the time is up; write what there is after each."""
    from app.core.baking.kernel_lanes import select_variant

    select_variant("llvm")
    if rounds == 0:
        _finish(work, out)
        return
    from scenes.demo_location.render import Studio

    started = time.monotonic()
    end = started + 60 * minutes
    studio = Studio(work, _ROOT / "resources" / "heads")
    _say(f"modelled in {time.monotonic() - started:.0f} s")
    for number, (large, small, views) in enumerate(ROUNDS[:rounds], 1):
        if _done(studio, large, small, views):
            continue
        began = time.monotonic()
        try:
            _panoramas(studio, large, small, end)
            _views(studio, views, end)
        except _TimeUp:
            _say("time is up")
            break
        finally:
            _finish(work, out)
        _say(f"round {number} ({large}, {small}, {views}) took {time.monotonic() - began:.0f} s")
    _say(f"{(time.monotonic() - started) / 60:.1f} minutes in all")


def _done(studio: Studio, large: int, small: int, views: int) -> bool:
    from scenes.demo_location.frame import CAFE, SPOTS, STANDS, TURNS
    from scenes.demo_location.render import load_panorama

    for spot in [*SPOTS, CAFE]:
        kept = load_panorama(studio.work, spot)
        if kept is None or kept.passes < (large if spot is SPOTS[0] else small):
            return False
    return all(studio.view_spp(stand, turn) >= views for stand in STANDS for turn in TURNS)


def _panoramas(studio: Studio, large: int, small: int, end: float) -> None:
    from scenes.demo_location.frame import CAFE, SPOTS
    from scenes.demo_location.render import load_panorama

    for spot in [*SPOTS, CAFE]:
        wanted = large if spot is SPOTS[0] else small
        kept = load_panorama(studio.work, spot)
        passes = 0 if kept is None else kept.passes
        while passes < wanted:
            if time.monotonic() > end:
                raise _TimeUp
            made = studio.panorama_pass(spot)
            passes = made.passes
            _say(f"{spot.name}: {passes} of {wanted}, {made.seconds / passes:.1f} s a pass")


def _views(studio: Studio, spp: int, end: float) -> None:
    from scenes.demo_location.frame import STANDS, TURNS

    for stand in STANDS:
        for turn in TURNS:
            if studio.view_spp(stand, turn) < spp:
                if time.monotonic() > end:
                    raise _TimeUp
                began = time.monotonic()
                studio.turn_pass(stand, turn, spp)
                seconds = time.monotonic() - began
                _say(f"{stand.folder} at {turn} deg: {spp} samples, {seconds:.1f} s")


def _finish(work: Path, out: Path) -> None:
    """Write every result that exists; what the work folder does not have stays as it is."""
    from scenes.demo_location import writing
    from scenes.demo_location.frame import CAFE, SPOTS, STANDS
    from scenes.demo_location.render import load_panorama

    began = time.monotonic()
    for stand in STANDS:
        (out / stand.folder).mkdir(parents=True, exist_ok=True)
    for left in [path for path in out.rglob(".*") if path.is_file()]:
        left.unlink()  # half a file of a run that was killed
    location, cafe = out / "location", out / "cafe"
    before = _read_json(location / "location.json")
    described = {spot["file"]: spot for spot in before.get("spots", [])}
    for spot in SPOTS:
        kept = load_panorama(work, spot)
        if kept is not None:
            file = location / f"{spot.name}.exr"
            described[file.name] = writing.write_panorama(file, spot, kept)
    demo, kept = before.get("demo", {}), load_panorama(work, CAFE)
    if kept is not None:
        demo = writing.write_panorama(cafe / "probe.exr", CAFE, kept, smooth=True)
    if len(described) < len(SPOTS) or not demo:
        return
    views = {row["folder"]: row for row in before.get("views", [])}
    for stand in STANDS:
        views[stand.folder] = _finish_views(work, out, stand, views.get(stand.folder, {}))
    writing.write_location(location, list(described.values()), demo, views)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    count = sum(row["count"] for row in views.values())
    _say(f"written: {count} views, {size / 1e6:.1f} MB, {time.monotonic() - began:.0f} s")


def _finish_views(work: Path, out: Path, stand: Stand, before: dict[str, Any]) -> dict[str, Any]:
    """Write the views of a stand; a view is encoded again only when it has new samples."""
    from scenes.demo_location import writing
    from scenes.demo_location.frame import TURNS
    from scenes.demo_location.render import load_view

    table = _read_json(out / stand.folder / "views.json")
    old = {(v["turn_deg"], v["distance_m"]): v for v in table.get("views", [])}
    encode = table.get("encoding") != writing.ENCODING
    views: list[dict[str, Any]] = []
    seconds = 0.0
    for distance in stand.distances:
        for turn in TURNS:
            view, row = load_view(work, stand, turn, distance), old.get((turn, distance))
            if view is not None:
                seconds += view.seconds
                if encode or row is None or row["samples"] != view.spp or _moved(row, stand):
                    row = writing.write_view(out, stand, turn, distance, view)
            if row is not None:
                views.append(row)
    writing.write_views_json(out, stand, views)
    return {"count": len(views), "seconds": round(seconds) or before.get("seconds", 0)}


def _moved(row: dict[str, Any], stand: Stand) -> bool:
    """Whether a view was rendered where the stand no longer is."""
    from scenes.demo_location.frame import view_pose

    position, _ = view_pose(stand, row["turn_deg"], row["distance_m"])
    return any(abs(a - b) > _SAME_M for a, b in zip(row["position_m"], position, strict=True))


def _read_json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def main(argv: list[str] | None = None) -> int:
    """Command line entry."""
    parser = argparse.ArgumentParser(description="Render the demo location.")
    parser.add_argument("--out", type=Path, default=_OUT, help="folder of the finished files")
    parser.add_argument("--work", type=Path, default=_WORK, help="folder where passes are kept")
    parser.add_argument("--minutes", type=float, default=70.0, help="stop after so many minutes")
    parser.add_argument(
        "--rounds",
        type=int,
        default=len(ROUNDS),
        help="stop after so many rounds; 0 only writes what has been rendered",
    )
    args = parser.parse_args(argv)
    if importlib.util.find_spec("mitsuba_oidn") is None:
        parser.error("the views need a denoiser: pip install mitsuba-oidn nanobind-backend")
    build(args.work, args.out, args.minutes, args.rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
