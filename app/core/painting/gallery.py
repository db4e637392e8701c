"""Painted styles beside the built-in ones: their target pictures, their side, their answers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.painting.canvas import make_canvas, weights_of
from app.core.solver.reach import LIMITS, Limits
from app.core.solver.relighting_cache import light_table
from app.core.solver.solve import solve_on_table
from app.core.solver.transport import render, to_image

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Float32, Floats
    from app.core.painting.canvas import Canvas
    from app.core.painting.user_style import UserStyle
    from app.core.solver.reach import Objective
    from app.core.solver.relighting_cache import LightTable
    from app.core.solver.solve import StyleResult
    from app.core.solver.styles import Side, Style
    from app.core.solver.transport import Transport
    from app.core.solver.weights import PaintedWeights


_SIDE_DEG: Final = 20.0  # nearer to the front or the back than this, light has no side
_HIGH_DEG: Final = 25.0
_STEEP_DEG: Final = 70.0
_BESIDE: Final = 0.7  # mean sine of the angle to the middle plane of light at both sides
_EVENLY: Final = 0.2
_ALIKE: Final = 0.5  # correlation with what painting started from
_GATHERED: Final = 0.15  # share of the light that its centre must keep to have a direction


@dataclass(frozen=True, slots=True, eq=False)
class Asking:
    """What a user's style asks of a head."""

    style: UserStyle
    weights: PaintedWeights = field(repr=False)  # on the head's pixels
    target: Float32 = field(repr=False)  # (N, N, 3), see `target_picture`


def prepare_user_style(transport: Transport, style: UserStyle) -> Asking:
    """Work out what a user's style asks of a head; it holds for every place."""
    weights = weights_of(make_canvas(style.weights, style.ignore), transport)
    return Asking(style, weights, target_picture(transport, weights))


def target_picture(transport: Transport, weights: PaintedWeights) -> Float32:
    """Picture of the head under the light that painted weights ask for.

    Returns (N, N, 3) float32: under the environment max(F, 0), linear Rec. 709 on black, largest
    value 1; all black when nothing is asked for.
    """
    glow = np.maximum(weights.preintegrated(transport), 0.0)
    lit = np.maximum(render(transport, np.repeat(glow[..., None], 3, axis=2)), 0.0)
    picture = to_image(transport, lit)
    return picture / np.float32(max(float(picture.max()), 1e-30))


def light_side(transport: Transport, weights: PaintedWeights) -> tuple[Side, str]:
    """Tell from which side the light that painted weights ask for comes.

    Returns the sitter's own side of the centre of max(F, 0), and in words where the centre is when
    it is on neither side.
    """
    glow = np.maximum(weights.preintegrated(transport).astype(np.float64), 0.0)
    height, width = glow.shape
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    energy = glow * np.cos(elevation)
    energy /= max(float(energy.sum()), 1e-30)
    level = energy * np.cos(elevation)
    # Azimuth grows clockwise, toward the right of a sitter who faces its 0.
    left = -float((level * np.sin(azimuth)).sum())
    front = float((level * np.cos(azimuth)).sum())
    up = float((energy * np.sin(elevation)).sum())
    across = float(np.hypot(left, front))
    if float((level * np.abs(np.sin(azimuth))).sum()) > _BESIDE and abs(left) < _EVENLY:
        return "none", "from both sides"
    if float(np.hypot(across, up)) <= _GATHERED:
        return "none", "from several sides"
    toward = float(np.degrees(np.arctan2(abs(left), front)))
    height_deg = float(np.degrees(np.arctan2(up, across)))
    if abs(height_deg) < _STEEP_DEG and _SIDE_DEG < toward < 180 - _SIDE_DEG:
        return ("left" if left > 0 else "right"), ""
    return "none", _place(front, height_deg)


def suggested_side(
    canvas: Canvas, transport: Transport, weights: PaintedWeights, origin: Style | None = None
) -> tuple[Side, str]:
    """Suggest a side for a painted style: that of the style it still resembles, or its light's."""
    if origin is not None:
        start = weights_of(make_canvas(canvas.start_weights), transport)
        one, other = weights.weights, start.weights
        alike = float(one @ other) > _ALIKE * float(np.linalg.norm(one) * np.linalg.norm(other))
        if alike:
            return origin.side, origin.place
    return light_side(transport, weights)


def solve_user_styles(
    transport: Transport,
    styles: Sequence[UserStyle | Asking],
    light: Floats,
    objective: Objective = "picture",
    *,
    limits: Limits = LIMITS,
    front_deg: float = 0.0,
    table: LightTable | None = None,
) -> tuple[StyleResult, ...]:
    """Find the best turn of every painted style in a place.

    `light`: (H, W, 3) or (H, W) float, environment at turn 0 in the transport's size, linear Rec.
    709 radiance, or luminance of light that counts as grey; any exposure.
    Results are in the order of `styles`.
    """
    if not styles:
        return ()
    prepared = light_table(transport, light) if table is None else table
    results = []
    for entry in styles:
        style = entry.style if isinstance(entry, Asking) else entry
        weights = (
            entry.weights
            if isinstance(entry, Asking)
            else weights_of(make_canvas(style.weights, style.ignore), transport)
        )
        found = solve_on_table(prepared, weights, objective, limits=limits)
        named = replace(found, name=style.name, title=style.title, side=style.side)
        results.append(named.seen_from(front_deg) if front_deg else named)
    return tuple(results)


def _place(front: float, elevation_deg: float) -> str:
    if elevation_deg >= _STEEP_DEG:
        return "from overhead"
    if elevation_deg <= -_STEEP_DEG:
        return "from beneath"
    if front < 0:
        return "from behind"
    if elevation_deg > _HIGH_DEG:
        return "in front, from above"
    return "in front, from beneath" if elevation_deg < -_HIGH_DEG else "in front, at eye level"
