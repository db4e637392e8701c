"""Agreement of merges with their own frames if frames do not fit, compared with OpenCV's.

    python benchmarks/light/real_brackets.py [NAME ...] [--bracket FOLDER ...] [--json FILE]

The memorial church bracket if available, brackets given as folders (with EXIF or an
image_list.txt), and brackets made of known scenes: with tone curves that differ from frame to
frame, handheld, with a walking person. Ours uses the program's whole pipeline from files. OpenCV's
Debevec and Robertson are calibrated from the same frames; for handheld brackets they get frames
aligned by AlignMTB, and, as another row, frames as shot. Each merge is compared with the frames as
it aligned them. Synthetic brackets have a truth: the error is that of the luminance, after the best
scale; without motion, the spread of the truth itself is reported as well.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.measure.bracket.alignment.handheld import warp
from app.core.measure.bracket.grouping import read_bracket
from app.core.measure.bracket.measure import measure
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from tests.helpers.odd_brackets import (
    Made,
    Way,
    decoded,
    error_of,
    make,
    speckle,
    spreads,
    view,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Float32 = NDArray[np.float32]

ROOT = Path(__file__).resolve().parents[2]


SHAPE = (600, 900)
SHARED = ROOT.parent / "shared" / "data"
FIVE = (2.0, 1.0, 0.0, -1.0, -2.0)
WIDE = (2.0, 0.0, -2.0)


@dataclass(frozen=True)
class Set:
    """A bracket to be merged."""

    name: str
    frames: list[Bytes] = field(repr=False)
    times: list[float]
    held: bool = False
    made: Made | None = field(default=None, repr=False)


def scene(name: str) -> Float32:
    demo = resources() / "demo"
    for path in (demo / "scenes" / f"{name}.exr", demo / "location" / f"{name}.exr"):
        if path.exists():
            return np.array(read_environment(path).radiance)
    return np.array(read_environment(SHARED / "hdri" / f"{name}_1k.hdr").radiance)


def hand(pixels: float) -> dict[str, Any]:
    """Return a shift and a matching turn of a hand."""
    return {"shake_px": pixels, "shake_deg": 0.05 * pixels}


PHONE: dict[str, Any] = {"steps": (0.4, 1.5), "bend": 0.35}
MADE: dict[str, tuple[str, float | None, Way]] = {
    "plain": ("probe-1", 40.0, Way(FIVE)),
    "phone 1": ("probe-1", 40.0, Way(FIVE, **PHONE, seed=2)),
    "phone 2": ("interior", 200.0, Way(**PHONE, seed=3)),
    "phone 3": ("st_fagans_interior", 30.0, Way(**PHONE, seed=4)),
    "phone 4": ("leadenhall_market", 120.0, Way(FIVE, **PHONE, seed=5)),
    "phone 5": ("city", 300.0, Way(FIVE, **PHONE, seed=6)),
    "phone, local": ("probe-1", 200.0, Way(**PHONE, local=0.15, seed=7)),
    "phone, local 2": ("empty_warehouse_01", 90.0, Way(FIVE, **PHONE, local=0.12, seed=8)),
    "phone, walker": ("probe-1", 40.0, Way(FIVE, **PHONE, walker=True, seed=9)),
    "hand 3 px": ("probe-1", 300.0, Way(FIVE, **hand(3.0), seed=10)),
    "hand 10 px": ("interior", 20.0, Way(FIVE, **hand(10.0), seed=11)),
    "hand 10 px, wide": ("leadenhall_market", 220.0, Way(WIDE, **hand(10.0), seed=12)),
    "hand, walker": ("probe-1", 120.0, Way(FIVE, **hand(8.0), walker=True, seed=13)),
    "hand, phone": ("probe-1", 60.0, Way(FIVE, **PHONE, **hand(10.0), seed=14)),
    "hand, phone 2": ("st_fagans_interior", 150.0, Way(**PHONE, **hand(6.0), seed=15)),
    "walker": ("interior", 100.0, Way(FIVE, walker=True, seed=16)),
    "panorama, phone": ("leadenhall_market", None, Way(WIDE, steps=(0.6, 1.3), bend=0.3, seed=17)),
    "panorama, phone 2": ("interior", None, Way(FIVE, **PHONE, seed=18)),
    "panorama, walker": ("interior", None, Way(FIVE, **PHONE, walker=True, seed=19)),
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="merges of brackets whose frames do not fit")
    parser.add_argument("names", nargs="*", help="only sets whose name contains one of these")
    parser.add_argument("--bracket", nargs="*", type=Path, default=[], help="folders of brackets")
    parser.add_argument("--json", type=Path, help="file for the results")
    parser.add_argument("--crops", type=Path, help="folder for pictures, ours and theirs")
    options = parser.parse_args()
    rows = []
    for one in sets(options.bracket, options.names):
        rows.append(measured(one, options.crops))
        print(line(rows[-1]), flush=True)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def sets(folders: Sequence[Path], names: Sequence[str]) -> Any:
    """Yield brackets one after another, so that few are in memory."""
    memorial = SHARED / "brackets" / "memorial"

    def wanted(name: str) -> bool:
        return not names or any(part in name for part in names)

    for folder in [*([memorial] if memorial.exists() else []), *folders]:
        if wanted(folder.name):
            yield from_folder(folder)
    for name, (place, azimuth, way) in MADE.items():
        hdri = place.replace("probe-1", "city")
        if not wanted(name) or not (
            SHARED.exists() or (resources() / f"demo/scenes/{hdri}.exr").exists()
        ):
            continue
        light = scene(place)
        if azimuth is None:
            light = np.asarray(cv2.resize(light, (2048, 1024), interpolation=cv2.INTER_CUBIC))
            made = make(np.maximum(light, 1e-5), way, panorama=True)
        else:
            made = make(view(light, azimuth, SHAPE), way)
        yield Set(name, made.frames, [2.0**s for s in way.stops], way.shake_px > 0.0, made)


def from_folder(folder: Path) -> Set:
    """Read a bracket from disk, with Debevec's image_list.txt or EXIF."""
    listing = folder / "image_list.txt"
    if listing.exists():
        words = [row.split() for row in listing.read_text().splitlines()]
        words = [w for w in words if len(w) >= 2 and (folder / w[0]).exists()]
        paths, times = [folder / w[0] for w in words], [float(w[1]) for w in words]
    else:
        bracket = read_bracket([folder])
        paths, times = [f.path for f in bracket.frames], [2.0**s for s in bracket.stops]
    return Set(folder.name, [decoded(path.read_bytes()) for path in paths], times)


def ours(one: Set, folder: Path) -> tuple[Float32, list[Bytes], int, Measurement]:
    """Return light, aligned frames, the reference frame, and the measurement."""
    paths = []
    for index, frame in enumerate(one.frames):
        paths.append(folder / f"{index:02d}.png")
        paths[-1].write_bytes(
            cv2.imencode(".png", frame[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()
        )
    probe = measure(paths, MeasureOptions(times=tuple(one.times), full=True))
    names = [frame.path for frame in probe.bracket.frames]
    frames, home = [], len(one.frames) // 2
    for index, (path, frame) in enumerate(zip(paths, one.frames, strict=True)):
        if path not in names:
            continue
        lay = probe.lays[names.index(path)] if probe.lays else None
        frames.append(warp(frame, lay.homography) if lay and lay.needed else frame)
        home = index if lay and lay.shift_px == 0.0 else home
    return probe.finished.measured.radiance, frames, home, probe


def theirs(one: Set, method: str, align: bool) -> tuple[Float32, list[Bytes]]:
    frames = [frame.copy() for frame in one.frames]
    if align:
        cv2.createAlignMTB(5).process(one.frames, frames)
    times = np.array(one.times, np.float32)
    if method == "debevec":
        response = cv2.createCalibrateDebevec().process(frames, times)
        return np.asarray(cv2.createMergeDebevec().process(frames, times, response)), frames
    small = [np.ascontiguousarray(frame[::4, ::4]) for frame in frames]
    response = cv2.createCalibrateRobertson().process(small, times)
    return np.asarray(cv2.createMergeRobertson().process(frames, times, response)), frames


def measured(one: Set, crops: Path | None) -> dict[str, Any]:
    """Measure all methods on one set."""
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        light, frames, home, probe = ours(one, Path(folder))
    seconds = time.perf_counter() - started
    row: dict[str, Any] = {"set": one.name, "frames": len(one.frames), "seconds": round(seconds, 2)}
    row["methods"] = {"ours": judged(one, light, frames, home)}
    row["moved"] = round(probe.motion.share, 3)
    row["words"] = [str(word) for word in probe.warnings]
    if one.made is not None and not one.held and one.made.still.all():
        truth = one.made.seen(len(one.frames) // 2)[0]
        row["methods"]["truth"] = judged(one, truth, one.frames, len(one.frames) // 2)
    pictures = {"ours": light}
    for method in ("debevec", "robertson"):
        ways: dict[str, bool] = {method: one.held}
        if one.held:
            ways[f"{method}, as shot"] = False
        for name, align in ways.items():
            light, frames = theirs(one, method, align)
            row["methods"][name] = judged(one, light, frames, len(one.frames) // 2)
            pictures[name] = light
    if crops:
        drawn(one, pictures, crops)
    return row


def judged(one: Set, light: Float32, frames: list[Bytes], home: int) -> dict[str, float]:
    light = np.nan_to_num(np.asarray(light, np.float32), posinf=0.0, neginf=0.0)
    inner = np.ones(light.shape[:2], bool)
    if one.held:  # areas that only some frames see are excluded
        inner[:16], inner[-16:], inner[:, :16], inner[:, -16:] = False, False, False, False
    inner &= ~np.any([marked(frame) for frame in one.frames], axis=0)
    median, high = spreads(light, frames, inner)
    result = {"median": median, "p95": high, "speckle": speckle(light, inner)}
    if one.made is not None:
        truth, still = one.made.seen(home)
        seen = np.any([(f.max(axis=-1) < 250) & (f.min(axis=-1) > 4) for f in frames], axis=0)
        result["error"], result["error_p95"] = error_of(light, truth, still & seen & inner)
    return {key: round(value, 5) for key, value in result.items()}


def marked(frame: Bytes) -> NDArray[np.bool_]:
    """Return a mask of pure blue, which marks the empty borders of the memorial church."""
    blue = (frame[..., 2] > 200) & (frame[..., :2].max(axis=-1) < 40)
    return cv2.dilate(blue.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0


def drawn(one: Set, pictures: dict[str, Float32], folder: Path) -> None:
    """Draw ours and theirs with equal exposure."""
    folder.mkdir(exist_ok=True)
    for name, light in pictures.items():
        if "as shot" in name:
            continue
        light = np.nan_to_num(np.asarray(light, np.float32), posinf=0.0, neginf=0.0)
        mean = np.exp(np.mean(np.log(np.maximum(light, 1e-6))))
        shown = light / (light + 2.0 * mean)
        codes = np.rint(255.0 * np.clip(shown, 0.0, 1.0) ** 0.6).astype(np.uint8)
        path = folder / f"{one.name.replace(', ', '-').replace(' ', '-')}-{name}.png"
        path.write_bytes(cv2.imencode(".png", codes[..., ::-1])[1].tobytes())


def line(row: dict[str, Any]) -> str:
    lines = [f"{row['set']:20} moved {row['moved']:.3f}  {row['seconds']:.1f} s"]
    for name, one in row["methods"].items():
        error = f"  error {one['error']:.3f} {one['error_p95']:.3f}" if "error" in one else ""
        lines.append(
            f"    {name:20} spread {one['median']:.3f} {one['p95']:.3f}"
            f"  speckle {100 * one['speckle']:.2f} %{error}"
        )
    lines += [f"    {word}" for word in row["words"]]
    return "\n".join(lines)


if __name__ == "__main__":
    began = time.perf_counter()
    main()
    print(f"{time.perf_counter() - began:.0f} s")
