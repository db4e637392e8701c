"""Shapes sorted by material, collected by the modules that furnish the place."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from scenes.demo_location.mesh import Geo, box

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Place", "Span"]

Span = tuple[float, float]


@dataclass(slots=True)
class Place:
    """Shapes by material, in building coordinates.

    Attributes:
        rng: Source of all randomness, so that every build is the same.
    """

    rng: np.random.Generator
    parts: dict[str, list[Geo]] = field(default_factory=lambda: defaultdict(list))

    def add(self, material: str, *shapes: Geo, shuffle: bool = False) -> None:
        """Add shapes; with `shuffle`, each has a different part of the texture."""
        for shape in shapes:
            made = shape.mapped(self.rng.uniform(0, 7, 2)) if shuffle else shape
            self.parts[material].append(made)

    def block(
        self,
        material: str,
        x: Span,
        y: Span,
        z: Span,
        bevel: float = 0.006,
        grain: str | None = None,
    ) -> None:
        """Add a bevelled block."""
        self.add(material, box(x, y, z, bevel, grain), shuffle=True)

    def placed(self, other: Place, turn: float, at: ArrayLike) -> None:
        """Add the contents of another place, rotated about y and shifted."""
        x, y, z = (float(v) for v in np.asarray(at, float))
        for material, shapes in other.parts.items():
            for shape in shapes:
                self.parts[material].append(shape.turned(turn).moved(x, y, z))

    def fresh(self) -> Place:
        """Return an empty place with the same randomness, for a group that is placed as a whole."""
        return Place(self.rng)
