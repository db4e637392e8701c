"""Draw the pictures of a recipe as numbered sheets for blind readers, as the program shows them.

python -m benchmarks.labels.draw RECIPE.json PLACE ... -o FOLDER
"""

from __future__ import annotations

import argparse
import json
import random
from collections import defaultdict
from functools import lru_cache
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.environment.environment import read_environment
from app.core.portrait.head import Head, load_head
from app.core.portrait.portrait_file import HAIRS
from app.core.solver.place_light import Facing, pictures_at, prepare

SIZE: Final = (300, 240)
ACROSS: Final = 4
DOWN: Final = 4
_AGAIN: Final = 0.05
_GAP: Final = 4


@lru_cache(maxsize=3)
def _head(name: str) -> Head:
    return load_head(name, HAIRS[0], in_place=True)


def draw(recipe: dict[str, list[dict[str, object]]], places: list[Path]) -> list[Bytes]:
    """Draw every picture, exposed for its style, (300, 240, 3) uint8 sRGB."""
    files = {path.stem: path for path in places}
    by_place: dict[tuple[str, str], list[int]] = defaultdict(list)
    for index, one in enumerate(recipe["pictures"]):
        by_place[str(one["place"]), str(one["head"])].append(index)
    pictures: dict[int, Bytes] = {}
    for (place, name), indices in by_place.items():
        head, light = _head(name), prepare(read_environment(files[place]))
        for index in indices:
            one = recipe["pictures"][index]
            turn = float(str(one["turn_deg"]))
            here = Facing(light, turn, head.expose_of(str(one["style"])))
            linear = pictures_at(head.transport, light, [turn])
            pictures[index] = head.portraits(linear, SIZE, [here])[0]
        print(place, len(pictures), flush=True)
    return [pictures[index] for index in range(len(pictures))]


def sheets(pictures: list[Bytes], numbers: list[int]) -> list[Bytes]:
    """Lay out pictures with their positions in the reading order."""
    pages = []
    for first in range(0, len(numbers), ACROSS * DOWN):
        rows = []
        for start in range(first, min(first + ACROSS * DOWN, len(numbers)), ACROSS):
            cells = []
            for place in range(start, start + ACROSS):
                cell = np.full_like(pictures[0], 128)
                if place < len(numbers):
                    cell = pictures[numbers[place]].copy()
                    _write(cell, str(place))
                cells.append(np.pad(cell, ((_GAP,) * 2, (_GAP,) * 2, (0, 0)), constant_values=128))
            rows.append(np.hstack(cells))
        pages.append(np.vstack(rows))
    return pages


def _write(cell: Bytes, words: str) -> None:
    for colour, wide in (((0, 0, 0), 4), ((255, 255, 0), 1)):
        cv2.putText(cell, words, (6, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.6, colour, wide)


def main() -> None:
    """Draw the sheets, and write which picture has which number."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()
    recipe = json.loads(args.recipe.read_text(encoding="utf-8"))
    pictures = draw(recipe, args.places)
    args.output.mkdir(parents=True, exist_ok=True)
    numbers = list(range(len(pictures)))
    chance = random.Random(recipe["seed"])
    numbers += chance.sample(numbers, round(_AGAIN * len(numbers)))  # read twice
    chance.shuffle(numbers)
    for number, page in enumerate(sheets(pictures, numbers)):
        path = args.output / f"sheet-{number:03d}.png"
        cv2.imwrite(str(path), cv2.cvtColor(page, cv2.COLOR_RGB2BGR))
    (args.output.parent / "order.json").write_text(json.dumps(numbers), encoding="utf-8")


if __name__ == "__main__":
    main()
