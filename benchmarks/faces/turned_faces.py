"""Turned faces: are they detected, and does a face show its direction in a place?

`found`: 12 poses, four sizes in a frame of 1,280 x 960 in front of a view of a place, four
exposures. `in_places`: heads in all places, at eight turns of the lens and three of the head,
judged like `photo --place`. See `turned_heads` for the renders.

    python -m benchmarks.faces.turned_faces --places FOLDER
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, NamedTuple

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.base.atomic_files import atomic_write_text
from app.core.environment.environment import from_radiance, read_environment, reduce
from app.core.faces.face_on_head import on_head
from app.core.faces.facing import FacingEstimate, Standing, find_facing, standing
from app.core.faces.finder import find_faces
from app.core.faces.pose import head_pose
from app.core.localization.views import Lens, look
from app.core.solver.solve import solve_all
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.faces.turned_heads import (
    HEADS,
    LARGE_PX,
    PHOTO_PX,
    ROOM,
    WORK,
    Box,
    Float32,
    Pictured,
    developed,
    pictured,
    place,
)
from benchmarks.truth.stock import ROOT

POSES: Final = (
    *((yaw, 0) for yaw in (-60, -45, -30, 0, 30, 45, 60)),
    *((0, -15), (0, 15), (-30, 15), (-30, -15), (30, -15)),
)
"""Yaw and pitch: all yaws level, and 15 degrees up and down at 0 and 30, one left out."""
LIT: Final = (("st_fagans_interior_1k", 40.0), ("rooitou_park_1k", -70.0))
"""Places, and turns in them, that light the faces in turn."""
FRAME: Final = (1280, 960)
CORNERS: Final = {320: (60, 300), 160: (700, 60), 80: (820, 520), 40: (1080, 660)}
"""Sizes of the face, and the corner of its picture in the frame."""
EXPOSURES: Final = (-3, -2, 0, 1)
LEAST_IOU, MOST_YAW, SURE = 0.4, 25.0, 0.8
YAWS: Final = (-15, 0, 15)
TURNS: Final = 8
NARROW_DEG: Final = 40.0


def found(places: Path) -> dict[str, Any]:
    """Search for faces of all sizes at once, exposure by exposure."""
    chance, wrong = np.random.default_rng(1), []
    rows: list[tuple[Any, ...]] = []
    for number, (name, pose) in enumerate((name, pose) for name in HEADS for pose in POSES):
        where, turn = LIT[number % 2]
        file = places / f"{where}.hdr"
        frame, boxes = composed(pictured(name, file, pose, turn, LARGE_PX), place(file), turn)
        for exposure in EXPOSURES:
            shown = developed(frame, 2.0**exposure, chance)
            seen = [
                (one.box, head_pose(one, FRAME[::-1]).yaw_deg - pose[0], one.confidence)
                for one in find_faces(shown)
            ]
            for size, known in boxes.items():
                off = [off for at, off, _ in seen if overlap(at, known) >= LEAST_IOU]
                rows.append((pose, size, exposure, name, min(off, key=abs) if off else None))
            wrong += [
                f"{name} {pose} {exposure:+} EV: yaw {off:+.0f} off, {sure:.2f}, {np.round(at)}"
                for at, off, sure in seen
                if sure > SURE and not right(at, off, boxes.values())
            ]
    by = {
        what: {
            str(key): told([row[-1] for row in rows if row[column] == key])
            for key in dict.fromkeys(row[column] for row in rows)
        }
        for column, what in enumerate(("pose", "size", "exposure", "head"))
    }
    return {"all": told([row[-1] for row in rows]), "wrong_and_sure": wrong, **by}


def right(at: Box, off: float, known: Iterable[Box]) -> bool:
    """Return whether a detection is a face with the right pose."""
    return abs(off) <= MOST_YAW and max(overlap(at, one) for one in known) >= LEAST_IOU


def told(off: list[float | None]) -> dict[str, float]:
    """Return the share of detected faces, and the errors of their yaw."""
    known = [abs(one) for one in off if one is not None]
    return {
        "faces": len(off),
        "found": round(sum(one <= MOST_YAW for one in known) / len(off), 4),
        "yaw_median": round(float(np.median(known)), 1) if known else math.nan,
        "yaw_most": round(max(known), 1) if known else math.nan,
    }


def composed(head: Pictured, radiance: Float32, turn: float) -> tuple[Float32, dict[int, Box]]:
    """Return all sizes in one frame in front of a view of the place, and the faces' boxes."""
    frame = look(radiance, wrap(turn + 180), Lens(50.0, FRAME))
    frame = np.array(frame * 0.3 / max(float(np.percentile(frame, 70)), 1e-9), np.float32)
    boxes: dict[int, Box] = {}
    for size, (x, y) in CORNERS.items():
        side, share = round(ROOM * size), size / LARGE_PX
        small = cv2.resize(head.picture, (side, side), interpolation=cv2.INTER_AREA)
        part = frame[y : y + side, x : x + side]
        part[:] = part * (1 - np.clip(small[..., 3:], 0, 1)) + small[..., :3] * head.gain
        left, top, right, bottom = (edge * share for edge in head.box)
        boxes[size] = (left + x, top + y, right + x, bottom + y)
    return frame, boxes


def overlap(one: Box, other: Box) -> float:
    """Return intersection over union of two boxes."""
    a, b = np.reshape(one, (2, 2)), np.reshape(other, (2, 2))
    common = float(np.prod(np.maximum(np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]), 0)))
    return common / (float(np.prod(a[1] - a[0])) + float(np.prod(b[1] - b[0])) - common)


def shot(
    name: str, file: Path, yaw: int, turn: float, chance: np.random.Generator
) -> FacingEstimate | None:
    """Return the estimated direction of a head in a photo; None if there is none."""
    head = pictured(name, file, (yaw, 0), turn, PHOTO_PX)
    gain = head.gain * 2 ** chance.uniform(-1, 1)
    behind = 0.18 / gain * (1 - np.clip(head.picture[..., 3:], 0, 1))
    picture = developed(head.picture[..., :3] + behind, gain, chance)
    faces = find_faces(picture)
    if not faces:
        return None
    pose = head_pose(faces[0], (len(picture), len(picture)), head.focal)
    light = reduce(from_radiance(place(file), file.stem))
    return find_facing(*on_head(picture, faces[0]), pose, light)


def signs() -> list[dict[str, Any]]:
    """Check, with one lamp in the dark, that the azimuths follow turn and yaw."""
    chance, rows = np.random.default_rng(3), []
    for turn, yaw in itertools.product((20, 100), YAWS):
        facing = shot("generic", Path("60"), yaw, float(turn), chance)
        azimuth = None if facing is None else round(facing.azimuth_deg, 1)
        rows.append({"turn": turn, "yaw": yaw, "nose": turn - yaw, "told": azimuth})
    return rows


def in_places(places: Path) -> dict[str, Any]:
    """Judge the directions of heads against the narrow arcs of styles that a place gives."""
    chance, names = np.random.default_rng(2), list(HEADS)
    shots: list[dict[str, Any]] = []
    pairs: list[Pair] = []
    for number, file in enumerate(sorted(places.glob("*.hdr"))):
        results = [
            one
            for one in solve_all(load_named_pack("generic"), reduce(read_environment(file)))
            if one.grade in ("yes", "soft") and width(one.arc_deg) <= NARROW_DEG
        ]
        for step, yaw in itertools.product(range(TURNS), YAWS):
            turn, name = (
                wrap(step * 360 / TURNS + 7 * number),
                names[(step + yaw // 15 + number) % 3],
            )
            nose, seen = wrap(turn - yaw), shot(name, file, yaw, turn, chance)
            off = None if seen is None else wrap(seen.azimuth_deg - nose)
            shots.append({"place": file.stem, "head": name, "yaw": yaw, "off": off})
            if seen is None or off is None:
                continue
            for one in results:
                half = width(one.arc_deg) / 2
                beyond = abs(wrap(nose - one.arc_deg[0] - half)) - half
                far, says = abs(wrap(nose - one.turn_refined_deg)), standing(seen, one.arc_deg)
                label = f"{file.stem} {one.name} {name} {yaw:+}"
                pairs.append(Pair(says, beyond, far, abs(off), label))
    return {**judged(pairs), "shots": shots_told(shots), "wrong": wrongs(pairs)}


class Pair(NamedTuple):
    """A shot and a style: the answer, and the nose's distance beyond the arc and from its turn."""

    says: Standing
    beyond: float
    far: float
    off: float
    label: str


def width(arc: tuple[float, float]) -> float:
    """Return the width of an arc, deg."""
    return (arc[1] - arc[0]) % 360


def judged(pairs: list[Pair]) -> dict[str, Any]:
    """Return shares of answers, where there should be one and where there should not."""

    def share(says: Standing, among: list[Pair]) -> dict[str, float]:
        count = sum(one.says == says for one in among)
        return {"pairs": len(among), says: count, "share": round(count / max(len(among), 1), 4)}

    off = [one.off for one in pairs if one.says == "outside"]
    within = [one for one in pairs if one.beyond <= 0]
    return {
        "unsure": share("unsure", pairs),
        "off_where_outside": {"pairs": len(off), "median": round(float(np.median(off)), 2)},
        "off_p90": round(float(np.percentile(off, 90)), 2),
        "in_the_arc_told_outside": share("outside", within),
        "in_the_arc_told_inside": share("inside", within),
        "over_30_off": share("inside", [one for one in pairs if one.far > 30]),
        "over_15_outside": share("inside", [one for one in pairs if one.beyond > 15]),
    }


def shots_told(shots: list[dict[str, Any]]) -> dict[str, Any]:
    """Return errors of the azimuth over all shots: by yaw, head and place."""
    result: dict[str, Any] = {"all": len(shots), "read": sum(s["off"] is not None for s in shots)}
    for what in ("yaw", "head", "place"):
        for key in dict.fromkeys(one[what] for one in shots):
            off = [s["off"] for s in shots if s[what] == key and s["off"] is not None] or [math.nan]
            middle, size = float(np.median(off)), float(np.median(np.abs(off)))
            result[str(key)] = {"median": round(middle, 1), "median_size": round(size, 1)}
    return result


def wrongs(pairs: list[Pair]) -> list[str]:
    """Return the pairs with a wrong answer."""
    return [
        f"{one.label}: {one.says}, {one.beyond:.0f} beyond, read {one.off:.0f} off"
        for one in pairs
        if (one.says == "inside" and (one.beyond > 15 or one.far > 30))
        or (one.says == "outside" and one.beyond <= 0)
    ]


def main() -> None:
    """Measure all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--places", type=Path, required=True)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/turned-faces.json")
    args = parser.parse_args()
    started = time.perf_counter()
    WORK.mkdir(parents=True, exist_ok=True)
    result: dict[str, Any] = {"signs": signs(), "found": found(args.places)}
    result["facing"] = in_places(args.places)
    result["seconds"] = {"all": round(time.perf_counter() - started, 1)}
    atomic_write_text(args.o, json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
