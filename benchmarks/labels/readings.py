"""What blind readers saw: the majority by picture and style, and how well readers agree.

A reading names the styles that are seen, each clearly (2) or softly (1); all others are not seen
(0). The label is the median of the readings.
"""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

DEGREES: Final = {"clearly": 2, "softly": 1}
_PLAIN: Final = {"doublerim": "double-rim", "hairlight": "hair-light"}
_SIDED: Final = {"looprim": "loop-rim", "belowside": "below-side"}
_SIDES: Final = {"L": "right", "R": "left"}  # a picture's left is the sitter's right


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """Readings of all pictures.

    Attributes:
        recipe: The pictures, as chosen.
        styles: Names of the styles.
        seen: (readings, pictures, styles) int8. 2 for clearly, 1 for softly and 0 for not at all.
        again: Pairs of readings of the same picture by the same reader, (n, 2, styles).
    """

    recipe: list[dict[str, Any]]
    styles: tuple[str, ...]
    seen: NDArray[np.int8]
    again: NDArray[np.int8]

    @property
    def majority(self) -> NDArray[np.int8]:
        """The label of every picture for every style, (pictures, styles)."""
        return np.asarray(np.median(self.seen, axis=0), np.int8)

    def own(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the index of each picture and of the style that it was chosen for."""
        rows = [self.styles.index(one["style"]) for one in self.recipe]
        return np.arange(len(rows)), np.array(rows)


def style_of(label: str) -> str:
    """Return the name of a style from a reader's word.

    Examples:
        >>> style_of("looprim-L"), style_of("silhouette")
        ('right-loop-rim', 'silhouette')
    """
    name, _, side = label.partition("-")
    if not side:
        return _PLAIN.get(name, name)
    return f"{_SIDES[side]}-{_SIDED.get(name, name)}"


def load(folder: Path, styles: tuple[str, ...]) -> Labels:
    """Load the recipe, the reading order and the readings of a folder."""
    recipe = json.loads((folder / "recipe.json").read_text(encoding="utf-8"))["pictures"]
    order = json.loads((folder / "order.json").read_text(encoding="utf-8"))
    planes, again = [], []
    for path in sorted((folder / "readings").glob("*.json")):
        numbered = {int(n): words for n, words in json.loads(path.read_text("utf-8")).items()}
        plane = np.zeros((len(recipe), len(styles)), np.int8)
        first: dict[int, NDArray[np.int8]] = {}
        for number, picture in enumerate(order):
            row = np.zeros(len(styles), np.int8)
            for label, degree in numbered[number].items():
                row[styles.index(style_of(label))] = DEGREES[degree]
            if picture in first:
                again.append([first[picture], row])
            else:
                first[picture] = plane[picture] = row
        planes.append(plane)
    return Labels(recipe, styles, np.stack(planes), np.array(again, np.int8))


def agreement(labels: Labels) -> dict[str, float]:
    """Return how often one reading agrees with the two others, where these agree, by style.

    Over yes, soft and no for the style that each picture was chosen for; "all" for all styles.
    """
    pictures, rows = labels.own()
    own = labels.seen[:, pictures, rows]
    hits: dict[str, list[bool]] = defaultdict(list)
    for reader in range(len(own)):
        first, second = (own[other] for other in range(len(own)) if other != reader)
        for picture in np.flatnonzero(first == second).tolist():
            same = bool(own[reader, picture] == first[picture])
            hits["all"].append(same)
            hits[labels.styles[rows[picture]]].append(same)
    return {name: float(np.mean(each)) for name, each in sorted(hits.items())}
