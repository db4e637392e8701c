"""Faces in photos: light read from real people under known lamps, and faces where nobody is.

Each picture of a person is put into a grey frame as a camera would show it (sRGB), detected there,
and read; the program gets only the frame. Places without people are searched from 1,000 sides.

    python -m benchmarks.faces.photos --people FOLDER --places FOLDER
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import srgb_encode, tone_map
from app.core.environment.environment import read_environment
from app.core.faces.finder import find_faces
from app.core.faces.light_from_face import FaceLight, read_light
from app.core.localization.views import Lens, look
from app.core.painting.photo_style import photo_style
from app.core.painting.user_style import prepare_user_style, solve_user_styles
from app.core.solver.face import AREAS
from app.core.solver.place_light import prepare
from app.core.solver.relighting_cache import light_table
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from benchmarks.faces.people import directions, lamp_shares, load_people
from benchmarks.truth.stock import ROOT

Bytes: TypeAlias = NDArray[np.uint8]
FRAME: Final = (384, 400, 130)
"""Rows, columns and grey of the frame."""
CORNER: Final = (100, 116)
FAR_PX: Final = 3000.0
"""Focal length: the people were photographed from far away."""
BEHIND_DEG: Final = 95
NEVER_BEHIND_DEG: Final = 75
REACH_DEG: Final = 115
"""Largest angle of the people's lamps."""
KEYS_DEG: Final = (-70.0, -50.0, -35.0, -20.0, 20.0, 35.0, 50.0, 70.0)
RATIOS: Final = (2, 4, 8)
"""Key and fill to fill, incident."""
SIDES_DEG: Final = (-70.0, -50.0, -35.0, 35.0, 50.0, 70.0)
HEIGHTS_DEG: Final = (0.0, 15.0, 35.0)
SIZES_DEG: Final = {10.0: (0.0,), 40.0: (-15.0, 0.0, 15.0)}
"""Sizes of keys, and the adjacent lamps that compose them."""
FILLS: Final = (None, 8.0, 4.0, 2.0)
AZIMUTHS_DEG: Final = ((0, 10), (11, 25), (26, 40), (41, 60), (61, 75), (76, 95))
ELEVATIONS_DEG: Final = ((-40, -30), (-29, -5), (-4, 5), (6, 20), (21, 45), (46, 90))
VIEWS: Final = 84
"""Number of views of each place."""


def framed(picture: NDArray[np.float64]) -> Bytes:
    """Return a linear grey picture, 0 to 1, in its frame."""
    rows, columns, grey = FRAME
    frame = np.full((rows, columns, 3), grey, np.uint8)
    shown = np.round(255 * srgb_encode(picture)).astype(np.uint8)[..., None]
    frame[CORNER[0] : CORNER[0] + len(shown), CORNER[1] : CORNER[1] + shown.shape[1]] = shown
    return frame


def lamps(people: Path, step: int = 1) -> dict[str, Any]:
    """Compare the readings under single lamps with the lamps' positions."""
    rows = []
    for file in sorted(people.glob("*.npz")):
        with np.load(file, allow_pickle=False) as known:
            images, lamps_deg = known["images"], known["lamps_deg"].astype(np.float64)
        rows += [
            (lamp, _read(framed(image / 255)))
            for image, lamp in zip(images[::step], lamps_deg[::step], strict=True)
        ]
    front = [row for row in rows if abs(row[0][0]) <= BEHIND_DEG]
    behind = [row for row in rows if abs(row[0][0]) > BEHIND_DEG]
    errors = [_apart(lamp, light) for lamp, light in front]
    known_errors = [error for error in errors if error is not None]
    told = [lamp for lamp, light in front if light is not None and light.key == "behind"]
    inside = [
        (lamp, error <= light.error_deg)
        for (lamp, light), error in zip(front, errors, strict=True)
        if error is not None and light is not None and light.error_deg is not None
    ]
    return {
        "pictures": len(rows),
        "within_error": float(np.mean([held for _, held in inside])),
        "within_error_by_azimuth": _bands(inside, 0, AZIMUTHS_DEG),
        "within_error_by_elevation": _bands(inside, 1, ELEVATIONS_DEG),
        "found": float(np.mean([light is not None for _, light in rows])),
        "read": len(known_errors) / len(errors),
        "median_deg": float(np.median(known_errors)),
        "p90_deg": float(np.percentile(known_errors, 90)),
        "behind_told": float(
            np.mean([light is not None and light.key == "behind" for _, light in behind])
        ),
        "front_told_behind": sum(bool(abs(lamp[0]) <= NEVER_BEHIND_DEG) for lamp in told),
    }


def _bands(
    inside: list[tuple[NDArray[np.float64], bool]], part: int, bands: tuple[tuple[int, int], ...]
) -> dict[str, float]:
    """Return the share of lamps within the stated error, by their angle aside or up."""
    value = np.array([(abs(lamp[0]), lamp[1])[part] for lamp, _ in inside])
    held = np.array([one for _, one in inside])
    return {
        f"{low} to {high}": round(float(held[(low <= value) & (value <= high)].mean()), 3)
        for low, high in bands
    }


def outcomes(people: Path) -> dict[str, Any]:
    """Count the readings for even light, flash at the lens, backlight, and keys with a fill."""
    chance = np.random.default_rng(3)
    told: dict[str, list[str]] = {}
    held: dict[str, list[bool]] = {}
    for file in sorted(people.glob("*.npz")):
        with np.load(file, allow_pickle=False) as known:
            images, lamps_deg = known["images"] / 255, known["lamps_deg"].astype(np.float64)
        for name, key, light in _lights(lamps_deg, chance):
            picture = np.tensordot(light, images, 1)
            found = _read(framed(np.clip(0.9 * picture / np.percentile(picture, 99.5), 0, 1)))
            told.setdefault(name, []).append(_outcome(found))
            off = None if key is None else _apart(np.array(key), found)
            if off is not None and found is not None and found.error_deg is not None:
                held.setdefault(name, []).append(off <= found.error_deg)
    return {
        name: {"pictures": len(one), "told": {k: round(v / len(one), 3) for k, v in
                                              Counter(one).most_common()}}
        | ({"within_error": round(float(np.mean(held[name])), 3)} if name in held else {})
        for name, one in told.items()
    }  # fmt: skip


def _outcome(light: FaceLight | None) -> str:
    return "no face" if light is None else light.key or "not read"


def _lights(
    lamps_deg: NDArray[np.float64], chance: np.random.Generator
) -> Iterator[tuple[str, tuple[float, float] | None, NDArray[np.float64]]]:
    """Yield names of lights, the position of their key, and their mix of lamps."""

    def lamp(azimuth: float, elevation: float) -> NDArray[np.float64]:
        toward = directions(np.array([azimuth]), np.array([elevation]))
        return np.asarray(lamp_shares(lamps_deg, toward)[0], np.float64)

    ways = directions(lamps_deg[:, 0], lamps_deg[:, 1])
    grid = chance.normal(size=(20000, 3))
    grid /= np.linalg.norm(grid, axis=1, keepdims=True)
    near = grid @ ways.T
    reached = near.max(axis=1) > math.cos(math.radians(35))
    owner, grid = near.argmax(axis=1)[reached], grid[reached]
    room = np.bincount(owner, minlength=len(ways)).astype(np.float64)
    room /= room.sum()
    front = (np.hypot(*lamps_deg.T) <= 45).astype(np.float64)
    front /= front.sum()
    yield "even: all lamps alike", None, np.ones(len(ways), np.float64)
    yield "even: all around", None, room
    for _ in range(3):
        lean = grid @ chance.normal(size=3) * 0.2
        leaning = np.bincount(owner, np.maximum(1 + lean, 0.05), len(ways))
        yield "even: a little brighter at one side", None, leaning.astype(np.float64)
    for elevation, ratio in itertools.product((0.0, 5.0, 10.0), (None, 8.0)):
        flash = lamp(0.0, elevation)
        light = flash if ratio is None else flash * (ratio - 1) + room
        yield "flash at the lens", (0.0, elevation), light
    for azimuth, ratio, fill in itertools.product((115.0, -125.0), (4.0, 8.0, 16.0), (front, room)):
        yield "backlight beside a fill", None, lamp(azimuth, 10.0) * (ratio - 1) + fill
    for ratio, fill in itertools.product((8.0, 4.0, 2.0), (front, room)):
        for _ in range(3):
            key = float(chance.uniform(-85, 85)), float(chance.uniform(-25, 60))
            yield f"key beside a fill of {ratio:g}:1", key, lamp(*key) * (ratio - 1) + fill


def styles(people: Path) -> dict[str, Any]:
    """Light people by the lamps of each style within their range, and name it."""
    known = load_named_pack("generic").styles
    judged = [
        style for style in known if all(abs(lamp.azimuth_deg) <= REACH_DEG for lamp in style.lamps)
    ]
    names = {style.name for style in judged}
    places, missed = [], []
    for file in sorted(people.glob("*.npz")):
        with np.load(file, allow_pickle=False) as one:
            images, lamps_deg = one["images"] / 255, one["lamps_deg"].astype(np.float64)
        for style in judged:
            at = np.array([(lamp.azimuth_deg, lamp.elevation_deg) for lamp in style.lamps])
            shares = lamp_shares(lamps_deg, directions(at[:, 0], at[:, 1]))
            power = np.array([lamp.power for lamp in style.lamps])
            picture = np.tensordot(power @ shares, images, 1)
            found = _read(framed(np.clip(0.9 * picture / np.percentile(picture, 99.5), 0, 1)))
            told = [] if found is None else [one for one, _ in found.styles if one in names]
            places.append(told.index(style.name) if style.name in told else len(names))
            if places[-1] > 0:
                missed.append(f"{style.name}: {told[0] if told else 'no face'}")
    ranks = np.array(places)
    return {
        "styles": len(judged),
        "pictures": len(ranks),
        "first": float((ranks == 0).mean()),
        "among_three": float((ranks < 3).mean()),
        "missed": dict(Counter(missed).most_common(8)),
    }


def ratios(people: Path) -> dict[str, Any]:
    """Light people by a key and a frontal fill 90 degrees wide, and read the cheeks' ratio.

    The truth is measured in the same picture's own areas, over those with the fill alone.
    """
    cheeks = [AREAS.index(name) for name in ("left cheek", "right cheek")]
    chance = np.random.default_rng(2)
    errors: dict[str, list[float]] = {}
    aside: dict[str, list[float]] = {}
    for person, file in zip(load_people(people), sorted(people.glob("*.npz")), strict=True):
        with np.load(file, allow_pickle=False) as known:
            images = known["images"] / 255
        front = np.hypot(*person.lamps_deg.T) <= 45
        fill = front / front.sum()
        areas = person.areas[cheeks] @ person.pictures
        for azimuth, ratio in itertools.product(KEYS_DEG, RATIOS):
            key = np.array([[azimuth, chance.choice([0.0, 15.0, 35.0])]])
            light = lamp_shares(person.lamps_deg, directions(key[:, 0], key[:, 1]))[0]
            light = light * (ratio - 1) + fill
            picture = np.tensordot(light, images, 1)
            found = _read(framed(np.clip(0.9 * picture / np.percentile(picture, 99.5), 0, 1)))
            if found is None or found.ratio_stops is None:
                continue
            left, right = (areas @ light) / (areas @ fill)
            name = f"{ratio}:1"
            errors.setdefault(name, []).append(found.ratio_stops - abs(math.log2(left / right)))
            off = _apart(key[0], found)
            aside.setdefault(name, []).extend([] if off is None else [off])
    every = np.abs(np.concatenate(list(errors.values())))
    return {
        "pictures": len(every),
        "median_stops": float(np.median(every)),
        "p90_stops": float(np.percentile(every, 90)),
        "key_median_deg": {name: round(float(np.median(one)), 1) for name, one in aside.items()},
        "key_read": {name: len(one) / len(errors[name]) for name, one in aside.items()},
    }


def like_photo(people: Path, places: Path) -> dict[str, Any]:
    """Make styles from pictures, and compare their turns with those of styles with the true lamps.

    A turn is right within the tolerance arc of the true style's; only places where that one is in
    reach count.
    """
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    lights = [prepare(read_environment(file)).searched for file in sorted(places.glob("*.hdr"))]
    tables = [light_table(transport, light) for light in lights]

    def solved(light: FaceLight) -> list[StyleResult]:
        style = photo_style(light, pack, transport, "", "photo", "")
        asked = prepare_user_style(transport, style)
        return [
            solve_user_styles(transport, [asked], place, table=table)[0]
            for place, table in zip(lights, tables, strict=True)
        ]

    known: dict[Any, list[StyleResult]] = {}
    right: dict[str, list[bool]] = {}
    refused: dict[str, list[bool]] = {}
    offs: list[float] = []
    for key, size, ratio, picture in _composed(people):
        name = "none" if ratio is None else f"{ratio:g}:1"
        found = _read(framed(picture))
        read = found is not None and found.azimuth_deg is not None
        refused.setdefault(name, []).append(not read)
        if found is None or not read:
            continue
        true = replace(
            found, azimuth_deg=key[0], elevation_deg=key[1], softness_deg=size, fill_ratio=ratio
        )
        truths = known.setdefault((key, size, ratio), []) or solved(true)
        known[key, size, ratio] = truths
        for truth, own in zip(truths, solved(found), strict=True):
            if truth.attainable:
                right.setdefault(name, []).append(_on_arc(own.turn_refined_deg, truth.arc_deg))
                offs.append(abs(wrap(own.turn_refined_deg - truth.turn_refined_deg)))
    every, no = (list(itertools.chain(*one.values())) for one in (right, refused))
    return {
        "pictures": len(no),
        "refused": float(np.mean(no)),
        "pairs": len(every),
        "within_arc": float(np.mean(every)),
        "within_arc_by_fill": {name: round(float(np.mean(one)), 3) for name, one in right.items()},
        "median_off_deg": float(np.median(offs)),
    }


def _on_arc(turn_deg: float, arc_deg: tuple[float, float]) -> bool:
    start, end = arc_deg
    return end - start >= 360 or (turn_deg - start) % 360 <= (end - start) % 360


def _composed(
    people: Path,
) -> Iterator[tuple[tuple[float, float], float, float | None, NDArray[np.float64]]]:
    """Yield keys, their sizes, (key + fill) to fill, and people's pictures under these."""
    for number, file in enumerate(sorted(people.glob("*.npz"))):
        with np.load(file, allow_pickle=False) as known:
            images, lamps_deg = known["images"] / 255, known["lamps_deg"].astype(np.float64)
        front = np.hypot(*lamps_deg.T) <= 45
        keys = itertools.product(SIDES_DEG, HEIGHTS_DEG, SIZES_DEG.items())
        for turn, (azimuth, elevation, (size, offsets)) in enumerate(keys):
            ratio = FILLS[(turn + number) % len(FILLS)]
            across = azimuth + np.array(offsets)
            shares = lamp_shares(lamps_deg, directions(across, np.full_like(across, elevation)))
            light = shares.mean(axis=0)
            if ratio is not None:
                light = light * (ratio - 1) + front / front.sum()
            picture = np.tensordot(light, images, 1)
            picture = np.clip(0.9 * picture / np.percentile(picture, 99.5), 0, 1)
            yield (azimuth, elevation), size, ratio, picture


def _read(frame: Bytes) -> FaceLight | None:
    faces = find_faces(frame, small=False)
    return read_light(frame, faces[0], FAR_PX) if faces else None


def _apart(lamp: NDArray[np.float64], light: FaceLight | None) -> float | None:
    """Return the angle between a lamp and the reading, deg; None if there is no reading."""
    if light is None or light.azimuth_deg is None or light.elevation_deg is None:
        return None
    ways = [
        np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
        for a, e in (np.radians(lamp), np.radians([light.azimuth_deg, light.elevation_deg]))
    ]
    return math.degrees(math.acos(min(max(float(ways[0] @ ways[1]), -1.0), 1.0)))


def views(places: Path, count: int = VIEWS) -> Iterator[tuple[str, Bytes]]:
    """Yield developed views of places at random headings, pitches and lenses; always the same."""
    chance = np.random.default_rng(1)
    for file in sorted(places.glob("*.hdr")):
        radiance = read_environment(file).radiance
        level = float(np.percentile(radiance.mean(axis=2), 70))
        panorama = np.asarray(255 * tone_map(radiance, 0.3 / level), np.uint8)
        for _ in range(count):
            heading, pitch = chance.uniform(-180, 180), chance.uniform(-25, 25)
            lens = Lens(float(chance.choice([50.0, 70.0])), (640, 480))
            yield file.stem, np.asarray(look(panorama, heading, lens, pitch), np.uint8)


def nobody(places: Path, count: int = VIEWS) -> dict[str, Any]:
    """Count views in which a face is detected although there is nobody."""
    found = [(name, find_faces(view)) for name, view in views(places, count)]
    wrong = [(name, round(faces[0].confidence, 2)) for name, faces in found if faces]
    return {"views": len(found), "false_faces": len(wrong) / len(found), "where": wrong}


def main() -> None:
    """Measure all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=Path, required=True)
    parser.add_argument("--places", type=Path, required=True)
    parser.add_argument("--only", nargs="+", help="parts that are measured again; others stay")
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks/results/faces.json")
    args = parser.parse_args()
    started = time.perf_counter()
    parts: dict[str, Callable[[], dict[str, Any]]] = {
        "lamps": lambda: lamps(args.people),
        "outcomes": lambda: outcomes(args.people),
        "styles": lambda: styles(args.people),
        "ratios": lambda: ratios(args.people),
        "nobody": lambda: nobody(args.places),
        "like_photo": lambda: like_photo(args.people, args.places),
    }
    found = json.loads(args.o.read_text()) if args.only else {}
    found |= {name: part() for name, part in parts.items() if name in (args.only or parts)}
    if not args.only:
        found["seconds"] = {"all": round(time.perf_counter() - started, 1)}
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
