"""Painted styles in the gallery: their pictures, their side, and their answers."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.painting.canvas import Canvas, blank, from_style, make_canvas, weights_of
from app.core.painting.stroke import Brush, Stroke, Tool
from app.core.painting.user_style import (
    UserStyle,
    light_side,
    prepare_user_style,
    solve_user_styles,
    suggested_side,
    target_picture,
)
from app.core.solver.relighting_cache import light_table
from app.core.solver.transport import load_named
from app.core.styles.styles import load_styles
from tests.helpers.painted import solve_painted
from tests.helpers.shipped import generic_pack, generic_transport
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment

STYLES = {style.name: style for style in load_styles()}
MATTE = lambert_sphere_transport()


def user_style(canvas: Canvas, name: str = "mine") -> UserStyle:
    return UserStyle(name, "Mine", "left", "", "", "generic", "", canvas.weights, canvas.ignore)


def test_answers_bear_the_names_of_their_styles() -> None:
    light = lamp_environment(50.0, 20.0, fill=0.02)
    styles = [
        user_style(from_style(generic_pack(), generic_transport(), name), name)
        for name in ("left-loop", "right-split")
    ]
    found = solve_user_styles(generic_transport(), styles, light, front_deg=10.0)
    assert [(r.name, r.title, r.side) for r in found] == [
        ("left-loop", "Mine", "left"),
        ("right-split", "Mine", "left"),
    ]
    alone = solve_painted(
        generic_transport(), weights_of(make_canvas(styles[0].weights), generic_transport()), light
    )
    assert found[0].turn_refined_deg == pytest.approx(alone.turn_refined_deg - 10.0, abs=1e-6)
    assert found[0].match == alone.match
    assert solve_user_styles(generic_transport(), [], light) == ()


def test_prepared_styles_and_lights_give_the_same() -> None:
    light = lamp_environment(50.0, 20.0, fill=0.02)
    style = user_style(from_style(generic_pack(), generic_transport(), "top"))
    plain = solve_user_styles(generic_transport(), [style], light)[0]
    asking = prepare_user_style(generic_transport(), style)
    table = light_table(generic_transport(), light)
    again = solve_user_styles(generic_transport(), [asking], light, table=table)[0]
    np.testing.assert_array_equal(plain.match_curve, again.match_curve)
    assert asking.target.shape == (100, 100, 3)


def test_a_style_painted_on_one_head_asks_the_same_of_another() -> None:
    style = user_style(from_style(generic_pack(), generic_transport(), "left-split"))
    light = lamp_environment(0.0, 10.0, fill=0.02)
    other = load_named("male")
    turns = [
        solve_user_styles(head, [style], light)[0].turn_refined_deg
        for head in (generic_transport(), other)
    ]
    assert turns[0] == pytest.approx(90.0, abs=12.0)
    assert turns[1] == pytest.approx(turns[0], abs=12.0)


@pytest.mark.parametrize("name", ["left-rembrandt", "below", "right-split", "butterfly"])
def test_the_target_picture_looks_like_the_style(name: str) -> None:
    weights = weights_of(from_style(generic_pack(), generic_transport(), name), generic_transport())
    picture = target_picture(generic_transport(), weights)
    assert picture.max() == pytest.approx(1.0)
    assert picture.min() >= 0
    face = picture.reshape(-1, 3)[generic_transport().pixels][generic_transport().face] @ np.array(
        [0.2126, 0.7152, 0.0722]
    )
    f = weights.weights[generic_transport().face]
    assert np.corrcoef(face, f)[0, 1] > 0.6
    # Skin is redder than it is blue.
    red, _, blue = picture.reshape(-1, 3)[generic_transport().pixels].mean(axis=0)
    assert red > blue


def test_nothing_painted_has_a_black_target() -> None:
    picture = target_picture(MATTE, weights_of(blank(MATTE), MATTE))
    assert not picture.any()


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("left-rembrandt", ("left", "")),
        ("right-loop", ("right", "")),
        ("left-split", ("left", "")),
        ("right-rim", ("right", "")),
        ("badger", ("none", "from both sides")),
        ("below", ("none", "in front, from beneath")),
        ("butterfly", ("none", "in front, from above")),
        ("flat", ("none", "in front, at eye level")),
        ("top", ("none", "from overhead")),
    ],
)
def test_the_side_is_where_the_light_is_asked_from(name: str, expected: tuple[str, str]) -> None:
    assert (
        light_side(
            generic_transport(),
            weights_of(from_style(generic_pack(), generic_transport(), name), generic_transport()),
        )
        == expected
    )


def test_a_style_keeps_the_side_it_started_from_until_it_is_another() -> None:
    canvas = from_style(generic_pack(), generic_transport(), "left-loop-rim")
    origin = STYLES["left-loop-rim"]
    weights = weights_of(canvas, generic_transport())
    assert suggested_side(canvas, generic_transport(), weights, origin) == ("left", "")
    # Its rim is brighter than its key, and on the other side.
    assert suggested_side(canvas, generic_transport(), weights) == ("right", "")
    for tool, x in ((Tool.BRIGHTER, 130.0), (Tool.DARKER, 270.0)):
        stroke = Stroke(canvas, Brush(tool, 200.0, strength=1.0, softness=0.2), x, 50.0)
        stroke.extend(x, 380.0)
        canvas, _ = stroke.commit()
    weights = weights_of(canvas, generic_transport())
    assert suggested_side(canvas, generic_transport(), weights, origin) == ("right", "")


def test_nothing_painted_has_no_side() -> None:
    assert light_side(MATTE, weights_of(blank(MATTE), MATTE)) == ("none", "from several sides")
