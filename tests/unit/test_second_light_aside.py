"""A lamp and a lens beside the nose: against the search of a place with that lamp in it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from app.core.base.angles import wrap
from app.core.base.colour import FloatImage, face_exposure, luminance
from app.core.second_light.added_light import AddedLight, from_captured
from app.core.second_light.contrast import prepare_face
from app.core.second_light.lamp_on_turned_head import seen_aside
from app.core.second_light.search import LampPlacement, place_all
from app.core.second_light.visible_change import visible_change
from app.core.solver.lens.lens_wish import LensWish, YawWord
from app.core.solver.lens.view_tables import match_curves, views_of
from app.core.solver.relighting_cache import normalised
from app.core.solver.search import curves
from app.core.solver.shortfall import LensShortfall, Obstacle
from app.core.solver.solve import measure
from app.core.solver.transport import render, to_image
from tests.helpers.second_light import coloured_place, placed_lamp
from tests.helpers.shipped import generic_pack, generic_transport, generic_views
from tests.helpers.synthetic import lamp_environment

STYLES = ["left-loop", "right-rembrandt", "butterfly"]


@cache
def added() -> AddedLight:
    return from_captured(
        generic_transport(),
        placed_lamp(),
        face=prepare_face(generic_transport(), generic_pack().region_on(generic_transport())),
    )


@cache
def found() -> tuple[LampPlacement, ...]:
    return place_all(generic_pack(), generic_transport(), place(), added(), styles=STYLES)


@cache
def place() -> np.ndarray:
    return coloured_place() * np.float32(0.2) + lamp_environment(140.0, 10.0)[..., None]


@pytest.mark.parametrize("yaw", [15.0, -30.0])
def test_the_match_is_that_of_a_place_with_the_lamp_in_it(yaw: float) -> None:
    for one, there in zip(
        found(),
        seen_aside(generic_pack(), generic_views(), found(), place(), added(), None, LensWish(yaw)),
        strict=True,
    ):
        turned = np.roll(place(), -one.turn_index, axis=1)
        whole = np.roll(added().over(turned, one.placement, one.power), one.turn_index, axis=1)
        seen = generic_pack().project(normalised(whole, (32, 64))[0])
        front = measure(generic_pack(), curves(generic_pack().tables, seen))
        match, _ = match_curves(generic_pack(), views_of(generic_pack(), "generic"), seen, front)[
            yaw
        ]
        known = match[generic_pack().index(one.name), one.turn_index]
        assert there.match == pytest.approx(float(known), abs=0.5)
        assert there.yaw_deg == yaw
        assert wrap(there.turn_refined_deg - one.turn_refined_deg) == pytest.approx(yaw)
        # What the lens sees changes neither the grade nor where the lamp is held.
        same = (there.grade, there.placement, there.attainable)
        assert same == (one.grade, one.placement, one.attainable)


def test_the_change_is_that_of_the_pictures_from_aside() -> None:
    yaw = -30.0
    transport = generic_views().at(yaw, generic_pack().styles).transport
    coverage = to_image(transport, transport.coverage)

    def exposed(light: np.ndarray) -> FloatImage:
        picture = render(transport, light)
        gain = face_exposure(luminance(picture[transport.face]))
        return to_image(transport, picture * np.float32(gain))

    wish = LensWish(yaw)
    aside = seen_aside(generic_pack(), generic_views(), found(), place(), added(), None, wish)
    for one, there in zip(found(), aside, strict=True):
        turned, best = (
            np.roll(place(), -turn, axis=1) for turn in (one.turn_index, one.before.turn_index)
        )
        after = exposed(added().over(turned, one.placement, one.power))
        area = int((generic_pack().region > 0).sum())
        wanted = min(
            visible_change(exposed(before), after, coverage, area).delta_lightness
            for before in (turned, best)
        )
        assert there.change.delta_lightness == pytest.approx(wanted, rel=1e-3)
        assert there.change != one.change


def test_short_and_broad_lie_on_both_sides_of_the_nose() -> None:
    """Loop is lit from the sitter's left; a face turned to its left shows its right, dark side."""
    signs: dict[YawWord, int] = {"short": 1, "broad": -1}
    for word, sign in signs.items():
        aside = seen_aside(
            generic_pack(), generic_views(), found(), place(), added(), None, LensWish(word)
        )
        loop = next(one for one in aside if one.name == "left-loop")
        assert loop.lighting == word
        assert sign * loop.yaw_deg > 0


def test_the_best_is_no_worse_than_straight_and_a_background_is_kept() -> None:
    best = seen_aside(
        generic_pack(), generic_views(), found(), place(), added(), None, LensWish("auto")
    )
    assert all(one.match >= other.match for one, other in zip(best, found(), strict=True))
    first = found()[0]
    window = (wrap(first.turn_deg + 200.0), wrap(first.turn_deg + 230.0))
    (held, *_) = seen_aside(
        generic_pack(), generic_views(), found(), place(), added(), None, LensWish("auto", window)
    )
    assert held.yaw_deg in (30.0, 45.0)
    nowhere = LensWish("auto", (wrap(first.turn_deg + 20.0), wrap(first.turn_deg + 60.0)))
    (lost, *_) = seen_aside(
        generic_pack(), generic_views(), found(), place(), added(), None, nowhere
    )
    assert (lost.attainable, lost.yaw_deg) == (False, 0.0)
    assert lost.shortfall == LensShortfall(Obstacle.BACKGROUND)
