"""Styles integrated over the face as seen from the side, and their match from that viewpoint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.portrait.head_views import HeadView, HeadViews, load_views_of
from app.core.solver.face import AREAS, AROUND, region_in_view
from app.core.solver.head_shape import HeadShape
from app.core.solver.search import (
    Curves,
    SearchTables,
    build_tables,
    colours_as,
    curves_of,
)
from app.core.solver.transport import render
from app.core.solver.turn_choice import StyleMeasures
from app.core.solver.weights import region_weights
from app.core.styles.lamps import AS_PUBLISHED, mirror_rows, studio_light
from app.core.styles.style_pack import StylePack

LEAST_VISIBLE: Final = 0.7
"""Smallest visible fraction of each of a style's areas for the style to count in a view."""

_EDGES: Final = ("edge", "outline")
_SAME_PLACE_M: Final = 0.004
_LEFT_OUT: Final = 1e-5  # fraction of the contrast that a view's search basis leaves out


@dataclass(frozen=True, slots=True, eq=False)
class ViewTables:
    """Search tables for one view of the face turned towards the sitter's own left.

    Attributes:
        tables: Targets and basis over the view's face pixels.
        weight_norm: (S,) float64. The same quantity as in a pack.
        counts: (S,) bool. Whether all areas of each style are sufficiently visible.
    """

    yaw_deg: float
    tables: SearchTables = field(repr=False)
    weight_norm: Float64 = field(repr=False)
    counts: Bools = field(repr=False)


def view_tables(pack: StylePack, view: HeadView, shape: HeadShape) -> ViewTables:
    """Pre-integrate the styles in a pack for a view.

    Args:
        shape: Shape of the head, as seen from the front.
    """
    whole = region_in_view(view.transport, view.shape, shape)
    face = whole > 0
    # Use the face alone, since skull and neck would double the memory.
    transport = replace(
        view.transport,
        pixels=view.transport.pixels[face],
        coverage=view.transport.coverage[face],
        pixel_basis=view.transport.pixel_basis[:, face],
    )
    colours, region = colours_as(transport, pack.mixing, pack.mixtures), whole[face]
    targets = targets_in(pack, view)[:, face]
    weights = np.stack([region_weights(target, region) for target in targets])
    rows = _contrast_rows(colours.bases, region, colours.texels, colours.mixed)
    half = rows.shape[-1] // 2
    left, right = rows[..., :half], rows[..., : half - 1 : -1]
    tables = build_tables(
        colours.integrate(weights),
        colours.integrate(region / region.sum()),
        0.5 * (left + right),
        0.5 * (left - right),
        paired=True,
    )
    # This halves the memory, and costs a millionth of a point.
    tables = replace(tables, basis=tables.basis.astype(np.float32))
    norm = np.sqrt((weights**2 / region).sum(axis=1))
    return ViewTables(view.yaw_deg, tables, norm, counts_in(pack, view, shape))


def targets_in(pack: StylePack, view: HeadView) -> Float32:
    """Return the luminance of each style in a view, (S, P), as lit by the lamps in the pack."""
    targets, transport = view.targets.copy(), view.transport
    for row, studio in enumerate(pack.studios):
        if studio != AS_PUBLISHED:
            light = studio_light(pack.styles[row], studio, transport.environment_shape)
            picture = np.maximum(render(transport, light), 0)
            targets[row] = picture / max(float(picture.max()), 1e-30)
    return targets


def _contrast_rows(bases: Float32, region: Float64, texels: Float32, mixed: Float32) -> Float32:
    """Return the rows, (r, Q, W), whose products with the light give the contrast as their norm."""
    centred = bases.astype(np.float64)
    centred -= np.einsum("p,kpr->kr", region, centred)[:, None] / region.sum()
    centred *= np.sqrt(region)[:, None]
    grey, tint = centred
    values, vectors = np.linalg.eigh(grey.T @ grey)
    order = np.argsort(-values)
    left_out = 1.0 - np.cumsum(values[order]) / values.sum()
    rows = order[: int(np.argmax(left_out < _LEFT_OUT)) + 1]
    size = np.sqrt(values[rows])
    first = np.tensordot((vectors[:, rows] * size).T, texels, 1)
    second = np.tensordot((grey @ vectors[:, rows] / size).T @ tint, mixed, 1)
    return np.asarray(np.concatenate([first, second], axis=1), np.float32)


def counts_in(pack: StylePack, view: HeadView, shape: HeadShape) -> Bools:
    """Return a mask, (S,), of the styles whose areas are all sufficiently visible in a view."""
    visibility = seen_from(view, shape.positions).astype(np.float64)
    areas = pack.areas.reshape(len(AREAS), -1)[:, shape.pixels].astype(np.float64)
    share = (areas @ visibility) / np.maximum(areas.sum(axis=1), 1e-30)
    share[AROUND] = 0.0  # seen from the side, another background is behind the sitter
    hidden = {
        name for name, part in zip(AREAS, share.tolist(), strict=True) if part < LEAST_VISIBLE
    }
    # A hidden edge cannot be too bright.
    harmless = {name for name in hidden if name.split()[-1] in _EDGES}
    return np.array(
        [
            all(
                not ({r.bright, r.dark} & (hidden if r.least > 0 else hidden - harmless))
                for r in style.signature.relations
            )
            for style in pack.styles
        ]
    )


def seen_from(view: HeadView, places: Float32) -> Bools:
    """Return a mask, (n,), of the skin points `places`, (n, 3), that the view's camera sees."""
    side, pixels = view.transport.size, view.transport.pixels
    yaw = np.radians(view.yaw_deg)
    far = view.transport.header.distance_m + float(view.shape.eye_point[2])
    right, ahead = np.array([[np.cos(yaw), 0, np.sin(yaw)], [np.sin(yaw), 0, -np.cos(yaw)]])

    def slopes(points: Float32) -> tuple[Float64, Float64]:
        away = points @ ahead + far
        return away, np.stack([points @ right, -points[:, 1], away], axis=1) / away[:, None]

    # The camera is known except for the crop of its picture, which follows from the pixels of the
    # view.
    depth, front_slopes = slopes(view.shape.positions)
    pixel_places = np.stack([pixels % side, pixels // side], axis=1)
    camera = [
        np.linalg.lstsq(front_slopes[:, [axis, 2]], pixel_places[:, axis])[0] for axis in (0, 1)
    ]
    away, place_slopes = slopes(places)
    column, row = (np.rint(place_slopes[:, [axis, 2]] @ camera[axis]) for axis in (0, 1))
    farthest = np.full((side, side), -np.inf, np.float32)
    farthest.flat[pixels] = depth
    around = cv2.dilate(farthest, np.ones((3, 3), np.uint8))
    inside = (row >= 0) & (row < side) & (column >= 0) & (column < side)
    at = np.where(inside, row, 0).astype(np.intp), np.where(inside, column, 0).astype(np.intp)
    return np.asarray(inside & (away <= around[at] + _SAME_PLACE_M))


def match_curves(
    pack: StylePack, views: Sequence[ViewTables], light: Floats, front: StyleMeasures
) -> dict[float, tuple[Float64, Float64]]:
    """Return the match of every style at every turn of the nose, by yaw.

    Args:
        light: (Q, W) float. As returned by `StylePack.project`.
        front: Measures of the place at yaw 0.

    Returns:
        The match, 0 to 100, and the contrast used in it, (S, 64) float64 each.
    """
    both = np.stack([light, light[:, ::-1]])
    rows = mirror_rows(pack.styles)
    back = -np.arange(TURNS) % TURNS
    by_yaw = {0.0: (front.match, front.contrast)}
    for view in views:
        curves = curves_of(view.tables, both)
        here, there = (_match(pack, view, curves, number) for number in (0, 1))
        by_yaw[view.yaw_deg] = here
        if pack.header.paired:  # an asymmetric head has views from both sides
            continue
        by_yaw[-view.yaw_deg] = there[0][rows][:, back], there[1][:, back]
    return by_yaw


def _match(
    pack: StylePack, view: ViewTables, curves: Curves, number: int
) -> tuple[Float64, Float64]:
    contrast = np.maximum(curves.contrast[number], 1e-12 * curves.contrast[number].max() + 1e-30)
    match = 100.0 * curves.quality[number] / (view.weight_norm[:, None] * contrast)
    return match, np.broadcast_to(contrast, match.shape)


def views_of(pack: StylePack, name: str) -> list[ViewTables]:
    """Load every view of a head and prepare it for the search.

    Args:
        name: Name of a shipped head, or path of a transport file.

    Raises:
        TransportError: If the views cannot be read.
    """
    return tables_of(pack, load_views_of(pack, name))


def tables_of(pack: StylePack, views: HeadViews) -> list[ViewTables]:
    """Prepare loaded views for the search."""
    return [view_tables(pack, views.at(yaw, pack.styles), views.shape) for yaw in views.parts]
