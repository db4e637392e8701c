"""The lighting ratio, held against a spot meter on the rendered face and against known lamps."""

from __future__ import annotations

import math
from functools import cache
from typing import TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import luminance
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce
from app.core.portrait.ratio_and_glare import (
    DEEPEST_STOPS,
    EVEN_STOPS,
    cheeks,
    lighting_ratio,
)
from app.core.solver.solve import solve_all
from app.core.solver.transport import Transport, load_named, render, to_image
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.words.portrait.face_light import key_fill, ratio_sentence
from tests.helpers.looks import landmarks
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment, lamp_target

Floats: TypeAlias = NDArray[np.float64]

BAR = 0.3
HEADS = ("generic", "female", "male", "generic-light", "generic-dark")
SCENES = sorted((resources() / "demo" / "scenes").glob("*.exr"))
# Where a photographer holds a spot meter of 1 degree (31 mm across at 1.8 m): on the cheek, give or
# take some millimetres; in half eye distances from the middle line and from the eyes.
SPOTS = ((1.2, 1.3), (1.1, 1.2), (1.3, 1.2), (1.1, 1.4), (1.3, 1.4))
SPOT_RADIUS = 0.53


@cache
def transport_of(head: str) -> Transport:
    return load_named(head)


@cache
def pack_of(head: str) -> StylePack:
    return load_named_pack(head)


def spot_meter(picture: NDArray[np.float32], head: str) -> float:
    """Stops between the cheeks, the sitter's left over right: the middle of five readings."""
    light = luminance(picture).astype(np.float64)
    at = landmarks(head.partition("-")[0], light.shape[0])
    rows, columns = np.indices(light.shape) + 0.5
    x, y = (columns - at.middle) / at.half, (rows - at.eyes) / at.half
    readings = []
    for across, down in SPOTS:
        left, right = (
            float(light[np.hypot(x - sign * across, y - down) < SPOT_RADIUS].mean())
            for sign in (1.0, -1.0)
        )
        readings.append(math.log2(max(left, 1e-9) / max(right, 1e-9)))
    return float(np.median(readings))


def signed(picture: NDArray[np.float32], transport: Transport) -> float:
    flat = picture.reshape(-1, 3)[transport.pixels]
    ratio = lighting_ratio(transport, flat)
    left, right = (luminance(flat)[area].mean() for area in cheeks(transport))
    return ratio.stops if left >= right else -ratio.stops


def agrees(measured: float, direct: float) -> bool:
    if abs(direct) > DEEPEST_STOPS:
        # Shadows with nothing in them: how black they are is noise.
        return measured * direct > 0 and abs(measured) > DEEPEST_STOPS - 0.5
    return abs(measured - direct) <= BAR


@pytest.mark.parametrize("head", HEADS)
def test_targets_of_all_styles_read_as_by_a_spot_meter(head: str) -> None:
    transport, pack = transport_of(head), pack_of(head)
    wrong = {}
    for style in pack.styles:
        if style.title == "Rim":
            continue
        picture = pack.target(style.name)
        measured, direct = signed(picture, transport), spot_meter(picture, head)
        if not agrees(measured, direct):
            wrong[style.name] = (round(measured, 2), round(direct, 2))
    assert not wrong


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize("name", ["left-rim", "right-rim"])
def test_a_rim_alone_leaves_both_cheeks_in_shadow(head: str, name: str) -> None:
    transport = transport_of(head)
    flat = pack_of(head).target(name).reshape(-1, 3)[transport.pixels]
    light = luminance(flat)
    assert max(float(light[area].mean()) for area in cheeks(transport)) < 0.006 * float(
        np.percentile(light[transport.face], 99.0)
    )
    ratio = lighting_ratio(transport, flat)
    assert ratio.key_side == "none"
    assert ratio.lit == "face"


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_demo_scenes_read_as_by_a_spot_meter(scene: object) -> None:
    transport, pack = transport_of("generic"), pack_of("generic")
    environment = read_environment(str(scene))
    results = solve_all(pack, luminance(reduce(environment)))
    for result in results:
        light = reduce(environment, turn_deg=result.turn_refined_deg)
        picture = to_image(transport, render(transport, light))
        measured, direct = signed(picture, transport), spot_meter(picture, "generic")
        assert abs(measured - direct) <= BAR, (result.name, measured, direct)


@pytest.mark.parametrize("power", [1.5, 2.0, 4.0, 8.0])
def test_two_lamps_of_known_power(power: float) -> None:
    # Lamps mirrored to each other: exchanging them exchanges the cheeks, so that the ratio is
    # (p a + b) / (a + p b), with a and b what one lamp gives the near and the far cheek.
    transport = lambert_sphere_transport(64)
    near, far = cheeks(transport)
    one = luminance(lamp_target(transport, ((70.0, 0.0, 1.0),)))
    a, b = float(one[near].mean()), float(one[far].mean())
    both = lamp_target(transport, ((70.0, 0.0, power), (-70.0, 0.0, 1.0)))
    ratio = lighting_ratio(transport, both)
    assert ratio.key_side == "left"
    assert ratio.stops == pytest.approx(math.log2((power * a + b) / (a + power * b)), abs=0.05)
    # Each cheek of this head sees little of the far lamp: nearly the ratio of the powers.
    assert ratio.stops == pytest.approx(math.log2(power), abs=0.3)


def test_key_plus_fill_over_fill() -> None:
    # Even fill, and a key that reaches one cheek only: (key + fill) / fill = 4 is two stops.
    transport = lambert_sphere_transport(64)
    near, far = cheeks(transport)
    key = luminance(lamp_target(transport, ((100.0, 0.0, 1.0),)))
    fill = luminance(render(transport, np.ones((32, 64, 3), np.float32)))
    assert float(key[far].max()) < 0.02 * float(key[near].mean())
    gain = 3.0 * float(fill[near].mean()) / float(key[near].mean())
    ratio = lighting_ratio(transport, fill + gain * key)
    assert ratio.stops == pytest.approx(2.0, abs=0.15)
    assert ratio_sentence(ratio).endswith(
        "(key plus fill : fill), key on the sitter’s left (camera right)"
    )


@pytest.mark.parametrize("head", HEADS)
def test_uniform_light_has_no_ratio(head: str) -> None:
    transport = transport_of(head)
    ratio = lighting_ratio(transport, render(transport, np.ones((32, 64, 3), np.float32)))
    assert ratio.stops < 0.01
    assert (ratio.key_side, key_fill(ratio.stops)) == ("none", "1:1")
    assert "both cheeks alike" in ratio_sentence(ratio)


def test_a_lamp_on_the_sitters_right_is_the_mirror_image() -> None:
    transport = transport_of("generic")
    light = lamp_environment(40.0, 30.0, fill=0.3)
    right, left = (
        lighting_ratio(
            transport, render(transport, np.repeat(sky[..., None], 3, axis=2).astype(np.float32))
        )
        for sky in (light, light[:, ::-1])
    )
    # Panorama azimuth 40 is to the sitter's right when the sitter faces 0.
    assert (right.key_side, left.key_side) == ("right", "left")
    assert right.stops == pytest.approx(left.stops, abs=0.01)


def test_exposure_does_not_matter() -> None:
    transport = lambert_sphere_transport(48)
    picture = lamp_target(transport, ((50.0, 20.0, 1.0),)) + np.float32(0.05)
    stops = [lighting_ratio(transport, picture * gain).stops for gain in (1e-6, 1.0, 1e6)]
    assert stops == pytest.approx([stops[1]] * 3, abs=1e-3)


def test_a_highlight_on_one_cheek_does_not_count() -> None:
    transport = transport_of("generic")
    picture = render(transport, np.ones((32, 64, 3), np.float32))
    left, _ = cheeks(transport)
    picture[left[: len(left) // 7]] *= 50.0
    assert lighting_ratio(transport, picture).stops < EVEN_STOPS


def test_darkness_and_bad_pictures() -> None:
    transport = lambert_sphere_transport(48)
    count = len(transport.pixels)
    dark = lighting_ratio(transport, np.zeros((count, 3), np.float32))
    assert (dark.stops, dark.key_side, dark.lit) == (0.0, "none", "none")
    rim = np.zeros(count, np.float32)
    rim[0] = 1.0
    assert lighting_ratio(transport, rim).lit == "face"
    with pytest.raises(ValueError, match="pixels"):
        lighting_ratio(transport, np.zeros((count + 1, 3)))
    with pytest.raises(ValueError, match="finite"):
        lighting_ratio(transport, np.full(count, np.nan))


@pytest.mark.parametrize(
    ("stops", "words"),
    [(0.0, "1:1"), (1.0, "2:1"), (1.27, "2.4:1"), (2.0, "4:1"), (3.3, "9.8:1"), (5.0, "32:1")],
)
def test_key_fill_rounds_as_photographers_do(stops: float, words: str) -> None:
    assert key_fill(stops) == words


def test_deep_shadows_have_no_number() -> None:
    transport, pack = transport_of("generic"), pack_of("generic")
    target = pack.target("right-split").reshape(-1, 3)[transport.pixels]
    ratio = lighting_ratio(transport, target)
    assert ratio_sentence(ratio) == (
        "more than 5 stops, over 32:1 (key plus fill : fill), "
        "key on the sitter’s right (camera left); no fill on the other cheek"
    )
