"""Check my shot on real people: each is relit by a place, photographed, and checked for a style.

Every person is put into a grey frame as in `benchmarks.faces.photos`, relit by a place at a turn,
and developed with a tone curve, noise, JPEG compression and an exposure error of up to one stop:
only the face shows the turn, not the background. Light from beyond 110 degrees, where no lamp of
these people was, is removed from the place as well.

    python -m benchmarks.faces.check_shot --people FOLDER --places FOLDER [FOLDER ...]
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import srgb_encode
from app.core.environment.environment import solid_angles
from app.core.faces import facing
from app.core.faces.face_on_head import HeadMap, head_map, on_head
from app.core.faces.facing import WIDE_DEG, FacingEstimate, find_facing, standing
from app.core.faces.finder import find_faces
from app.core.faces.pose import head_pose
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.faces.people import BEHIND_DEG, directions, lamp_shares, places, texel_grid
from benchmarks.faces.photos import CORNER, FAR_PX, FRAME
from benchmarks.truth.stock import ROOT

Floats = NDArray[np.float64]
TURNS: Final = 6
"""Turns of each person in each place."""
HALVES: Final = 128
"""Possible turns of a photo: whole texels and halves between them."""
FAR_DEG: Final = 30.0
BESIDE_DEG: Final = 15.0


@dataclass(frozen=True)
class Shot:
    """A photo: its place, the true direction of the face, and the estimate."""

    place: str
    turn_deg: float
    found: FacingEstimate | None


def developed(light: Floats, chance: np.random.Generator) -> NDArray[np.uint8]:
    """Return a linear picture as developed by a camera, in a grey frame."""
    exposed = 0.7 * 2.0 ** chance.uniform(-1, 1) * light / np.percentile(light, 99)
    exposed = exposed + chance.normal(0, 0.01, exposed.shape) * np.sqrt(exposed + 0.01)
    codes = srgb_encode(np.clip(exposed, 0, 1)).astype(np.float64)
    codes += chance.uniform(0, 0.5) * (codes**2 * (3 - 2 * codes) - codes)
    rows, columns, grey = FRAME
    frame = np.full((rows, columns, 3), grey, np.uint8)
    part = np.round(255 * codes).astype(np.uint8)[..., None]
    frame[CORNER[0] : CORNER[0] + len(part), CORNER[1] : CORNER[1] + part.shape[1]] = part
    done, data = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80])
    assert done
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def taken(
    people: Path, lights: dict[str, Floats], turns: int, seed: int = 5
) -> Iterator[tuple[str, float, NDArray[np.uint8]]]:
    """Yield all photos: place, turn and picture; always the same."""
    chance = np.random.default_rng(seed)
    shape = (32, 64)
    azimuth, elevation = texel_grid(shape)
    front = (np.abs(azimuth) <= BEHIND_DEG) * solid_angles(shape)[:, None]
    # A turn of half a texel moves everything half a texel towards the sitter's left.
    half = 180 / shape[1]
    for file in sorted(people.glob("*.npz")):
        with np.load(file, allow_pickle=False) as known:
            images, lamps = known["images"] / 255, known["lamps_deg"].astype(np.float64)
        ways = [directions(azimuth + step, elevation).reshape(-1, 3) for step in (0.0, half)]
        shares = [lamp_shares(lamps, way) for way in ways]
        for place, light in lights.items():
            grey = light @ np.array([0.2126, 0.7152, 0.0722])
            for number in chance.choice(HALVES, turns, replace=False).tolist():
                texels, beside = divmod(number, 2)
                lit = (np.roll(grey, -texels, axis=1) * front).ravel()
                picture = np.tensordot(shares[beside].T @ lit, images, 1)
                yield place, number * 360 / HALVES, developed(picture, chance)


@cache
def front_map() -> HeadMap:
    """Return the head without light from beyond 110 degrees."""
    head = head_map()
    rows, columns = head.transport.environment_shape
    around = 180 - 360 * (np.arange(columns) + 0.5) / columns
    texels = head.transport.texel_basis.reshape(-1, rows, columns) * (np.abs(around) <= BEHIND_DEG)
    cut = replace(head.transport, texel_basis=texels.reshape(len(texels), -1))
    return replace(head, transport=cut)


def read(people: Path, lights: dict[str, Floats], turns: int = TURNS) -> list[Shot]:
    """Read all photographs."""
    shots = []
    for place, turn, picture in taken(people, lights, turns):
        faces = find_faces(picture, small=False)
        found = None
        if faces:
            pose = head_pose(faces[0], (picture.shape[0], picture.shape[1]), FAR_PX)
            found = find_facing(*on_head(picture, faces[0]), pose, lights[place])
        shots.append(Shot(place, turn, found))
    return shots


def judged(shots: Sequence[Shot], results: Mapping[str, Sequence[StyleResult]]) -> dict[str, Any]:
    """Compare the answers with the truth, for all pairs of a place and a style in reach."""
    told: list[float] = []
    counts = dict.fromkeys(("pairs", "unsure", "in", "in_wrong", "beside", "beside_right"), 0)
    counts |= dict.fromkeys(("far", "far_right", "wide", "wide_told"), 0)
    for shot in shots:
        for result in results[shot.place]:
            if result.grade not in ("yes", "soft"):
                continue
            start, stop = result.arc_deg
            width = 360.0 if stop - start >= 360 else (stop - start) % 360
            told_as = "unsure" if shot.found is None else standing(shot.found, result.arc_deg)
            off = abs(wrap(shot.turn_deg - start - width / 2)) - width / 2
            if width > WIDE_DEG:
                counts["wide"] += 1
                counts["wide_told"] += told_as == "outside"
                continue
            counts["pairs"] += 1
            counts["unsure"] += told_as == "unsure"
            counts["in"] += off <= 0
            counts["in_wrong"] += off <= 0 and told_as == "outside"
            counts["beside"] += off > BESIDE_DEG
            counts["beside_right"] += off > BESIDE_DEG and told_as == "inside"
            far = abs(wrap(shot.turn_deg - result.turn_refined_deg)) > FAR_DEG
            counts["far"] += far
            counts["far_right"] += far and told_as == "inside"
            if told_as == "outside" and shot.found is not None:
                told.append(abs(wrap(shot.found.azimuth_deg - shot.turn_deg)))
    return {
        **counts,
        "told": len(told),
        "told_median_deg": round(float(np.median(told)), 1),
        "told_p90_deg": round(float(np.percentile(told, 90)), 1),
        "inside_called_wrong": counts["in_wrong"] / counts["in"],
        "far_called_right": counts["far_right"] / counts["far"],
        "beside_called_right": counts["beside_right"] / counts["beside"],
        "unsure_share": counts["unsure"] / counts["pairs"],
    }


def measured(people: Path, folders: Sequence[Path], turns: int = TURNS) -> dict[str, Any]:
    """Read all people in all places."""
    lights = places(folders)
    pack = load_named_pack("generic")
    # In a silhouette a face shows nothing.
    shown = [style.name for style in pack.styles if not style.signature.areas]
    results = {
        name: solve_all(pack, light.astype(np.float32), styles=shown)
        for name, light in lights.items()
    }
    with patch.object(facing, "head_map", front_map):
        shots = read(people, lights, turns)
    missed = sum(shot.found is None for shot in shots)
    return {"places": len(lights), "photographs": len(shots), "not_read": missed} | judged(
        shots, results
    )


def main() -> None:
    """Measure, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=Path, required=True)
    parser.add_argument("--places", type=Path, nargs="+", required=True)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/check-shot.json")
    args = parser.parse_args()
    started = time.perf_counter()
    found = measured(args.people, args.places)
    found["seconds"] = {"all": round(time.perf_counter() - started, 1)}
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
