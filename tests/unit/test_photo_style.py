"""Styles like a photograph: lamps that are known light the app's own heads, and are found again."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from app.core.base.errors import StyleError
from app.core.faces.light_from_face import FaceLight, Unread
from app.core.faces.pose import HeadPose
from app.core.painting.photo_style import photo_lamps, photo_style
from app.core.painting.user_style import UserStyle, prepare_user_style, solve_user_styles
from app.core.solver.transport import Transport
from app.core.styles.lamps import AS_PUBLISHED, studio_light
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from app.words.styles import photo_note, photo_title
from tests.helpers.cases import sample_first
from tests.unit.test_faces import Floats, lamp, portrait, read, shown_in

KEY = FaceLight(HeadPose(0.0, 0.0, 0.0, np.eye(3)), 50.0, 20.0, "front", 7.0, 20.0)


@cache
def head() -> tuple[StylePack, Transport]:
    pack = load_named_pack("generic")
    return pack, load_transport_of(pack, "generic")


def made(light: FaceLight, title: str = "") -> UserStyle:
    return photo_style(
        light, *head(), "Anna", title or photo_title("Anna"), photo_note(photo_lamps(light))
    )


def beside_fill(azimuth_deg: float, elevation_deg: float, ratio: float | None) -> Floats:
    """A black place with a lamp and a frontal fill, each as bright to a meter as it says."""
    rows = np.cos(np.radians(90 - 180 * (np.arange(256) + 0.5) / 256))[:, None, None]
    key, fill = lamp(azimuth_deg, elevation_deg), lamp(0.0, 0.0, 90.0)
    whole = key / (key * rows).sum()
    if ratio is not None:
        # Of a lamp 90 degrees wide a meter sees 0.854 of what one far away would be.
        whole = whole + fill / (fill * rows).sum() / 0.854 / (ratio - 1)
    return np.asarray(whole * 1e5, np.float32)


def turn_in_room(style: UserStyle, *lamps: StyleLamp) -> float:
    """Turn in a dark room that has nothing but these lamps where they are at turn 0."""
    room = studio_light(Style("", "", "none", "", "", lamps), AS_PUBLISHED, (32, 64))
    (found,) = solve_user_styles(head()[1], [style], room)
    assert found.attainable
    return found.turn_refined_deg


def test_lamps_stand_where_they_were_read() -> None:
    (key,) = photo_lamps(KEY)
    assert (key.azimuth_deg, key.elevation_deg, key.diameter_deg) == (50.0, 20.0, 20.0)
    key, fill = photo_lamps(replace(KEY, fill_ratio=4.0))
    assert (fill.azimuth_deg, fill.elevation_deg, fill.diameter_deg) == (0.0, 0.0, 90.0)
    assert (key.power + fill.power) / fill.power == pytest.approx(4.0)


def test_a_place_with_the_same_lamp_needs_no_turn() -> None:
    own = made(KEY)
    assert turn_in_room(own, *photo_lamps(KEY)) == pytest.approx(0.0, abs=3.0)
    # The same lamp 30 degrees farther to the sitter's left: turning there is counter-clockwise.
    moved = replace(photo_lamps(KEY)[0], azimuth_deg=80.0)
    assert turn_in_room(own, moved) == pytest.approx(-30.0, abs=4.0)


@pytest.mark.parametrize("name", sample_first(["female", "male"], 1))
@pytest.mark.parametrize(("azimuth", "elevation"), [(50, 20), (-65, 35), (-35, 0)])
@pytest.mark.parametrize("ratio", [None, 2.0])
def test_a_rendered_head_leads_to_its_lamp(
    name: str, azimuth: float, elevation: float, ratio: float | None
) -> None:
    light = read(shown_in(name, beside_fill(azimuth, elevation, ratio)))
    style = made(light)
    assert style.side == ("left" if azimuth > 0 else "right")
    true = photo_lamps(
        replace(light, azimuth_deg=azimuth, elevation_deg=elevation, fill_ratio=ratio)
    )
    assert abs(turn_in_room(style, *true)) < 12.0


def test_fill_is_told_from_none() -> None:
    alone = read(portrait("male", 60.0, 15.0))
    assert alone.fill_ratio is None
    filled = read(shown_in("male", beside_fill(60.0, 15.0, 2.0)))
    assert filled.fill_ratio is not None
    assert filled.azimuth_deg == pytest.approx(60.0, abs=12.0)


def test_only_the_face_counts() -> None:
    pack, transport = head()
    asked = prepare_user_style(transport, made(KEY))
    region = pack.region_on(transport)
    assert not asked.weights.active[region < 0.5].any()
    assert asked.weights.active[region >= 0.5].all()


def test_title_side_and_note() -> None:
    style = made(replace(KEY, fill_ratio=8.0))
    assert (style.title, style.side, style.head) == ("Like Anna", "left", "generic")
    assert "50° to the sitter’s left (camera right), 20° up" in style.note
    assert style.note.endswith("frontal fill, 8:1.")
    assert photo_note(photo_lamps(KEY)).endswith("no fill.")
    assert made(KEY, "  My\nlight ").title == "My light"


@pytest.mark.parametrize(
    ("light", "words"),
    [
        (replace(KEY, key="behind", azimuth_deg=None, elevation_deg=None), "behind"),
        (FaceLight(KEY.pose, reason=Unread.FLAT), "flat"),
    ],
)
def test_what_was_not_read_is_refused(light: FaceLight, words: str) -> None:
    with pytest.raises(StyleError, match=words) as refused:
        made(light)
    assert refused.value.hint


def test_flat_light_and_light_from_behind_are_refused() -> None:
    even = read(shown_in("generic", np.ones((64, 128, 3), np.float32)))
    for light in (even, read(portrait("generic", 115.0, 15.0))):
        with pytest.raises(StyleError):
            made(light)


def test_a_profile_is_refused() -> None:
    light = read(portrait("generic", 50.0, 20.0))
    aside = FaceLight(replace(light.pose, yaw_deg=70.0), reason=Unread.PROFILE)
    with pytest.raises(StyleError, match="side"):
        made(aside)
