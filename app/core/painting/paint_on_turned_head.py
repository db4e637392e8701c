"""Painted styles on a turned head, whose skin carries the paint.

The paint describes the light on the skin of the whole face. The turn of the nose therefore decides
whether a place can provide that light. The match at a position of the lens depends on the part of
the face that the lens sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float32, Float64, Floats, Indices
from app.core.base.colour import luminance
from app.core.painting.canvas import make_canvas, weights_of
from app.core.painting.user_style import UserStyle, target_picture
from app.core.portrait.head_views import HeadView, HeadViews
from app.core.solver.head_shape import HeadShape
from app.core.solver.lens.lens_search import LensSearch, best_answers
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.lens.view_tables import LEAST_VISIBLE, seen_from
from app.core.solver.place_light import main_azimuth
from app.core.solver.relighting_cache import LightTable, light_table, painted_curves
from app.core.solver.solve import judge_painted, measure_painted
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import LIMITS, Limits, Objective, StyleMeasures
from app.core.solver.weights import PaintedWeights, painted
from app.core.styles.style import Style

_SMOOTH: Final = 1.5  # pixels
_SAME_SKIN_M: Final = 0.008  # distance between pixels of the front view where the head is steep


@dataclass(frozen=True, eq=False)
class PaintedHead:
    """A head that carries paint, and its views from the side."""

    front: Transport = field(repr=False)
    views: HeadViews = field(repr=False)
    styles: Sequence[Style] = field(repr=False)

    def weights(self, style: UserStyle) -> PaintedWeights:
        """Return a style's weights in the front view."""
        return weights_of(make_canvas(style.weights, style.ignore), self.front)

    def view(self, yaw_deg: float) -> HeadView:
        """Return the view at the given yaw."""
        return self.views.at(yaw_deg, self.styles)

    def weights_in(self, view: HeadView, weights: PaintedWeights) -> PaintedWeights:
        """Transfer weights to a view, ignoring skin that is hidden in the front view."""
        nearest, beyond = self._on_front(view)
        ignored = beyond | ~weights.active[nearest]
        return painted(view.transport, weights.values[nearest], ignored)

    def _on_front(self, view: HeadView) -> tuple[Indices, Bools]:
        """Return the nearest front pixel to each pixel of a view, and whether the skin is hidden.

        Hidden skin is skin that the front view does not show.
        """
        face = np.flatnonzero(self.front.face)
        pairs = cv2.BFMatcher(cv2.NORM_L2).match(
            view.shape.positions, np.ascontiguousarray(self.views.shape.positions[face])
        )
        nearest = face[[pair.trainIdx for pair in pairs]]
        return nearest, np.array([pair.distance for pair in pairs]) > _SAME_SKIN_M

    def places_on_front(self, view: HeadView) -> Float32:
        """Locate the skin that a view shows in the front picture.

        Returns:
            (N, N, 3) float32. The column and row in the front picture for each pixel of the view,
            as fractions of that picture, and its visibility from the front, 0 to 1. All three are
            -1 outside the head.
        """
        camera = _camera_of(self.views.shape, self.front.size)
        size, pixels = view.transport.size, view.transport.pixels
        places = np.full((size * size, 3), -1.0, np.float32)
        places[pixels, :2] = _seen_by(camera, view.shape.positions)
        visibility = np.zeros(size * size, np.float32)
        visibility[pixels[~self._on_front(view)[1]]] = 1.0
        # Single pixels vary, since those of the front are far apart where the head is steep.
        smooth = cv2.GaussianBlur(
            cv2.medianBlur(visibility.reshape(size, size), 5), (0, 0), _SMOOTH
        )
        places[pixels, 2] = smooth.ravel()[pixels]
        return places.reshape(size, size, 3)

    def shows(self, view: HeadView, weights: PaintedWeights) -> bool:
        """Return whether a view shows enough of the paint."""
        visibility = seen_from(view, self.views.shape.positions[weights.active])
        return bool(visibility.size) and float(visibility.mean()) >= LEAST_VISIBLE

    def target(self, style: UserStyle, yaw_deg: float) -> Float32:
        """Return the target picture as seen from the side (see `target_picture`)."""
        view = self.view(yaw_deg)
        picture = target_picture(view.transport, self.weights_in(view, self.weights(style)))
        # Use one colour, since in deep shadow a view's own colour is lost in its noise.
        tint = picture.mean(axis=(0, 1))
        grey = luminance(picture)[..., None] / max(float(luminance(tint)), 1e-30)
        return np.asarray(grey * (tint / max(float((grey * tint).max()), 1e-30)), np.float32)


def solve_painted(
    head: PaintedHead,
    styles: Sequence[UserStyle],
    light: Floats,
    wish: LensWish,
    objective: Objective = "picture",
    *,
    limits: Limits = LIMITS,
    front_deg: float = 0.0,
) -> tuple[StyleResult, ...]:
    """Find the best turn and yaw for painted styles, but otherwise work like `solve_user_styles`.

    Args:
        wish: Permitted positions of the lens. Its background, like turns, is measured from
            `front_deg`.
    """
    wish, results = wish.moved(-front_deg), []
    painted_light = _PaintedLight.by(head, light) if styles else None
    for style in styles:
        assert painted_light is not None
        (best,) = best_answers(
            painted_light.search(style, objective, limits), wish, painted_light.front.scale
        )
        best = replace(best, name=style.name, title=style.title, side=style.side)
        results.append(best.seen_from(front_deg) if front_deg else best)
    return tuple(results)


@dataclass(frozen=True, eq=False)
class _PaintedLight:
    """All views of a head in the light of a place."""

    head: PaintedHead
    front: LightTable
    views: dict[float, tuple[HeadView, LightTable]]
    main_deg: float | None

    @classmethod
    def by(cls, head: PaintedHead, light: Floats) -> _PaintedLight:
        views = {yaw: head.view(yaw) for yaw in head.views.yaws if yaw}
        return cls(
            head,
            light_table(head.front, light),
            {yaw: (view, light_table(view.transport, light)) for yaw, view in views.items()},
            main_azimuth(light),
        )

    def search(self, style: UserStyle, objective: Objective, limits: Limits) -> LensSearch:
        """Search this place for the turns and yaws of a style, for any position of the lens."""
        weights = self.head.weights(style)
        straight = measure_painted(painted_curves(self.front, weights))
        curves = {0.0: (straight.match[None], straight.contrast[None])}
        counts = {0.0: np.ones(1, bool)}
        for yaw, (view, table) in self.views.items():
            measures = measure_painted(painted_curves(table, self.head.weights_in(view, weights)))
            curves[yaw] = measures.match[None], measures.contrast[None]
            counts[yaw] = np.array([self.head.shows(view, weights)])
        return LensSearch(
            styles=[None],
            front=StyleMeasures(
                *(getattr(straight, each.name)[None] for each in fields(StyleMeasures))
            ),
            grades=np.zeros((1, TURNS), np.intp),
            verdict=lambda _, at: judge_painted(straight, at, limits, self.front.light),
            objective=objective,
            limits=limits,
            curves=curves,
            counts=counts,
            by_areas=np.zeros(1, bool),
            main_deg=self.main_deg,
        )


def _camera_of(shape: HeadShape, size: int) -> Float64:
    """Reconstruct the camera matrix of a head's picture, (3, 4), from the positions it shows.

    The method is the direct linear transform of Hartley and Zisserman, Multiple View Geometry, 2nd
    ed., eq. 7.2.
    """
    places = np.column_stack([shape.positions, np.ones(len(shape.positions))])
    points = np.column_stack([shape.pixels % size + 0.5, shape.pixels // size + 0.5]) / size
    nothing = np.zeros_like(places)
    across = np.hstack([places, nothing, -points[:, :1] * places])
    down = np.hstack([nothing, places, -points[:, 1:] * places])
    least = np.linalg.svd(np.vstack([across, down]), full_matrices=False)[2][-1]
    return np.asarray(least.reshape(3, 4))


def _seen_by(camera: Float64, places: Float32) -> Float64:
    """Project positions, (P, 3), to columns and rows, (P, 2), as fractions of the picture."""
    points = np.column_stack([places, np.ones(len(places))]) @ camera.T
    return np.asarray(points[:, :2] / points[:, 2:])
