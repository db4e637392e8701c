"""Pictures for benchmarks/truth-in-place.md.

Rows of portraits: a style's target, the sitter at the offered turn under distant light as the
program draws her, and in the modelled place. And for the largest differences of the two objectives:
the target, and the place's pictures at either turn.

    python benchmarks/truth/place_sheets.py --work FOLDER
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.solver.transport import load_named, render, to_image
from app.core.styles.style_pack_file import load_named_pack
from app.export.canvas import SCALE, Page, shorten, wrap_text
from app.export.theme import Dark
from benchmarks.speed.plain_portrait import portrait
from benchmarks.truth.stock import ROOT, rotate
from benchmarks.truth.truth_in_place import (
    OBJECTIVES,
    ROUNDS,
    SEEDS,
    TURNS,
    light_at,
    pictures_file,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

SHOWN: Final = (
    ("probe-1", "left-rembrandt"),
    ("probe-1", "right-split"),
    ("probe-2", "right-loop"),
    ("probe-2", "butterfly"),
    ("probe-3", "left-loop"),
    ("probe-3", "right-rembrandt"),
)
PLACES: Final = {
    "probe-1": "just inside the doors",
    "probe-2": "deep in the hall",
    "probe-3": "out in the court",
}
SIDE, GAP, LABEL, TOP = 132, 12, 22, 34
Picture = NDArray[np.float32]


class Album:
    """Pictures of the sitter in the place and under distant light.

    Args:
        work: Work folder of `truth_in_place.py`.
    """

    def __init__(self, work: Path) -> None:
        self.transport, self.pack = load_named("generic"), load_named_pack("generic")
        self.coverage = self.pack.coverage.astype(np.float32)
        self._work = work

    def there(self, place: str, turn_deg: float) -> Picture:
        """Return the picture in the modelled place, (100, 100, 3)."""
        file = pictures_file(self._work, place, ROUNDS[int(place[-1]) - 1])
        first = round(turn_deg / 360 * TURNS) % TURNS * SEEDS
        seen = np.load(file, mmap_mode="r")[first : first + SEEDS].mean(axis=0)
        return to_image(self.transport, np.asarray(seen, np.float32))

    def distant(self, place: str, turn_deg: float) -> Picture:
        """Return the picture under distant light, as the program draws it."""
        turned = rotate(light_at(place), round(turn_deg / 360 * TURNS))
        return to_image(self.transport, render(self.transport, turned))

    def target(self, style: str) -> Picture:
        """Return the style's target."""
        return np.asarray(self.pack.target(style), np.float32)

    def title(self, style: str) -> str:
        """Return a style's name on screen."""
        found = next(one for one in self.pack.styles if one.name == style)
        return f"{found.title}, {found.side}" if found.side != "none" else found.title

    def column(self, parts: Sequence[Picture]) -> list[Picture]:
        """Prepare pictures for a sheet."""
        return [portrait(one, self.coverage, (SIDE * SCALE, SIDE * SCALE)) for one in parts]


def draw(columns: list[tuple[str, str, list[Picture]]], rows: Sequence[str], file: Path) -> None:
    """Write a sheet: a column of pictures for each style, with two lines of text above."""
    margin = 116
    width = margin + len(columns) * (SIDE + GAP) + GAP
    canvas = Page(width, TOP + LABEL + len(rows) * (SIDE + GAP), Dark.BG)
    for y, words in enumerate(rows):
        for line, text in enumerate(wrap_text(words, 12, margin - 2 * GAP)):
            at = (GAP, TOP + LABEL + y * (SIDE + GAP) + SIDE / 2 + 16 * line - 8)
            canvas.text(at, text, 12, 400, Dark.DIM)
    for x, (style, place, pictures) in enumerate(columns):
        left = margin + x * (SIDE + GAP)
        canvas.text((left, 22), style, 13, 600, Dark.TEXT)
        canvas.text((left, 40), shorten(place, 11, SIDE), 11, 400, Dark.DIM)
        for y, picture in enumerate(pictures):
            top = TOP + LABEL + y * (SIDE + GAP)
            canvas.picture((left, top, SIDE, SIDE), picture, 4)
    options = [cv2.IMWRITE_WEBP_QUALITY, 88]
    cv2.imwrite(str(file), np.ascontiguousarray(canvas.pixels[..., ::-1]), options)


def truth_sheet(album: Album, spots: list[dict[str, Any]], file: Path) -> None:
    """Draw targets, the program's pictures, and those in the place."""
    columns = []
    for place, style in SHOWN:
        turn = next(
            row["turn_deg"]
            for spot in spots
            for row in spot["rows"]
            if (spot["spot"], row["style"], row["objective"]) == (place, style, OBJECTIVES[0])
        )
        parts = [album.target(style), album.distant(place, turn), album.there(place, turn)]
        title = album.title(style)
        columns.append((title, PLACES[place], album.column(parts)))
    draw(columns, ("asked for", "by distant light, as shown", "in the place itself"), file)


def objective_sheet(album: Album, rows: list[dict[str, Any]], file: Path) -> None:
    """Draw the six attainable pairs in the place whose pictures differ most by SSIM."""
    first, second = OBJECTIVES
    near = [
        row for row in rows
        if row["place"] in PLACES and any(row[o]["attainable"] for o in OBJECTIVES)
    ]  # fmt: skip
    near.sort(key=lambda row: -abs(row[first]["ssim"] - row[second]["ssim"]))
    columns = []
    for row in near[:6]:
        place = row["place"]
        turns = [row[objective]["turn_deg"] for objective in OBJECTIVES]
        parts = [album.target(row["style"]), *(album.there(place, turn) for turn in turns)]
        title = album.title(row["style"])
        columns.append((title, PLACES[place], album.column(parts)))
    draw(columns, ("asked for", "the turn by match", "the turn by the paper’s objective"), file)


def main() -> None:
    """Draw both sheets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument(
        "--truth", type=Path, default=ROOT / "benchmarks" / "results" / "truth-in-place.json"
    )
    parser.add_argument(
        "--objectives", type=Path, default=ROOT / "benchmarks" / "results" / "objectives.json"
    )
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks" / "results")
    args = parser.parse_args()
    album = Album(args.work)
    spots = json.loads(args.truth.read_text(encoding="utf-8"))["spots"]
    truth_sheet(album, spots, args.o / "truth-in-place.webp")
    rows = json.loads(args.objectives.read_text(encoding="utf-8"))["rows"]
    objective_sheet(album, rows, args.o / "objectives.webp")


if __name__ == "__main__":
    main()
