"""Draw pairs for blind readers: a style as a place gives it, beside the same head in even light.

    python -m benchmarks.labels.even PLACE ... -o FOLDER

Each cell has two pictures, in random order and before the same grey. A reader names the evenly lit
one, or says that they cannot tell. `answers.json` in the folder's parent holds the truth. Styles
that need the background of a place (hair light, silhouette) and flat itself are left out.
"""

from __future__ import annotations

import argparse
import json
import random
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.environment.environment import read_environment
from app.core.places.offers import offers
from app.core.portrait.head import Head, load_head
from app.core.portrait.portrait_file import HAIRS
from app.core.solver.place_light import Facing, pictures_at, prepare
from app.core.solver.solve import solve_all
from benchmarks.labels.choose import distinct_places
from benchmarks.labels.draw import SIZE, sheets

HEADS: Final = ("generic", "female", "generic-dark")
PAIRS: Final = 200
_LEFT_OUT: Final = frozenset({"flat", "hair-light", "silhouette"})


def candidates(path: Path, name: str, head: Head) -> list[dict[str, Any]]:
    """List the styles that a place gives, on the better side."""
    light = prepare(read_environment(path))
    results = {one.name: one for one in solve_all(head.pack, light.searched)}
    names = [one.name for one in offers(tuple(results.values()), lambda one: one.attainable)]
    return [
        {
            "style": style,
            "place": path.stem,
            "head": name,
            "turn_deg": round(results[style].turn_refined_deg, 3),
            "grade": results[style].grade,
        }
        for style in names
        if results[style].attainable and style not in _LEFT_OUT
    ]


def pair(path: Path, head: Head, style: str, turn_deg: float) -> tuple[Bytes, Bytes]:
    """Draw the head in the place's light, and in its mean light from all around."""
    environment = read_environment(path)
    mean = environment.radiance.mean(axis=(0, 1), keepdims=True)
    even = replace(environment, radiance=np.broadcast_to(mean, environment.radiance.shape).copy())
    pictures = []
    for light in (prepare(environment), prepare(even)):
        here = Facing(light, turn_deg, head.expose_of(style))
        linear = pictures_at(head.transport, light, [turn_deg])
        pictures.append(head.portraits(linear, SIZE, [here])[0])
    return pictures[0], pictures[1]


def main() -> None:
    """Draw the sheets, and write which picture of a pair is the even one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()
    chance = random.Random(2026)
    heads = {name: load_head(name, HAIRS[0], in_place=False) for name in HEADS}
    paths = {path.stem: path for path in distinct_places(args.places)}
    every = [
        one
        for path in paths.values()
        for name, head in heads.items()
        for one in candidates(path, name, head)
    ]
    chosen = chance.sample(every, min(PAIRS, len(every)))
    cells = []
    for one in chosen:
        head, path = heads[one["head"]], paths[one["place"]]
        two = list(pair(path, head, one["style"], one["turn_deg"]))
        one["even"] = chance.choice("AB")
        if one["even"] == "A":
            two.reverse()
        cells.append(np.hstack(two))
    args.output.mkdir(parents=True, exist_ok=True)
    for number, page in enumerate(sheets(cells, list(range(len(cells))))):
        path = args.output / f"sheet-{number:03d}.png"
        cv2.imwrite(str(path), cv2.cvtColor(page, cv2.COLOR_RGB2BGR))
    answers = args.output.parent / "answers.json"
    answers.write_text(json.dumps(chosen, indent=0), encoding="utf-8")


if __name__ == "__main__":
    main()
