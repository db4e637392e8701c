"""A lamp, and a lens beside the nose.

Where a lamp is held best depends on the face alone: turn and placement of eq. 7 are counted from
the nose, and so is the grade. Of all lenses around it the one counts from which the picture of
place and lamp together matches best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Float32, Float64, Floats
from app.core.base.colour import luminance
from app.core.portrait.head_views import HeadView, HeadViews
from app.core.second_light.added import AddedLight, near_picture, prepare_near
from app.core.second_light.lamp_presets import NumbersLamp
from app.core.second_light.placements import placement
from app.core.second_light.search import Placed
from app.core.solver.face import region_in_view
from app.core.solver.lens_search import (
    LIGHTINGS,
    LensWish,
    counts_in,
    lighting_of,
    obstacle_of,
    targets_in,
)
from app.core.solver.place_light import main_azimuth
from app.core.solver.shortfall import LensShortfall
from app.core.solver.signature import GRADES, NO
from app.core.solver.solve import Lighting
from app.core.solver.transport import render
from app.core.solver.weights import region_weights
from app.core.styles.style_pack import StylePack


def seen_aside(
    pack: StylePack,
    views: HeadViews,
    found: Sequence[Placed],
    radiance: Floats,
    added: AddedLight,
    lamp: NumbersLamp | None,
    wish: LensWish,
) -> tuple[Placed, ...]:
    """Choose the lens that meets the wish and sees the best match; half a second for each view.

    Args:
        found: Of `place_all`, the nose to the lens.
        radiance: As `place_all` takes it.
        lamp: Where it is one from numbers, which is near.
        wish: Its background counts from where the turns found do.
    """
    under = [_under(one, radiance, added) for one in found]
    keys = [_key(pack, one, light) for one, light in zip(found, under, strict=True)]
    number = wish.yaw if isinstance(wish.yaw, float) else None
    asked = views.yaws if number is None else (views.nearest(number),)
    best: list[Placed | None] = [None] * len(found)
    for yaw in sorted(asked, key=lambda yaw: (abs(yaw), yaw)):
        seen = _View(pack, views, yaw, lamp) if yaw else None
        for place, one in enumerate(found):
            lit = LIGHTINGS[int(lighting_of(yaw, np.array(keys[place])))]
            if not wish.met_by(one.turn_deg + yaw) or wish.yaw not in ("auto", lit, number):
                continue
            if seen is not None and not seen.counts[pack.index(one.name)]:
                continue
            match = one.match if seen is None else seen.match(one, under[place])
            before = best[place]
            if before is None or match > before.match:
                best[place] = _moved(one, yaw, lit, match)
    return tuple(moved or _out_of_reach(one, wish) for one, moved in zip(found, best, strict=True))


def _moved(one: Placed, yaw_deg: float, lit: Lighting, match: float) -> Placed:
    return replace(
        one,
        turn_deg=wrap(one.turn_deg + yaw_deg),
        turn_refined_deg=wrap(one.turn_refined_deg + yaw_deg),
        match=match,
        yaw_deg=yaw_deg,
        lighting=lit,
    )


def _out_of_reach(one: Placed, wish: LensWish) -> Placed:
    grade = one.grade and GRADES[NO]
    return replace(one, attainable=False, shortfall=LensShortfall(obstacle_of(wish)), grade=grade)


def _under(one: Placed, radiance: Floats, added: AddedLight) -> Float64:
    """The place as the face sees it: with a captured lamp, or without what a near lamp hides."""
    turned = np.roll(radiance, -one.turn_index, axis=1)
    power = one.power if added.light is not None else 0.0
    return added.over(turned, one.placement, power)


def _key(pack: StylePack, one: Placed, light: Float64) -> float:
    """Azimuth of what lights the face most, from the nose toward the sitter's left."""
    style = pack.styles[pack.index(one.name)]
    if style.side != "none" and one.attainable:
        return max(style.lamps, key=lambda each: each.power).azimuth_deg
    main = main_azimuth(light)
    return one.lamp_azimuth_deg if main is None else -main


class _View:
    """A head from aside, ready for a lamp near it."""

    def __init__(
        self, pack: StylePack, views: HeadViews, yaw_deg: float, lamp: NumbersLamp | None
    ) -> None:
        view: HeadView = views.at(yaw_deg, pack.styles)
        self.counts = counts_in(pack, view, views.shape)
        self._lamp, self._transport = lamp, view.transport
        self._pack = pack
        self._region = region_in_view(view.transport, view.shape, views.shape)
        self._targets: Float32 = targets_in(pack, view)
        self._near = None if lamp is None else prepare_near(view.transport, view.shape)

    def match(self, one: Placed, under: Float64) -> float:
        """Match of the picture of place and lamp, of 100."""
        picture = render(self._transport, under)
        if self._near is not None and self._lamp is not None:
            alone = near_picture(self._near, self._lamp, *placement(one.placement))
            picture = picture + np.float32(one.power) * alone
        region, seen = self._region, luminance(picture).astype(np.float64)
        weights = region_weights(self._targets[self._pack.index(one.name)], region)
        away = seen - (seen @ region) / region.sum()
        face = region > 0
        norm = np.sqrt((weights[face] ** 2 / region[face]).sum() * (region @ away**2))
        return float(100.0 * (weights @ seen) / max(norm, 1e-30))
