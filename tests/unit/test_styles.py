"""Built-in styles, their mirror images, and style files written by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.core.base.errors import StyleError
from app.core.base.paths import resources
from app.core.styles import styles
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_file import read_style
from app.words.phrases.directions import SIDES
from app.words.styles import full_title, side_words

GOOD = """
title = "Broad"
side = "left"
note = "A wide key."

[[lamps]]
azimuth_deg = 40
elevation_deg = 30.5
diameter_deg = 12.0
power = 1.0
distance_m = 2.0
"""

KEY_LAMPS = {
    "butterfly": (0.0, 45.0),
    "flat": (0.0, 5.0),
    "top": (0.0, 80.0),
    "below": (0.0, -45.0),
    "left-loop": (35.0, 35.0),
    "left-split": (90.0, 10.0),
    "left-rim": (135.0, 20.0),
    "left-below-side": (50.0, -40.0),
    "left-rembrandt": (50.0, 45.0),
}


@pytest.fixture(scope="module")
def built_in() -> dict[str, Style]:
    """Every built-in style by name."""
    return {style.name: style for style in styles.load_styles()}


def write(folder: Path, text: str, name: str = "mine") -> Path:
    """Write a style file."""
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_all_styles_are_there_in_order(built_in: dict[str, Style]) -> None:
    assert tuple(built_in) == styles.NAMES
    assert {name for name, style in built_in.items() if style.paper} == set(styles.PAPER_NAMES)
    assert len(styles.PAPER_NAMES) == 16
    files = {path.stem for path in (resources() / "styles").glob("*.toml")}
    # Of a pair only the left one is written down.
    assert files == {name for name in styles.NAMES if not name.startswith("right-")}


@pytest.mark.parametrize("name", styles.NAMES)
def test_left_and_right_are_exact_mirrors(name: str, built_in: dict[str, Style]) -> None:
    style = built_in[name]
    twin = built_in[styles.mirror_name(name)]
    mirrored = styles.mirror(style)
    assert mirrored.name == twin.name
    assert mirrored.side == twin.side
    assert mirrored.title == twin.title
    assert mirrored.note == twin.note
    assert mirrored.place == twin.place
    # As a set: which lamp of badger is named first means nothing.
    assert set(mirrored.lamps) == set(twin.lamps)
    assert styles.mirror(mirrored) == style


@pytest.mark.parametrize("name", KEY_LAMPS)
def test_single_lamps_stand_near_the_studio_definitions(
    name: str, built_in: dict[str, Style]
) -> None:
    (lamp,) = built_in[name].lamps
    azimuth, elevation = KEY_LAMPS[name]
    assert lamp.azimuth_deg == pytest.approx(azimuth, abs=10.0)
    assert lamp.elevation_deg == pytest.approx(elevation, abs=10.0)


def test_lamps_of_two_lamp_styles(built_in: dict[str, Style]) -> None:
    left, right = built_in["badger"].lamps
    assert (left.power, left.elevation_deg) == (right.power, right.elevation_deg)
    assert left.azimuth_deg == -right.azimuth_deg
    key, rim = built_in["left-loop-rim"].lamps
    assert key.azimuth_deg > 0 > rim.azimuth_deg
    assert abs(rim.azimuth_deg) > 90
    above, below = built_in["clamshell"].lamps
    assert above.elevation_deg > 0 > below.elevation_deg
    assert above.power > below.power


def test_every_lamp_is_far_enough_and_every_style_can_be_named(
    built_in: dict[str, Style],
) -> None:
    for style in built_in.values():
        assert style.note.endswith(".")
        assert side_words(style)
        assert all(lamp.distance_m >= 2.0 for lamp in style.lamps)
    assert len({full_title(style) for style in built_in.values()}) == len(styles.NAMES)


def test_side_is_named_twice(built_in: dict[str, Style]) -> None:
    assert side_words(built_in["left-loop"]) == SIDES["left"]
    assert full_title(built_in["right-loop"]) == f"Loop, {SIDES['right']}"
    assert side_words(built_in["top"]) == "from overhead"
    assert full_title(built_in["top"]) == "Top"


def test_direction_is_in_the_head_frame() -> None:
    lamp = StyleLamp(90.0, 0.0, 10.0, 1.0, 2.0)
    np.testing.assert_allclose(lamp.direction, (1.0, 0.0, 0.0), atol=1e-12)
    lamp = StyleLamp(0.0, 45.0, 10.0, 1.0, 2.0)
    np.testing.assert_allclose(lamp.direction, (0.0, math.sqrt(0.5), math.sqrt(0.5)))


def test_mirroring_keeps_zero_and_the_back() -> None:
    lamps = (StyleLamp(0.0, 5.0, 9.0, 1.0, 2.0), StyleLamp(180.0, 5.0, 9.0, 1.0, 2.0))
    style = Style("x", "X", "none", "around", "", lamps)
    assert styles.mirror(style).lamps == lamps
    assert math.copysign(1.0, styles.mirror(style).lamps[0].azimuth_deg) == 1.0


def test_a_users_style_follows_the_built_in_ones(tmp_path: Path) -> None:
    write(tmp_path, GOOD, "broad")
    loaded = styles.load_styles(tmp_path)
    assert [style.name for style in loaded] == [*styles.NAMES, "broad"]
    assert loaded[-1].lamps == (StyleLamp(40.0, 30.5, 12.0, 1.0, 2.0),)
    assert not loaded[-1].paper
    assert styles.load_styles(tmp_path / "missing") == styles.load_styles()


def test_a_style_file_may_name_its_bands_as_earlier_versions_did(tmp_path: Path) -> None:
    file = resources() / "styles" / "left-loop.toml"
    former = write(tmp_path, file.read_text("utf-8").replace("soft =", "nearly ="))
    assert "nearly =" in former.read_text("utf-8")
    assert read_style(former).signature == read_style(file).signature


def test_a_users_style_cannot_take_a_built_in_name(tmp_path: Path) -> None:
    write(tmp_path, GOOD, "flat")
    with pytest.raises(StyleError, match="name of a built-in style"):
        styles.load_styles(tmp_path)


def test_too_many_user_styles_are_refused(tmp_path: Path) -> None:
    for index in range(201):
        write(tmp_path, GOOD, f"mine-{index}")
    with pytest.raises(StyleError, match="201 styles; the limit is 200"):
        styles.load_styles(tmp_path)


def test_azimuth_minus_180_is_180(tmp_path: Path) -> None:
    style = read_style(write(tmp_path, GOOD.replace("= 40", "= -180")))
    assert style.lamps[0].azimuth_deg == 180.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("title =", "titel =", "unknown key 'titel'.*Valid names: title"),
        ("power =", "watts =", "lamp 1: unknown key 'watts'"),
        ("power = 1.0", "", "lamp 1: power is missing"),
        ("power = 1.0", "power = 0.0", "power = 0 must be between"),
        ("power = 1.0", "power = true", "power must be a finite number"),
        ("power = 1.0", 'power = "1"', "power must be a finite number"),
        ("power = 1.0", "power = nan", "power must be a finite number"),
        ("power = 1.0", "power = inf", "power must be a finite number"),
        ("distance_m = 2.0", "distance_m = 1.99", "distance_m = 1.99 must be between 2"),
        ("= 30.5", "= 91", "elevation_deg = 91 must be between"),
        ("= 40", "= -181", "azimuth_deg = -181 must be between"),
        ('"left"', '"up"', "side must be left, right or none, not 'up'"),
        ('"left"', "3", "side must be left, right or none"),
        ('side = "left"', "", "needs a place"),
        ('"Broad"', '""', "the title is missing"),
        ('"Broad"', "7", "title must be text"),
        ('"Broad"', '"' + "x" * 33 + '"', "title is longer than 32"),
        ('"A wide key."', '"\\u0007"', "cannot be displayed"),
        ("note =", "paper = 1\nnote =", "paper must be true or false"),
        ("[[lamps]]", "[lamps]", "a style needs 1 to 8"),
        ("[[lamps]]", "[[lamps]]\n" * 9, "a style needs 1 to 8|not valid TOML"),
        ("[[lamps]]", "[[lamps", "not valid TOML"),
    ],
)
def test_bad_style_files_are_refused_with_a_sentence(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert old in GOOD
    with pytest.raises(StyleError, match=words) as caught:
        read_style(write(tmp_path, GOOD.replace(old, new)))
    assert "mine.toml" in caught.value.message
    assert "\n" not in str(caught.value)


def test_bad_lamps_missing_files_and_names(tmp_path: Path) -> None:
    with pytest.raises(StyleError, match="a lamp must be a table"):
        read_style(write(tmp_path, 'title="A"\nplace="b"\nlamps=[1]'))
    with pytest.raises(StyleError, match="a style needs 1 to 8"):
        read_style(write(tmp_path, 'title="A"\nplace="b"'))
    with pytest.raises(StyleError, match="is missing"):
        read_style(tmp_path / "none.toml")
    with pytest.raises(StyleError, match="not a valid style name"):
        read_style(write(tmp_path, GOOD, "Mine Own"))
    with pytest.raises(StyleError, match="too large"):
        read_style(write(tmp_path, "#" * 65_000))
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(StyleError, match="not valid TOML"):
        read_style(tmp_path / "bytes.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(StyleError, match="cannot be read"):
        read_style(tmp_path / "folder.toml")


def test_selecting(built_in: dict[str, Style]) -> None:
    every = tuple(built_in.values())
    assert styles.select(every, None) == every
    assert styles.select(every, []) == every
    chosen = styles.select(every, ["top", "badger", "top"])
    assert [style.name for style in chosen] == ["badger", "top"]
    with pytest.raises(StyleError, match=r"no style 'left-lop'\. Did you mean left-loop"):
        styles.select(every, ["left-lop"])
    with pytest.raises(StyleError, match="'turnlight styles' lists"):
        styles.select(every, ["zzz"])
