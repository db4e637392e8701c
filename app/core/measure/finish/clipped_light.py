"""Estimate the clipped light in a single photo and find the answers that depend on it.

A single panorama in the camera's own exposure loses between a tenth and nine tenths of the light.
Areas that are white in all channels count as four stops brighter, and areas that are clipped in
only some channels count as one stop brighter. Twenty rules were tried on 35 places: constant gains
of 2 to 32, gains by size or by depth, lamps, and combinations of these. None yielded turns that
lose less, and this rule is the simplest.

Four alternatives show which turns depend on this estimate. In the first, clipped light is no
brighter than it looks. In the second, it is another two stops brighter. In the third, it is
brightest in the middle of each white area, like the glow around the sun. In the fourth, only one of
the largest white areas, each in turn, is no brighter than it looks. A style's doubt is the mean
fraction of its match range that its turn loses under the four alternatives, plus a term for a poor
best match. The weight and the limit were chosen so that nine tenths of the turns that lose more
than a tenth are in doubt (`benchmarks/light/plain_panorama.py`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import turn_of_index
from app.core.base.arrays import Float32, Float64
from app.core.base.colour import largest_channel, smallest_channel
from app.core.base.errors import ProbeError
from app.core.base.phrases import percent
from app.core.environment.environment import energy, reduce_light, solid_angles
from app.core.measure.finish.clip_audit import Audit, StyleChange, WhatIf, choices, given_up
from app.core.measure.finish.findings import advise
from app.core.measure.finish.lamp_detection import Light, LightGrid, components, light_grid
from app.core.measure.finish.remarks import RoughLight, RoughTurns
from app.core.measure.read.frame import MergedLight
from app.core.solver.turn_choice import Choice
from app.core.styles.style_pack import StylePack
from app.core.text import tr

STOPS: Final = 4.0
"""Number of stops by which white areas are assumed to be brighter than they look."""

DOUBT: Final = 0.036
"""Doubt value above which a style's turn is in doubt."""

_COLOURED_STOPS: Final = 1.0
_BRIGHTER_STOPS: Final = 2.0  # stops by which the brighter alternative exceeds the estimate
_UNSURE: Final = 0.11  # doubt added for a picture that does not match at all
_CLIPPED: Final = 0.947  # linear light of code 249, since JPEG changes 255 by several codes
_WHITE: Final = 0.83  # minimum of the smallest channel in white, relative to the largest
_WHOLE: Final = 3  # number of alternatives for all clipped light at once
_AREAS: Final = 8
_LEAST_SR: Final = 5e-5
_COLUMNS: Final = 512
_GLOW: Final = (2.0, 2.0)  # factor at an area's edge, and power of 1 + depth in degrees
_MOST_CLIPPED: Final = 0.9  # maximum clipped fraction of the sphere
_LEAST_LIGHT: Final = 0.004  # fraction of the frame's saturation, as in code 13


def told_clipped(merged: MergedLight, name: str) -> MergedLight:
    """Mark the clipped texels in a single encoded frame.

    Raises:
        ProbeError: If the frame is entirely clipped or black.
    """
    largest = largest_channel(merged.radiance) / np.float32(merged.clip_level)
    if float(largest.max()) < _LEAST_LIGHT:
        raise ProbeError(
            tr("{name} is completely black.", name=name),
            tr("Remove the lens cover, or expose longer."),
        )
    clipped = np.maximum(merged.clipped, (largest >= _CLIPPED).astype(np.float32))
    share = float(energy(clipped)) / (4.0 * math.pi)
    if share > _MOST_CLIPPED:
        raise ProbeError(
            tr("{name} is overexposed: {share} of it is white.", name=name, share=percent(share)),
            tr("Take it again with a shorter exposure."),
        )
    return replace(merged, clipped=clipped)


def brightened(merged: MergedLight, stops: float = STOPS) -> MergedLight:
    """Brighten clipped light to its most likely value."""
    white, coloured = _shares(merged.radiance, merged.clipped)
    gain = _gain(white, coloured, stops, _COLOURED_STOPS)
    return replace(merged, radiance=merged.radiance * gain)


def dimmed(merged: MergedLight) -> MergedLight:
    """Return the light as it was before `brightened` was applied."""
    white, coloured = _shares(merged.radiance, merged.clipped)
    gain = _gain(white, coloured, STOPS, _COLOURED_STOPS)
    return replace(merged, radiance=merged.radiance / gain)


def _gain(white: Float32, coloured: Float32, stops: float, coloured_stops: float) -> Float32:
    """Return the factor, (H, W, 1), by which each texel is assumed to be brighter than it looks."""
    gain = 1.0 + (2.0**stops - 1.0) * white + (2.0**coloured_stops - 1.0) * coloured
    return np.asarray(gain[..., None], np.float32)


def _shares(radiance: Float32, clipped: Float32) -> tuple[Float32, Float32]:
    """Return each texel's white fraction and its fraction clipped in some channels, (H, W) each."""
    is_white = smallest_channel(radiance) >= _WHITE * largest_channel(radiance)
    white = clipped * is_white
    return white, clipped - white


def rough_audit(
    looks: MergedLight,
    likely: MergedLight,
    lights: Sequence[Light],
    grid: LightGrid,
    pack: StylePack,
) -> Audit:
    """Return the answers that depend on clipping in a single photo.

    Args:
        looks: The light as it looks, before `brightened` is applied.
        likely: The light after `brightened` has been applied.
        grid: The light grid of `likely`.
    """
    shape = pack.header.environment
    choice = choices(pack, [reduce_light(each, shape) for each in guesses(looks, likely)])
    doubt = doubts(choice) if looks.clipped.any() else np.zeros(len(pack.styles))
    loss = given_up(choice[1:], choice[0].turns)
    reach, now, then = choice.in_reach, choice[0].offer, choice[1].offer
    changes = tuple(
        StyleChange(
            style.name,
            style.title,
            turn_of_index(now[row]),
            (WhatIf("all", -STOPS, turn_of_index(then[row]), float(loss[0, row])),),
            float(loss[:, row].max()),
            STOPS if doubt[row] > DOUBT else None,
            bool(reach[0, row]),
            STOPS if (reach[1:, row] != reach[0, row]).any() else None,
        )
        for row, style in enumerate(pack.styles)
    )
    low, share = (
        float((each.loss * each.solid_angle).sum()) / each.total
        for each in (light_grid(looks), grid)
    )
    names = tuple(each.name for each in changes if each.in_doubt)
    turns = [RoughTurns(names)] if names and share > 0.0 else []
    advice = (RoughLight(share), *advise(looks, lights, None, None), *turns)
    return Audit((low, share), advice, changes)


def doubts(choice: Choice) -> Float64:
    """Return how much each style's turn under the first light, (S,), depends on the others."""
    turns = choice[0].turns
    loss = given_up(choice[1:], turns)
    areas = loss[_WHOLE:].mean(axis=0) if len(loss) > _WHOLE else np.zeros(len(turns))
    parts = [*loss[:_WHOLE], areas]
    match = choice[0].measured.match[np.arange(len(turns)), turns]
    return np.asarray(np.mean(parts, axis=0) + _UNSURE * (1.0 - match / 100.0), np.float64)


def guesses(looks: MergedLight, likely: MergedLight) -> list[Float32]:
    """Return the alternatives, (h, w, 3) each: likely, as it looks, brighter, glowing, by area."""
    columns = min(looks.radiance.shape[1], _COLUMNS)
    white, coloured = _shares(looks.radiance, looks.clipped)
    planes = looks.radiance, likely.radiance, white, coloured
    size = (columns, columns // 2)
    means = [cv2.resize(plane, size, interpolation=cv2.INTER_AREA) for plane in planes]
    dim, bright, white, coloured = (np.asarray(mean, np.float32) for mean in means)
    more = _gain(white, coloured, STOPS + _BRIGHTER_STOPS, _COLOURED_STOPS + 1.0)
    glow = _GLOW[0] * (1.0 + _depth_deg(white)) ** _GLOW[1]
    middle = 1.0 + 0.5 * coloured + (glow - 1.0) * white
    labels, count = components(white > 0)
    areas = white * solid_angles(white.shape)[:, None]
    sizes = np.bincount(labels.ravel(), areas.ravel(), count + 1)[1:]
    largest = [k + 1 for k in np.argsort(-sizes)[:_AREAS] if sizes[k] > _LEAST_SR]
    alone = [np.where((labels == k)[..., None], dim, bright) for k in largest]
    return [bright, dim, dim * more, dim * middle[..., None].astype(np.float32), *alone]


def _depth_deg(white: Float32) -> Float32:
    """Return the depth of each texel within a white area, (h, w), in degrees."""
    width = white.shape[1]
    inside = np.tile((white > 0.5).astype(np.uint8), (1, 3))
    depth = cv2.distanceTransform(inside, cv2.DIST_L2, 5)[:, width : 2 * width]
    return np.asarray(depth * np.float32(360.0 / width), np.float32)
