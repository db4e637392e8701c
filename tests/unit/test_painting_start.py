"""Starting points: the weights of eq. 6 on the canvas, exact on the head's own pixels."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.errors import StyleError
from app.core.painting.canvas import (
    blank,
    canvas_size,
    from_style,
    from_weights,
    head_values,
    make_canvas,
    resized,
    weights_of,
)
from app.core.painting.painting_session import PaintSession
from app.core.solver.solve import solve_all
from app.core.solver.weights import target_weights
from app.core.styles.styles import NAMES
from tests.helpers.painted import solve_painted
from tests.helpers.shipped import generic_pack, generic_transport
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment, synthetic_pack


def _weights(name: str) -> np.ndarray:
    target = (
        generic_pack().target(name).reshape(-1, 3)[generic_transport().pixels].astype(np.float64)
    )
    luminance = target @ np.asarray(generic_transport().header.luminance_weights)
    return target_weights(luminance, generic_transport().face)


@pytest.mark.parametrize("name", NAMES)
def test_canvas_averages_to_eq_6(name: str) -> None:
    canvas = from_style(generic_pack(), generic_transport(), name)
    assert canvas.size == 400
    values, ignored = head_values(canvas, generic_transport())
    np.testing.assert_allclose(
        values[generic_transport().face], _weights(name)[generic_transport().face], atol=1e-6
    )
    assert not ignored.any()
    assert np.abs(canvas.weights).max() <= 1
    assert not canvas.touched


def test_canvas_is_smooth_where_the_head_is() -> None:
    """Ramps come out as ramps, not as the head's blocks of pixels."""
    transport = lambert_sphere_transport()
    x = transport.pixels % transport.size
    canvas = from_weights(transport, (x - transport.size / 2) / transport.size)
    row = canvas.weights[canvas.size // 2, canvas.size // 3 : -canvas.size // 3]
    steps = np.diff(row) * canvas.size
    np.testing.assert_allclose(steps, 1.0, atol=1e-3)


def test_left_and_right_are_mirrors() -> None:
    one = from_style(generic_pack(), generic_transport(), "left-rembrandt").weights
    two = from_style(generic_pack(), generic_transport(), "right-rembrandt").weights
    face = resized(generic_pack().coverage.astype(np.float32), len(one)) > 0.99
    np.testing.assert_allclose(one[face], two[:, ::-1][face], atol=1e-6)


def test_brighter_is_on_the_sitters_left_in_a_left_style() -> None:
    canvas = from_style(generic_pack(), generic_transport(), "left-split")
    assert canvas.weights[150:250, 240:280].mean() > 0.1  # picture's right
    assert canvas.weights[150:250, 120:160].mean() < -0.1


def test_a_start_answers_like_the_style_itself() -> None:
    light = lamp_environment(30.0, 30.0, fill=0.05)
    result = solve_painted(
        generic_transport(),
        weights_of(
            from_style(generic_pack(), generic_transport(), "left-loop"), generic_transport()
        ),
        light,
    )
    style = solve_all(generic_pack(), light, styles=["left-loop"])[0]
    # Painted weights are judged wherever they are painted, the style over the face.
    shares = [one.quality_curve / np.ptp(one.quality_curve) for one in (result, style)]
    np.testing.assert_allclose(shares[0], shares[1], atol=0.01)
    assert result.turn_refined_deg == pytest.approx(style.turn_refined_deg, abs=6.0)
    direct = PaintSession(
        generic_transport(), from_style(generic_pack(), generic_transport(), "left-loop")
    )
    np.testing.assert_allclose(direct.weights.weights, _weights("left-loop"), atol=1e-6)


def test_what_does_not_fit_is_refused() -> None:
    transport = lambert_sphere_transport()
    with pytest.raises(StyleError, match="a different head"):
        from_style(synthetic_pack(20, (16, 32)), transport, "butterfly")
    with pytest.raises(StyleError, match="no target"):
        from_style(synthetic_pack(), transport, "disco")
    with pytest.raises(StyleError, match="do not fit"):
        from_weights(transport, np.zeros(3))
    for bad in (np.zeros((20, 30)), np.full((20, 20), np.nan), np.zeros((4, 4))):
        with pytest.raises(StyleError, match="square"):
            make_canvas(bad)


def test_blank_is_blank() -> None:
    canvas = blank(generic_transport())
    assert canvas.size == canvas_size(generic_transport()) == 400
    assert not canvas.weights.any()
    assert not canvas.touched


def test_layers_of_another_size_keep_their_averages() -> None:
    rng = np.random.default_rng(0)
    layer = rng.uniform(-1, 1, (400, 400)).astype(np.float32)
    small = resized(layer, 100)
    np.testing.assert_allclose(small, layer.reshape(100, 4, 100, 4).mean(axis=(1, 3)), atol=1e-6)
    odd = make_canvas(layer[:390, :390])
    values, _ = head_values(odd, generic_transport())
    assert values.shape == generic_transport().pixels.shape
