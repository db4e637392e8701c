"""Measure the heading on views cut from real panoramas of one place, taken some way apart.

    python -m benchmarks.heading.real_views [FOLDER ...] [-o FILE.json] [--page heading.md]

Each folder holds panoramas and `pairs.json`, which gives the rotation between two of them and the
direction from one to the other. A view of 64 degrees is cut from one panorama and searched for in
the other: looking towards the other's place (as a camera that looks at a sitter who stands there),
away from it, or aside, with the axis up to 12 degrees beside. The sitter is a person's outline,
painted in at 1.7 m. The truth is where the axis points in the other panorama.

"After a pan" is the answer of the live tracker for the last view of a pan of 12 to 24 degrees.
"""

from __future__ import annotations

import argparse
import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.angles import difference
from app.core.base.atomic_files import atomic_write_text
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading import find_heading
from app.core.localization.heading_conversion import ASSUMED_DEG
from app.core.localization.live.tracking import LOST, Seeing, track
from app.core.localization.photo_location import search_photo
from app.core.localization.picture_file import PictureFile, read_picture
from app.core.localization.sitter import Sitter, background_mask
from app.core.localization.views import Lens, look

Bytes: TypeAlias = NDArray[np.uint8]
Floats: TypeAlias = NDArray[np.float64]
Looks: TypeAlias = Literal["toward", "away", "aside"]

SHARED: Final = Path(__file__).resolve().parents[3] / "shared" / "data" / "heading"
LENS: Final = Lens(64.0, (640, 480))
AIMS_DEG: Final = (-12.0, -8.0, -4.0, -1.0, 0.0, 2.0, 5.0, 9.0, 12.0)
PITCHES_DEG: Final = (0.0, 3.0, -4.0)
RIGHT_DEG: Final = 5.0
MARKS: Final = ("<!-- table: real_views.py -->", "<!-- end of real_views.py -->")
_HEAD_M: Final = (0.16, 0.24)  # width and height of the sitter's head
_AWAY_M: Final = 1.7
_WIDE: Final = 2048  # columns of a panorama in the program
_FRAME_S: Final = 0.3
_PANS: Final = (
    ("toward, sitter found", "toward", True, LENS.fov_deg),
    ("toward, sitter found, lens unknown", "toward", True, None),
    ("toward, sitter not found", "toward", False, LENS.fov_deg),
    ("away, `away` asked for", "away", False, LENS.fov_deg),
    ("away, `away`, lens unknown", "away", False, None),
    ("aside, `away` asked for", "aside", False, LENS.fov_deg),
)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A view of a place, and the truth about it.

    Attributes:
        other_deg: Angle of the other panorama's place from the axis, in degrees, to the right.
        other_up_deg: The same upwards.
        heading_deg: Azimuth of the axis in the other panorama.
        lens: Lens of the view.
    """

    picture: Bytes
    panorama: Path
    looks: Looks
    other_deg: float
    other_up_deg: float
    heading_deg: float
    lens: Lens = LENS


def views(folder: Path, lens: Lens = LENS) -> Iterator[View]:
    """Yield all views of a folder's panoramas, each pair in both directions."""
    for pair in json.loads((folder / "pairs.json").read_text(encoding="utf-8")):
        turn = np.array(pair["rotation_view_to_panorama"], np.float64)
        step = np.array(pair["direction_of_view_point_from_panorama"], np.float64)
        one, other = folder / pair["panorama"], folder / pair["view_from"]
        yield from _views(other, one, turn, -turn.T @ step, lens)
        yield from _views(one, other, turn.T, step, lens)


def _views(
    source: Path, panorama: Path, turn: Floats, towards: Floats, lens: Lens
) -> Iterator[View]:
    """Yield the views from `source`, where `towards` is the direction of the other panorama."""
    azimuth, elevation = (math.degrees(angle) for angle in _angles(towards))
    for looks, base in (("toward", azimuth), ("away", azimuth + 180.0), ("aside", azimuth + 90.0)):
        for number, aim in enumerate(AIMS_DEG):
            pitch = PITCHES_DEG[number % len(PITCHES_DEG)]
            axis = base + aim + (180.0 if looks == "aside" and number % 2 else 0.0)
            heading, _ = _angles(turn @ sphere.direction(axis, pitch))
            yield View(
                look(_panorama(source), axis, lens, pitch),
                panorama,
                looks,  # type: ignore[arg-type]
                difference(azimuth, axis),
                elevation - pitch,
                math.degrees(heading),
                lens,
            )


def _angles(vector: Floats) -> tuple[float, float]:
    x, y, z = vector / np.linalg.norm(vector)
    return math.atan2(-x, z), math.asin(y)


@lru_cache(maxsize=2)
def _panorama(path: Path) -> Bytes:
    return read_picture(path, 2 * _WIDE).picture


@lru_cache(maxsize=16)
def index_of(path: Path) -> HeadingIndex:
    """Return the index of a panorama at the program's size."""
    size = (_WIDE, _WIDE // 2)
    smaller = cv2.resize(_panorama(path), size, interpolation=cv2.INTER_AREA)
    return build_index(np.asarray(smaller, np.uint8))


def sitter_in(view: View) -> Sitter:
    """Return the sitter who stands at the place of the other panorama."""
    columns, rows = view.lens.size
    wide, tall = (view.lens.focal_px * size / _AWAY_M for size in _HEAD_M)
    x = columns / 2.0 + view.lens.focal_px * math.tan(math.radians(view.other_deg))
    y = rows / 2.0 - view.lens.focal_px * math.tan(math.radians(view.other_up_deg))
    box = (x - wide / 2.0, y - tall / 2.0, x + wide / 2.0, y + tall / 2.0)
    left, top, right, bottom = np.divide(box, (columns, rows, columns, rows)).tolist()
    return Sitter(x / columns, view.other_deg, (left, top, right, bottom))


def with_sitter(view: View, chance: np.random.Generator) -> tuple[Bytes, NDArray[np.bool_]]:
    """Return the view with the sitter painted in, and the mask of the background."""
    rows, columns = view.picture.shape[:2]
    background = background_mask(sitter_in(view), (rows, columns))
    patches = chance.normal(0.0, 22.0, (rows // 24, columns // 24, 3)).astype(np.float32)
    size = (columns, rows)
    cloth = np.array([70.0, 75.0, 95.0]) + cv2.resize(patches, size, interpolation=cv2.INTER_CUBIC)
    painted = np.where(background[..., None], view.picture, np.clip(cloth, 0.0, 255.0))
    return painted.astype(np.uint8), background


def answers(view: View, chance: np.random.Generator) -> Iterator[tuple[str, float | None]]:
    """Yield the headings found, by the kind of question."""
    index, fov = index_of(view.panorama), LENS.fov_deg
    if view.looks != "toward":
        for name, width in (
            (f"{view.looks}, `away` asked for", fov),
            (f"{view.looks}, `away`, lens unknown", None),
        ):
            found = find_heading(view.picture, index, width, sitter_deg=None, away=True)
            yield name, found.heading_deg
        if view.looks == "aside":
            found = find_heading(view.picture, index, fov, sitter_deg=None)
            yield "aside", found.heading_deg
        return
    picture, mask = with_sitter(view, chance)
    seen = view.other_deg + chance.normal(0.0, 0.7)
    usual = math.tan(math.radians(ASSUMED_DEG / 2.0)) / math.tan(math.radians(fov / 2.0))
    assumed = math.degrees(math.atan(usual * math.tan(math.radians(seen))))
    for name, width, angle, hidden in (
        ("toward, sitter found", fov, seen, mask),
        ("toward, sitter found, lens unknown", None, assumed, mask),
        ("toward, sitter not found", fov, None, None),
    ):
        found = find_heading(picture, index, width, sitter_deg=angle, mask=hidden)
        yield name, found.heading_deg
    photo = PictureFile(view.picture, LENS.size)
    yield (
        "toward, photo without a person (`locate`)",
        search_photo(photo, index, fov).heading.heading_deg,
    )


def pan_answers(
    folder: Path, chance: np.random.Generator
) -> Iterator[tuple[str, View, float | None]]:
    """Yield the tracker's headings for the second half of each pan, by the kind of question."""
    every = list(views(folder))
    for name, looks, with_person, fov in _PANS:
        rows = [view for view in every if view.looks == looks]
        for first in range(0, len(rows), len(AIMS_DEG)):
            pan = rows[first : first + len(AIMS_DEG)]
            for views_in_turn in _in_turn(pan):
                headings = _tracked(views_in_turn, fov, with_person, chance)
                half = len(views_in_turn) // 2
                for view, heading in list(zip(views_in_turn, headings, strict=True))[half:]:
                    yield f"{name}, after a pan", view, heading


def _in_turn(pan: list[View]) -> tuple[list[View], list[View]]:
    """Return a pan to the right and one to the left. Views aside alternate between two sides."""
    if pan[0].looks == "aside":
        return pan[::2], pan[1::2]
    return pan, pan[::-1]


def _tracked(
    pan: list[View], fov: float | None, with_person: bool, chance: np.random.Generator
) -> list[float | None]:
    index, state, headings = index_of(pan[0].panorama), LOST, []
    for number, view in enumerate(pan):
        picture = view.picture
        if view.looks == "toward":
            picture, _ = with_sitter(view, chance)
        sitter = sitter_in(view) if with_person else None
        seeing = Seeing(sitter=lambda *_, person=sitter: person)
        away = view.looks != "toward"
        state = track(
            picture, index, fov, state, number * _FRAME_S, sees_sitter=not away, seeing=seeing
        )
        headings.append(state.heading_deg)
    return headings


def measured(folders: list[Path]) -> dict[str, Any]:
    """Return the rows of the table, by the kind of question."""
    chance = np.random.default_rng(5)
    errors: dict[str, list[float | None]] = defaultdict(list)
    for folder in folders:
        for view in views(folder):
            for name, heading in answers(view, chance):
                off = None if heading is None else abs(difference(heading, view.heading_deg))
                errors[name].append(off)
        for name, view, heading in pan_answers(folder, chance):
            off = None if heading is None else abs(difference(heading, view.heading_deg))
            errors[name].append(off)
    return {name: result_row(each) for name, each in errors.items()}


def result_row(errors: list[float | None]) -> dict[str, Any]:
    """Return a row of a table: headings that are right and wrong, and their errors."""
    accepted = [error for error in errors if error is not None]
    right = [error for error in accepted if error <= RIGHT_DEG]
    return {
        "views": len(errors),
        "right": len(right),
        "wrong": len(accepted) - len(right),
        "median_deg": round(float(np.median(right)), 2) if right else None,
        "p95_deg": round(float(np.percentile(right, 95)), 2) if right else None,
    }


def table_of(title: str, rows: dict[str, Any]) -> str:
    """Return a table of benchmarks/heading.md, with the title of its first column."""
    lines = [
        f"| {title} | views | right | wrong | median | 95 % |",
        "|---|---|---|---|---|---|",
    ]
    for name, row in rows.items():
        angles = [
            f"{row[key]:.2f}°" if row[key] is not None else "" for key in ("median_deg", "p95_deg")
        ]
        numbers = (str(row["views"]), str(row["right"]), str(row["wrong"]), *angles)
        lines.append(f"| {name} | " + " | ".join(numbers) + " |")
    return "\n".join(lines)


def run(
    measure: Callable[[list[Path]], dict[str, Any]], title: str, marks: tuple[str, str], words: str
) -> None:
    """Measure the folders of the command line, print the table, and write it where asked."""
    parser = argparse.ArgumentParser(description=words)
    parser.add_argument("folders", type=Path, nargs="*", default=[SHARED])
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--page", type=Path, help="benchmarks/heading.md, to replace its table")
    args = parser.parse_args()
    rows = measure(args.folders)
    table = table_of(title, rows)
    print(table)
    if args.output:
        atomic_write_text(args.output, json.dumps(rows, indent=1) + "\n")
    if args.page:
        before, rest = args.page.read_text(encoding="utf-8").split(marks[0])
        after = rest.split(marks[1])[1]
        atomic_write_text(args.page, f"{before}{marks[0]}\n{table}\n{marks[1]}{after}")


if __name__ == "__main__":
    run(measured, "the camera looks", MARKS, __doc__.splitlines()[0])
