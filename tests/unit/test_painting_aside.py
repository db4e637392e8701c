"""What is painted on the face, seen from aside: against the built-in styles, and by symmetry."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from app.core.base.angles import TURNS, wrap
from app.core.environment.environment import read_environment, reduce
from app.core.painting.canvas import Canvas, from_style, head_values, make_canvas
from app.core.painting.paint_on_turned_head import PaintedHead, solve_painted
from app.core.painting.user_style import UserStyle, solve_user_styles
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.lens.view_tables import views_of
from tests.helpers.shipped import generic_pack, generic_transport, generic_views
from tests.helpers.synthetic import lamp_environment

SCENES = Path(__file__).resolve().parents[2] / "resources" / "demo" / "scenes"


@cache
def painted_head() -> PaintedHead:
    return PaintedHead(generic_transport(), generic_views(), generic_pack().styles)


def painted(name: str) -> UserStyle:
    canvas: Canvas = from_style(generic_pack(), generic_transport(), name)
    return UserStyle(name, "Mine", "left", "", "", "generic", "", canvas.weights, canvas.ignore)


@pytest.mark.parametrize("yaw", [15.0, -30.0])
@pytest.mark.parametrize("name", ["left-loop", "left-rembrandt", "left-split"])
def test_a_style_that_is_painted_matches_as_the_built_in_one_does(name: str, yaw: float) -> None:
    """Targets of built-in styles from aside were traced; what is painted is moved over the skin.

    From the front the curves of the two have a correlation of 0.97 to 0.98: what is painted counts
    on the whole face, in grey.
    """
    light = reduce(read_environment(SCENES / "interior.exr"))
    wish = LensWish(yaw)
    (mine,) = solve_painted(painted_head(), [painted(name)], light, wish)
    built_in = solve_lens(
        generic_pack(), views_of(generic_pack(), "generic"), light, wish, styles=[name]
    )
    theirs = next(one for one in built_in if one.name == name)
    assert np.corrcoef(mine.match_curve, theirs.match_curve)[0, 1] > 0.9
    assert (mine.yaw_deg, theirs.yaw_deg) == (yaw, yaw)


@pytest.mark.parametrize("yaw", [15.0, 45.0])
def test_the_other_side_is_the_mirror_image(yaw: float) -> None:
    light = lamp_environment(50.0, 20.0, fill=0.05)
    (one,) = solve_painted(painted_head(), [painted("left-loop")], light, LensWish(yaw))
    (other,) = solve_painted(
        painted_head(), [painted("right-loop")], light[:, ::-1], LensWish(-yaw)
    )
    assert other.turn_refined_deg == pytest.approx(-one.turn_refined_deg, abs=0.5)
    # Curves count turns of the lens.
    back = -np.arange(TURNS) % TURNS
    np.testing.assert_allclose(np.sort(other.match_curve[back]), np.sort(one.match_curve), atol=1.0)


def test_the_lens_in_front_gives_the_answer_of_before() -> None:
    light, mine = lamp_environment(50.0, 20.0, fill=0.05), painted("left-loop")
    (straight,) = solve_painted(
        painted_head(), [mine], light, LensWish(0.0, (-180.0, 179.0)), front_deg=20.0
    )
    (known,) = solve_user_styles(generic_transport(), [mine], light, front_deg=20.0)
    assert straight.turn_refined_deg == known.turn_refined_deg
    np.testing.assert_array_equal(straight.match_curve, known.match_curve)
    assert solve_painted(painted_head(), [], light, LensWish("auto")) == ()


def test_a_background_that_is_asked_for_is_behind() -> None:
    light, window = lamp_environment(50.0, 20.0, fill=0.05), (100.0, 140.0)
    (found,) = solve_painted(
        painted_head(), [painted("left-loop")], light, LensWish("auto", window)
    )
    assert abs(wrap(found.background_deg - 120.0)) <= 20.0 or not found.attainable


def test_only_skin_that_a_lens_sees_is_asked() -> None:
    """The far cheek of a face turned by 45 degrees, painted alone, cannot be judged from there."""
    weights = painted_head().weights(painted("left-loop"))
    right = painted_head().view(45.0)  # shows the right side
    seen = painted_head().weights_in(right, weights)
    places = right.shape.positions[:, 0]
    assert seen.active[places < -0.03].sum() > seen.active[places > 0.03].sum()
    assert seen.count > 500
    assert painted_head().shows(painted_head().view(15.0), weights)
    picture = painted_head().target(painted("left-loop"), 30.0)
    assert picture.shape == (100, 100, 3)
    assert float(picture.max()) == pytest.approx(1.0)


@pytest.mark.parametrize("yaw", [-45.0, 30.0])
def test_a_view_says_where_the_front_shows_the_same_skin(yaw: float) -> None:
    """By the camera that is worked out; what is painted is moved by the nearest pixel."""
    view = painted_head().view(yaw)
    places = painted_head().places_on_front(view).reshape(-1, 3)
    mine = painted("left-loop")
    canvas = make_canvas(mine.weights, mine.ignore)
    moved = painted_head().weights_in(view, painted_head().weights(mine))
    pixels = view.transport.pixels
    shown = moved.active & (places[pixels, 2] > 0.9)
    spots = np.floor(places[pixels[shown], :2] * canvas.size).astype(int)
    column, row = np.minimum(spots, canvas.size - 1).T
    there = canvas.weights[row, column]
    plain, _ = head_values(canvas, generic_transport())
    assert shown.sum() > 1500
    assert np.corrcoef(there, moved.values[shown])[0, 1] > 0.98
    assert np.ptp(plain) > 1.0
    assert (places[np.setdiff1d(np.arange(len(places)), pixels)] == -1.0).all()


def test_where_the_front_shows_it_is_the_mirror_image_from_the_other_side() -> None:
    left, right = (
        painted_head().places_on_front(painted_head().view(yaw)) for yaw in (30.0, -30.0)
    )
    twin = right[:, ::-1]
    on_head = left[..., 2] >= 0
    np.testing.assert_array_equal(on_head, twin[..., 2] >= 0)
    both = (left[..., 2] > 0.9) & (twin[..., 2] > 0.9)
    np.testing.assert_allclose(left[both, 0], 1.0 - twin[both, 0], atol=0.01)
    np.testing.assert_allclose(left[both, 1], twin[both, 1], atol=0.01)


def test_what_the_front_does_not_show_is_told() -> None:
    """At 45 deg the cheek is seen to the ear and beyond; from the front it is hidden there."""
    places = painted_head().places_on_front(painted_head().view(45.0))
    ear = places[45:55, :25]
    assert ear[ear[..., 2] >= 0, 2].min() < 0.1
    assert places[45:60, 55:65, 2].min() > 0.9
