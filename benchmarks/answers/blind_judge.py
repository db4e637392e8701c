"""A second opinion on the styles that a place gives, independent of the program's rules.

The judge uses only the linear picture of the head. It reads the brightness of fixed boxes, each in
stops over the same box in even light, and compares the differences with limits that follow from
photographers' textbook definitions of each style. Boxes and limits were chosen on the studio
pictures, on single lamps from all around and on pictures in places, before any answer of the
program was known. This instrument reports how often both agree; see `blind-judge.md`.

Run it from the clone's folder: ``python -m benchmarks.answers.blind_judge FOLDER ... [-o JSON]``.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import time
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import luminance
from app.core.environment.environment import read_environment
from app.core.solver.place_light import pictures_at, prepare
from app.core.solver.solve import solve_all
from app.core.solver.transport import Transport, load_named, render, to_image
from app.core.styles.style_pack_file import load_named_pack

Floats: TypeAlias = NDArray[np.floating]

ROOT: Final = Path(__file__).resolve().parents[2]
_SAME_LIGHT: Final = 0.06  # mean difference over the mean: one place in two files
_LEAST: Final = 0.5  # stops from which a share is computed
_FLOOR: Final = 1 / 256  # of the head's mean: darker values look the same in a print
_NEAR: Final = {  # rows from, to; columns from, to; on the picture's right: the sitter's left
    "half": (14, 80, 53, 70),
    "lid": (37, 40, 55, 68),
    "eye": (43, 46, 55, 60),
    "nose": (46, 55, 52, 56),
    "nose shadow": (50, 60, 57, 60),
    "patch": (47, 53, 59, 66),
    "gap": (58, 64, 61, 66),
    "cheek": (50, 62, 60, 69),
    "outer": (46, 60, 70, 74),
    "lower": (64, 73, 60, 66),
}
_MIDDLE: Final = {
    "brow": (18, 32, 42, 58),
    "line": (14, 78, 48, 52),
    "front": (18, 78, 38, 62),
    "under chin": (83, 86, 44, 56),
    "throat": (86, 93, 42, 58),
}
_OVAL: Final = (24, 74, 32, 68)
_EDGE_ROWS: Final = (10, 74)
_EDGE_WIDTH: Final = 4
_EARS: Final = (40, 60, 24)  # rows from, to, and the column where the head continues behind the ear


class Range(NamedTuple):
    """Permitted range of a relation, in stops."""

    low: float
    high: float


_EVEN_SIDES: Final = (
    "nose from -0.5 to 0.5, cheeks from -0.5 to 0.5, halves from -0.5 to 0.5, greater edge to 0.8"
)
_LOOP: Final = (
    "nose from 0.7 to 3, cheeks from 0.35 to 2.2, met to 0.55, sockets from 0.2 to 3.2, "
    "eyes to 1.5, near edge over cheek to 0.8"
)
_LIMITS: Final = {
    "butterfly": (
        f"{_EVEN_SIDES}, sockets from 0.7 to 3.5, eyes to 0.9, under chin from 1.5, "
        "throat from 0.7, frontal from 0.2"
    ),
    "badger": (
        "stripe from 0.5, halves from -1 to 1, cheeks from -1 to 1, nose from -1 to 1, "
        "lesser edge from 0.1"
    ),
    "below": (
        "sockets to -0.3, throat to -0.15, nose from -0.8 to 0.8, cheeks from -0.6 to 0.6, "
        "greater edge to 1.3"
    ),
    "flat": (
        f"{_EVEN_SIDES}, nose from -0.3 to 0.3, cheeks from -0.4 to 0.4, "
        "sockets from -0.4 to 0.8, throat from -0.5 to 1.2, forehead from -0.7 to 0.7, "
        "spread from 0 to 1.4"
    ),
    "top": (
        "sockets from 1.5, eyes from 0.7, under chin from 0.7, forehead from 0.5, "
        "cheeks from -1 to 1"
    ),
    "clamshell": (
        f"{_EVEN_SIDES}, sockets from 0.5 to 1.3, throat from 0.3 to 1.6, "
        "under chin from -0.2 to 2.1, frontal from 0.2"
    ),
    "left-loop": f"{_LOOP}, far edge over cheek to 0.9",
    "left-split": (
        "halves from 1.6, cheeks from 1.6, nose from 1.4, patches from 1.5, share from 0.62, "
        "near edge over cheek to 1.3, sockets from -1.2 to 4.5"
    ),
    "left-rim": "near edge from 1.6, near edge over cheek from 1.2, near edge over far from 0.8",
    "left-below-side": (
        "sockets to -0.3, throat to -0.15, nose from 0.8, cheeks from 0.4, "
        "near edge over cheek to 1.3"
    ),
    "left-loop-rim": (
        f"{_LOOP}, far edge from 0.25, far edge over cheek from 0.7, far edge over near from 0.2"
    ),
    "left-rembrandt": (
        "nose from 1.4, cheeks from 1.4, patches to 2.8, patch over nose shadow from 0.35, "
        "patch over outer cheek from 0.1, patch over lower cheek from 0.4, gap to -0.45, "
        "met from 0.25, sockets from 0.3, near edge over cheek to 1"
    ),
}


def _ranges(words: str) -> dict[str, Range]:
    """Parse relations with their ranges; if one is named twice, the last counts."""
    found = {}
    for part in words.split(", "):
        name, _, high = part.partition(" to ")
        name, _, low = name.partition(" from ")
        found[name] = Range(float(low or "-inf"), float(high or "inf"))
    return found


LIMITS: Final = {style: _ranges(words) for style, words in _LIMITS.items()}
"""For each style with the key lamp on the left or in the middle: relations and their ranges."""


@cache
def _even() -> tuple[Transport, Floats]:
    """Return the head for judging, and its luminance in even light, (N, N)."""
    head = load_named("generic")
    light = np.ones(head.environment_shape, np.float32)
    return head, to_image(head, render(head, light))


@cache
def _edges() -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return strips along the head's outline, (N, N) each: on the picture's left and right."""
    head, _ = _even()
    whole = to_image(head, head.coverage) > 0.9
    strip = np.zeros_like(whole)
    first, last, behind_ear = _EARS
    for row in range(*_EDGE_ROWS):
        start = behind_ear if first <= row < last else int(np.argmax(whole[row]))
        strip[row, start : start + _EDGE_WIDTH] = True
    return strip, strip[:, ::-1]


def levels(picture: Floats) -> dict[str, float]:
    """Return the brightness of every box, in stops over the same box in even light.

    The even light has the same mean.

    Args:
        picture: (N, N, 3) linear Rec. 709, or (N, N) luminance, of the generic head.

    Returns:
        Boxes of one side are named "near ..." on the picture's right and "far ..." on its left.
    """
    seen = np.maximum(luminance(picture) if picture.ndim == 3 else picture, 0.0)
    head, even = _even()
    mean = seen.ravel()[head.pixels][head.face].mean()
    usual = even.ravel()[head.pixels][head.face].mean()

    def stops(where: tuple[slice, slice] | NDArray[np.bool_]) -> float:
        value = seen[where].mean() / mean + _FLOOR
        return float(np.log2(value / (even[where].mean() / usual)))

    found = {name: stops(np.s_[a:b, c:d]) for name, (a, b, c, d) in _MIDDLE.items()}
    width = seen.shape[1]
    for name, (a, b, c, d) in _NEAR.items():
        found[f"near {name}"] = stops(np.s_[a:b, c:d])
        found[f"far {name}"] = stops(np.s_[a:b, width - d : width - c])
    found["far edge"], found["near edge"] = (stops(strip) for strip in _edges())
    a, b, c, d = _OVAL
    oval = (seen[a:b, c:d] / mean + _FLOOR) / (even[a:b, c:d] / usual)
    dark, bright = np.percentile(oval, (10, 90))
    return {**found, "spread": float(np.log2(bright / dark))}


def relations(picture: Floats) -> dict[str, float]:
    """Return the relations for `LIMITS`, in stops: differences of levels; near is on the right.

    Two are shares of another one, so that fill light hardly matters: how far the nose's shadow and
    the cheek's have merged, and how far the patch under the far eye is as dark as its cheek.
    """
    at = levels(picture)
    cheek = (at["near cheek"] + at["far cheek"]) / 2
    lesser_half = min(at["near half"], at["far half"])
    found = {
        "halves": at["near half"] - at["far half"],
        "cheeks": at["near cheek"] - at["far cheek"],
        "nose": at["near nose"] - at["far nose"],
        "patches": at["near patch"] - at["far patch"],
        "patch over nose shadow": at["far patch"] - at["far nose shadow"],
        "patch over outer cheek": at["far patch"] - at["far outer"],
        "patch over lower cheek": at["far patch"] - at["far lower"],
        "gap": at["far gap"] - at["far patch"] - at["near gap"] + at["near patch"],
        "sockets": at["brow"] - (at["near lid"] + at["far lid"]) / 2,
        "eyes": at["brow"] - (at["near eye"] + at["far eye"]) / 2,
        "under chin": cheek - at["under chin"],
        "throat": cheek - at["throat"],
        "forehead": at["brow"] - cheek,
        "frontal": cheek - (at["near outer"] + at["far outer"]) / 2,
        "near edge": at["near edge"] - at["front"],
        "near edge over cheek": at["near edge"] - at["near cheek"],
        "near edge over far": at["near edge"] - at["far edge"],
        "far edge": at["far edge"] - at["front"],
        "far edge over cheek": at["far edge"] - at["far cheek"],
        "far edge over near": at["far edge"] - at["near edge"],
        "greater edge": max(at["near edge"], at["far edge"]) - at["front"],
        "lesser edge": min(at["near edge"], at["far edge"]) - at["front"],
        "stripe": lesser_half - at["line"],
        "spread": at["spread"],
    }
    met = -found["gap"] / max(found["nose"], _LEAST)
    return {**found, "met": met, "share": found["patches"] / max(found["cheeks"], _LEAST)}


class Opinion(NamedTuple):
    """The judge's opinion of a picture and a style.

    Attributes:
        margin: Margin of the relation closest to its limit, or furthest beyond it, stops.
        broken: Relations beyond their limits, with their values.
    """

    shown: bool
    margin: float
    broken: dict[str, float]


def knows(style: str) -> bool:
    """Return whether the judge has limits for a style."""
    return style in LIMITS or f"left-{style.removeprefix('right-')}" in LIMITS


def opinion(picture: Floats, style: str) -> Opinion:
    """Judge whether a picture shows a style.

    Args:
        picture: (N, N, 3) linear Rec. 709, or (N, N) luminance, of the generic head.
    """
    mirrored = style.startswith("right-")
    found = relations(picture[:, ::-1] if mirrored else picture)
    wanted = LIMITS["left-" + style.removeprefix("right-") if mirrored else style]
    margins = {
        name: min(found[name] - low, high - found[name]) for name, (low, high) in wanted.items()
    }
    broken = {name: round(found[name], 2) for name, margin in margins.items() if margin < 0}
    return Opinion(not broken, min(margins.values()), broken)


class Answer(NamedTuple):
    """The program's answer for a place and style, and the judge's opinion of its picture."""

    place: str
    style: str
    turn_deg: float
    grade: str
    opinion: Opinion

    @property
    def agreed(self) -> bool:
        """Whether both say yes (the program possibly soft), or both say no."""
        return (self.grade != "no") == self.opinion.shown


def compare(places: Sequence[Path]) -> Iterator[Answer]:
    """Judge every picture that the program offers, skipping repeated lights."""
    pack = load_named_pack("generic")
    known = [style.name for style in pack.styles if knows(style.name)]
    head, _ = _even()
    before: list[Floats] = []
    for path in places:
        light = prepare(read_environment(path))
        seen = luminance(light.searched)
        seen = seen / seen.mean()
        if any(np.abs(seen - other).mean() < _SAME_LIGHT for other in before):
            continue
        before.append(seen)
        results = solve_all(pack, light.searched, styles=known)
        pictures = pictures_at(head, light, [result.turn_refined_deg for result in results])
        for result, picture in zip(results, pictures, strict=True):
            found = opinion(picture, result.name)
            turn = round(result.turn_refined_deg, 1)
            yield Answer(
                f"{path.parent.name}/{path.stem}", result.name, turn, str(result.grade), found
            )


def panoramas(folders: Sequence[Path]) -> list[Path]:
    """Return the OpenEXR and Radiance files in folders, in order."""
    return [
        path
        for folder in folders
        for path in sorted(folder.iterdir())
        if path.suffix in {".hdr", ".exr"}
    ]


def summary(answers: Sequence[Answer]) -> dict[str, Any]:
    """Summarise the agreement, overall and by style, and the disagreements."""

    def part(some: Sequence[Answer]) -> dict[str, float]:
        return {
            "pairs": len(some),
            "agree_percent": round(100 * sum(a.agreed for a in some) / max(len(some), 1), 1),
            "offered": sum(each.grade != "no" for each in some),
            "shown": sum(each.opinion.shown for each in some),
            "only_program": sum(each.grade != "no" and not each.agreed for each in some),
            "only_judge": sum(each.grade == "no" and not each.agreed for each in some),
        }

    names = dict.fromkeys(each.style for each in answers)
    return {
        "places": sorted({each.place for each in answers}),
        **part(answers),
        "by_grade": {
            grade: part([a for a in answers if a.grade == grade]) for grade in ("yes", "soft", "no")
        },
        "by_style": {name: part([a for a in answers if a.style == name]) for name in names},
        "disagreements": [
            {
                "place": each.place,
                "style": each.style,
                "turn_deg": each.turn_deg,
                "program": each.grade,
                "margin": round(each.opinion.margin, 2),
                "broken": each.opinion.broken,
            }
            for each in answers
            if not each.agreed
        ],
    }


def main() -> None:
    """Compare, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    shared = Path(os.environ.get("TURNLIGHT_SHARED", ROOT.parent / "shared" / "data"))
    parser.add_argument("folders", type=Path, nargs="*", help="more panoramas")
    parser.add_argument("-o", type=Path)
    args = parser.parse_args()
    folders = [ROOT / "resources" / "demo" / "scenes", shared / "hdri", *args.folders]
    started = time.monotonic()
    answers = list(compare(panoramas([folder for folder in folders if folder.is_dir()])))
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True
    ).stdout.strip()
    seconds = round(time.monotonic() - started, 1)
    facts = {"commit": commit, "seconds": seconds, **summary(answers)}
    if args.o and args.o.exists():  # judgements by eye are kept: nobody can repeat them
        facts["by_eye"] = json.loads(args.o.read_text(encoding="utf-8")).get("by_eye", [])
    print(json.dumps(facts, indent=1))
    if args.o:
        args.o.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
