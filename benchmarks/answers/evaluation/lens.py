"""Gain of each style if the lens may be beside the nose."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.solver.lens.lens_search import NAMED_GAIN, solve_lens
from app.core.solver.lens.lens_wish import LensWish

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.colour import FloatImage
    from app.core.solver.lens.view_tables import ViewTables
    from app.core.styles.style_pack import StylePack

Float64: TypeAlias = NDArray[np.float64]
Bools: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class LensGains:
    """Answers straight in front compared with the best of all yaws, by the picture objective.

    Attributes:
        straight, free: (P, S) float64. Match for P scenes and S styles.
        reached, reached_free: (P, S) bool. Whether the style is in reach.
        yaw_deg: (P, S) float64. Best yaw, deg.
    """

    straight: Float64 = field(repr=False)
    free: Float64 = field(repr=False)
    reached: Bools = field(repr=False)
    reached_free: Bools = field(repr=False)
    yaw_deg: Float64 = field(repr=False)

    @property
    def named(self) -> Bools:
        """Pairs in reach with a gain large enough for the app to mention, (P, S)."""
        return np.asarray(self.reached & (self.free >= self.straight + NAMED_GAIN))

    def of(self, style: int | None = None) -> tuple[int, int, float, float, int]:
        """Return pairs in reach, those at any yaw, mean match both ways, and mentioned gains."""
        at = slice(None) if style is None else slice(style, style + 1)
        both = (self.reached & self.reached_free)[:, at]
        means = [
            float(match[:, at][both].mean()) if both.any() else float("nan")
            for match in (self.straight, self.free)
        ]
        counts = [int(each[:, at].sum()) for each in (self.reached, self.reached_free, self.named)]
        return counts[0], counts[1], means[0], means[1], counts[2]


def lens_gains(
    pack: StylePack,
    views: Sequence[ViewTables],
    lights: Sequence[FloatImage],
    styles: Sequence[str],
) -> LensGains:
    """Solve all scenes with the lens straight in front and anywhere.

    Args:
        lights: (H, W, 3) each. In the pack's size.
    """
    straight, free = (
        [solve_lens(pack, views, light, wish, styles=styles) for light in lights]
        for wish in (LensWish(), LensWish("auto"))
    )
    matches = [np.array([[one.match for one in row] for row in each]) for each in (straight, free)]
    reached = [
        np.array([[one.attainable for one in row] for row in each]) for each in (straight, free)
    ]
    yaws = np.array([[one.yaw_deg for one in row] for row in free])
    return LensGains(matches[0], matches[1], reached[0], reached[1], yaws)
