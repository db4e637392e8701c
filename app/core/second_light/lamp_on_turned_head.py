"""A lamp combined with a lens that is not directly in front of the nose.

The grade and the best placement of a lamp depend on the face alone, since the turn and the
placement in eq. 7 are measured from the nose. Of all lens positions, the one with the best match
for the combined picture of place and lamp is chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Float32, Float64, Floats
from app.core.base.colour import luminance
from app.core.portrait.head_views import HeadView, HeadViews
from app.core.second_light.added_light import AddedLight, near_picture, prepare_near
from app.core.second_light.lamp_presets import NumbersLamp
from app.core.second_light.place_pictures import place_pictures
from app.core.second_light.placements import placement
from app.core.second_light.search import LampPlacement
from app.core.second_light.visible_change import VisibleChange
from app.core.solver.face import region_in_view
from app.core.solver.lens.lens_search import lighting_of
from app.core.solver.lens.lens_wish import LIGHTINGS, LensWish, obstacle_of
from app.core.solver.lens.view_tables import counts_in, targets_in
from app.core.solver.place_light import main_azimuth
from app.core.solver.shortfall import LensShortfall
from app.core.solver.style_result import Lighting
from app.core.solver.style_signature import GRADES, NO
from app.core.solver.transport import render
from app.core.solver.weights import region_weights
from app.core.styles.style_pack import StylePack


def seen_aside(
    pack: StylePack,
    views: HeadViews,
    placements: Sequence[LampPlacement],
    radiance: Floats,
    lamp_light: AddedLight,
    lamp: NumbersLamp | None,
    wish: LensWish,
) -> tuple[LampPlacement, ...]:
    """Choose the permitted lens position with the best match. Each view takes half a second.

    Args:
        placements: Results of `place_all` with the nose towards the lens.
        radiance: As in `place_all`.
        lamp: The lamp if it is described by numbers, and therefore near, or None otherwise.
        wish: Permitted positions of the lens. Azimuths of its background are measured from the same
            zero as turns.
    """
    under = [_under(one, radiance, lamp_light) for one in placements]
    keys = [_key(pack, one, light) for one, light in zip(placements, under, strict=True)]
    number = wish.yaw if isinstance(wish.yaw, float) else None
    yaws = views.yaws if number is None else (views.nearest(number),)
    best: list[LampPlacement | None] = [None] * len(placements)
    for yaw in sorted(yaws, key=lambda yaw: (abs(yaw), yaw)):
        view = _AsideView(pack, views, yaw, lamp, radiance) if yaw else None
        for place, one in enumerate(placements):
            lighting = LIGHTINGS[int(lighting_of(yaw, np.array(keys[place])))]
            if not wish.met_by(one.turn_deg + yaw) or wish.yaw not in ("auto", lighting, number):
                continue
            if view is not None and not view.counts[pack.index(one.name)]:
                continue
            match = one.match if view is None else view.match(one, under[place])
            before = best[place]
            if before is None or match > before.match:
                change = one.change if view is None else view.change(one, under[place])
                best[place] = replace(_with_yaw(one, yaw, lighting, match), change=change)
    return tuple(
        placement or _out_of_reach(one, wish)
        for one, placement in zip(placements, best, strict=True)
    )


def _with_yaw(
    one: LampPlacement, yaw_deg: float, lighting: Lighting, match: float
) -> LampPlacement:
    return replace(
        one,
        turn_deg=wrap(one.turn_deg + yaw_deg),
        turn_refined_deg=wrap(one.turn_refined_deg + yaw_deg),
        match=match,
        yaw_deg=yaw_deg,
        lighting=lighting,
    )


def _out_of_reach(one: LampPlacement, wish: LensWish) -> LampPlacement:
    grade = one.grade and GRADES[NO]
    return replace(one, attainable=False, shortfall=LensShortfall(obstacle_of(wish)), grade=grade)


def _under(one: LampPlacement, radiance: Floats, lamp_light: AddedLight) -> Float64:
    """Return the place's light on the face, plus a captured lamp or minus what a near one hides."""
    rotated = np.roll(radiance, -one.turn_index, axis=1)
    power = one.power if lamp_light.light is not None else 0.0
    return lamp_light.over(rotated, one.placement, power)


def _key(pack: StylePack, one: LampPlacement, light: Float64) -> float:
    """Return the azimuth of the main light relative to the nose, positive to the sitter's left."""
    style = pack.styles[pack.index(one.name)]
    if style.side != "none" and one.attainable:
        return max(style.lamps, key=lambda each: each.power).azimuth_deg
    main = main_azimuth(light)
    return one.lamp_azimuth_deg if main is None else -main


class _AsideView:
    """A head seen from the side, prepared for a lamp near it."""

    def __init__(
        self,
        pack: StylePack,
        views: HeadViews,
        yaw_deg: float,
        lamp: NumbersLamp | None,
        radiance: Floats,
    ) -> None:
        view: HeadView = views.at(yaw_deg, pack.styles)
        self.counts = counts_in(pack, view, views.shape)
        self._lamp, self._transport, self._radiance = lamp, view.transport, radiance
        self._pack = pack
        self._region = region_in_view(view.transport, view.shape, views.shape)
        self._targets: Float32 = targets_in(pack, view)
        self._near = None if lamp is None else prepare_near(view.transport, view.shape)

    def match(self, one: LampPlacement, under: Float64) -> float:
        """Return the match for the combined picture of place and lamp, 0 to 100."""
        region, grey = self._region, luminance(self._picture(one, under)).astype(np.float64)
        weights = region_weights(self._targets[self._pack.index(one.name)], region)
        away = grey - (grey @ region) / region.sum()
        face = region > 0
        norm = np.sqrt((weights[face] ** 2 / region[face]).sum() * (region @ away**2))
        return float(100.0 * (weights @ grey) / max(norm, 1e-30))

    def change(self, one: LampPlacement, under: Float64) -> VisibleChange:
        """Return the change of the picture as the lens sees it from there."""
        turns, pack = (one.before.turn_index, one.turn_index), self._pack
        face_pixels = int(np.count_nonzero(pack.region))
        alone = place_pictures(self._transport, self._radiance, turns, face_pixels)
        expose = pack.styles[pack.index(one.name)].expose
        return alone.change(expose, turns, self._picture(one, under))

    def _picture(self, one: LampPlacement, under: Float64) -> Float32:
        picture = render(self._transport, under)
        if self._near is None or self._lamp is None:
            return picture
        alone = near_picture(self._near, self._lamp, *placement(one.placement))
        return picture + np.float32(one.power) * alone
