"""Portraits at full size: against the transport, which stock Mitsuba bears out, and by symmetry."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from app.core.base.archive import write_sealed
from app.core.base.colour import luminance
from app.core.base.errors import TransportError
from app.core.measure.finish.findings import Findings, find
from app.core.measure.finish.lamp_detection import Source
from app.core.portrait.catchlights import catchlights
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.light import lamps_light, portrait_light
from app.core.portrait.portrait_file import load_portrait
from app.core.portrait.portrait_head import (
    CLOSE_COLUMNS,
    CLOSE_ROWS,
    ROOM,
    PortraitHead,
    PortraitSkin,
)
from app.core.solver.transport import load_named, render, to_image
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp
from app.core.styles.style_pack_file import load_named_pack
from app.words.portrait.face_light import catchlight_words
from scenes.portraits.files import save_head
from tests.helpers.cases import sample_first

ROWS, COLUMNS = 128, 256
HEADS = [("generic", "medium"), ("generic", "light"), ("generic", "dark")]
HEADS += [("female", "medium"), ("male", "medium")]


@pytest.fixture(scope="module")
def generic() -> tuple[PortraitHead, PortraitSkin]:
    found = load_portrait("generic", "medium")
    assert found is not None
    return found


def lamps_in(lamps: list[StyleLamp]) -> Findings:
    """What the list of lamps says of a studio."""
    light = np.sum([far_lamp(lamp, (256, 512)) for lamp in lamps], axis=0)
    return find(np.repeat(light[..., None], 3, axis=2).astype(np.float32))


def dressed(hair: str) -> tuple[PortraitHead, PortraitSkin]:
    found = load_portrait("generic", "medium", hair)
    assert found is not None
    return found


def soft_sky(azimuth: float) -> np.ndarray:
    """A wide bright side, a dim rest, brighter above: what T's texels hold without a loss."""
    up = np.pi / 2 - (np.arange(ROWS) + 0.5)[:, None] / ROWS * np.pi
    round_ = ((np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5) * 2 * np.pi - math.radians(azimuth)
    side = np.exp(2.5 * (np.cos(up) * np.cos(round_) - 1))
    sky = side + 0.15 + 0.2 * np.maximum(np.sin(up), 0)
    return np.asarray(sky[..., None] * [1.0, 0.9, 0.8], np.float32)


def as_transport(picture: np.ndarray, size: int) -> np.ndarray:
    """The part of a portrait that a transport's picture shows, in its pixels."""
    rows = picture.shape[0]
    side = rows / ROOM
    corners = np.array([[1, 0, (rows - side) / 2], [0, 1, rows - side]], np.float32)
    whole = cv2.warpAffine(
        picture, corners, (round(side), round(side)), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return np.asarray(cv2.resize(whole, (size, size), interpolation=cv2.INTER_AREA))


@pytest.mark.parametrize(("head", "skin"), HEADS)
@pytest.mark.parametrize("azimuth", sample_first([60.0, 0.0, -110.0], 1))
def test_it_agrees_with_the_transport_in_soft_light(head: str, skin: str, azimuth: float) -> None:
    portrait = load_portrait(head, skin)
    assert portrait is not None
    name = head if skin == "medium" else f"{head}-{skin}"
    transport, sky = load_named(name), soft_sky(azimuth)
    small = np.asarray(cv2.resize(sky, (64, 32), interpolation=cv2.INTER_AREA), np.float32)
    wanted = to_image(transport, render(transport, small))
    found = as_transport(portrait_picture(*portrait, portrait_light(sky), 0.0), transport.size)
    whole = np.zeros(transport.size**2, bool)
    whole[transport.pixels[transport.coverage > 0.999]] = True
    whole = cv2.erode(whole.reshape(100, 100).astype(np.uint8), np.ones((3, 3))) > 0
    np.testing.assert_allclose(found[whole].mean(0), wanted[whole].mean(0), rtol=0.03)
    face = whole.copy()
    face[:25], face[83:], face[:, :26], face[:, 74:] = False, False, False, False
    away = np.sqrt(((found - wanted)[face] ** 2).mean() / (wanted[face] ** 2).mean())
    assert away < 0.06


@pytest.mark.parametrize(("head", "skin"), HEADS)
def test_it_agrees_with_the_targets_of_all_styles(head: str, skin: str) -> None:
    """Lamps of 8 to 52 deg, from all sides: shadows and rims of light are where T has them."""
    found = load_portrait(head, skin)
    assert found is not None
    pack = load_named_pack(head if skin == "medium" else f"{head}-{skin}")
    shown = pack.coverage > 0.999
    for style in pack.styles:
        ours = portrait_picture(*found, lamps_light(style.lamps), 0.0)
        mine, theirs = (
            luminance(one)[shown]
            for one in (as_transport(ours, len(shown)), np.asarray(pack.target(style.name)))
        )
        # Targets have brightnesses of their own.
        mine = mine * float((mine * theirs).sum() / (mine**2).sum())
        error = math.sqrt(float(((mine - theirs) ** 2).mean() / (theirs**2).mean()))
        # Of a silhouette a line of light is left, as wide as two of T's pixels.
        assert error < (0.2 if style.name == "silhouette" else 0.1), (style.name, error)


def test_a_mirrored_panorama_gives_the_mirrored_portrait(
    generic: tuple[PortraitHead, PortraitSkin],
) -> None:
    sky = soft_sky(70.0)
    sky[40:42, 100:102] = 300
    one = portrait_picture(*generic, portrait_light(sky), 0.0)
    other = portrait_picture(*generic, portrait_light(sky[:, ::-1]), 0.0)
    np.testing.assert_allclose(one[:, ::-1], other, rtol=2e-3, atol=2e-3 * float(one.mean()))


@pytest.mark.parametrize("azimuth", range(-180, 180, 30))
def test_nothing_is_negative_in_hard_sun(
    generic: tuple[PortraitHead, PortraitSkin], azimuth: int
) -> None:
    sun = StyleLamp(float(azimuth), 35.0, 0.53, 1.0, 9.0)
    picture = portrait_picture(*generic, lamps_light([sun]), 0.0)
    assert picture.min() >= 0
    assert np.isfinite(picture).all()


@pytest.mark.parametrize("hair", ["plain", "short"])
def test_small_pictures_show_every_second_pixel(hair: str) -> None:
    """Hair is averaged instead: what lies under it is compared where there is none."""
    head, skin = dressed(hair)
    light = lamps_light([StyleLamp(40.0, 25.0, 8.0, 1.0, 3.0)])
    whole = portrait_picture(head, skin, light, 0.0)
    small, close = (portrait_picture(one, skin, light, 0.0) for one in (head.halved, head.close))
    bare = np.ones(head.inside.shape, bool)
    if head.hair is not None:
        bare.flat[head.hair.pixel] = False
    bare = cv2.erode(bare.astype(np.uint8), np.ones((3, 3))) > 0
    left = (bare & head.inside)[::2, ::2]
    np.testing.assert_allclose(small[:, :160][left], whole[::2, :320:2][left], rtol=1e-4, atol=1e-7)
    rows, half = round(CLOSE_ROWS * 320), round(CLOSE_COLUMNS * 160)
    kept = (slice(0, rows), slice(160 - half, 160 + half))
    np.testing.assert_allclose(close[kept], small[kept], rtol=1e-4, atol=1e-7)
    assert not close[rows:].any()


def test_light_adds_up(generic: tuple[PortraitHead, PortraitSkin]) -> None:
    one, other = (StyleLamp(a, 20.0, 10.0, 1.0, 2.0) for a in (-50.0, 80.0))
    parts = [portrait_picture(*generic, lamps_light([lamp]), 0.0) for lamp in (one, other)]
    both = portrait_picture(*generic, lamps_light([one, other]), 0.0)
    np.testing.assert_allclose(parts[0] + parts[1], both, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize(
    ("azimuth", "elevation", "clock"), [(-45.0, 30.0, 10.2), (45.0, 30.0, 1.8), (0.0, 35.0, 0.0)]
)
def test_a_lamp_in_front_is_one_catchlight_where_a_ball_would_show_it(
    generic: tuple[PortraitHead, PortraitSkin], azimuth: float, elevation: float, clock: float
) -> None:
    """On a mirror ball the spot lies towards the half-way direction between lens and lamp."""
    lamp = StyleLamp(azimuth, elevation, 10.0, 3.0, 2.0)
    light = lamps_light([lamp])
    picture = portrait_picture(*generic, light, 0.0)
    found = catchlights(generic[0], light, picture, 0.0, lamps_in([lamp]))
    for eye in ("left", "right"):
        (one,) = [each for each in found if each.eye == eye]
        assert abs((one.clock - clock + 6) % 12 - 6) < 0.8
        assert one.what == "lamp"
    assert catchlight_words(found).startswith("One catchlight")


@pytest.mark.parametrize("kind", ["sun", "lamp", "window", "wall"])
def test_catchlight_has_the_name_and_letter_of_its_lamp(
    generic: tuple[PortraitHead, PortraitSkin], kind: Source
) -> None:
    lamps = [StyleLamp(azimuth, 35.0, 8.0, 1.0, 2.0) for azimuth in (10.0, 170.0)]
    light = lamps_light(lamps)
    found = lamps_in(lamps)
    # Azimuths of a style grow towards the sitter's left, those of a panorama towards the right.
    (front,) = [lamp for lamp in found.lamps if abs(lamp.azimuth_deg + 10.0) < 5.0]
    named = tuple(replace(one, kind=kind) if one is front else one for one in found.lamps)
    picture = portrait_picture(*generic, light, 0.0)
    seen = catchlights(generic[0], light, picture, 0.0, replace(found, lamps=named))
    assert {(one.what, one.letter) for one in seen} == {(kind, front.letter)}
    assert catchlight_words(seen).endswith(f"({front.letter})")


def test_catchlight_of_the_lower_part_of_a_window_is_the_window(
    generic: tuple[PortraitHead, PortraitSkin],
) -> None:
    radiance = np.full((256, 512, 3), 0.02, np.float32)
    # From 24° above the horizon to 30° below, its lower part the brighter one.
    radiance[94:128, 280:310] = 2.0
    radiance[128:171, 280:310] = 6.0
    light = portrait_light(radiance)
    picture = portrait_picture(*generic, light, 28.0)
    seen = catchlights(generic[0], light, picture, 28.0, find(radiance))
    assert {one.what for one in seen} == {"window"}


def test_light_from_behind_leaves_the_eyes_dead(
    generic: tuple[PortraitHead, PortraitSkin],
) -> None:
    light = lamps_light([StyleLamp(160.0, 20.0, 12.0, 3.0, 2.0)])
    picture = portrait_picture(*generic, light, 0.0)
    assert catchlights(generic[0], light, picture, 0.0, Findings()) == ()
    assert catchlight_words(())


def test_a_file_that_contradicts_itself_is_refused(
    generic: tuple[PortraitHead, PortraitSkin], monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    from dataclasses import replace
    from pathlib import Path

    folder = Path(str(tmp_path))
    (folder / "portraits").mkdir()
    # Packing it as small as what ships takes most of a minute on a slow machine.
    monkeypatch.setattr(
        "scenes.portraits.files.write_sealed",
        lambda path, arrays, facts, **_: write_sealed(path, arrays, facts),
    )
    bad = replace(generic[0], detail=generic[0].detail[:-1])
    save_head(folder / "portraits" / "odd.npz", bad)
    (folder / "portraits" / "odd-medium.npz").write_bytes(b"PK")
    monkeypatch.setattr("app.core.portrait.portrait_file.resources", lambda: folder)
    with pytest.raises(TransportError, match="inconsistent"):
        load_portrait("odd", "medium")
    assert load_portrait("none", "medium") is None
