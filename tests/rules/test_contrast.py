"""What is written can be read, and what can be pressed can be seen, in all three themes.

Contrast as WCAG 2.2 defines it (relative luminance, success criteria 1.4.3 and 1.4.11).
"""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.colour import luminance, srgb_decode
from app.ui.theme.theme import PALETTES, ThemeName

SURFACES = ("bg", "panel", "raised")

# (ink, what it stands on)
TEXTS = [
    *((ink, surface) for ink in ("text", "dim", "ok", "err") for surface in SURFACES),
    *(("amber", surface) for surface in SURFACES),
    ("onamber", "amberfill"),
    ("ontag", "tag"),
    # The Turn column in the light.
    ("text", "okfill"),
    ("dim", "okfill"),
    ("okfill", "text"),
    # On the weights stands black, which every palette has as the colour of nothing else.
    ("#000000", "plus"),
    ("#000000", "minus"),
]
EDGES = [
    *((edge, surface) for edge in ("ctl", "sel", "focus", "text") for surface in SURFACES),
    ("onamber", "amberfill"),
    ("ok", "okfill"),
]


def relative_luminance(colour: str) -> float:
    code = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    return float(luminance(srgb_decode(np.array(code, np.float32))))


def contrast(first: str, second: str) -> float:
    bright, dark = sorted((relative_luminance(first), relative_luminance(second)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


def value(palette: dict[str, str], token: str) -> str:
    return token if token.startswith("#") else palette[token]


def test_the_measure_itself() -> None:
    """White on black is 21, equal colours 1; #767676 on white is the textbook's 4.54."""
    assert contrast("#000000", "#ffffff") == pytest.approx(21, abs=1e-3)
    assert contrast("#123456", "#123456") == pytest.approx(1)
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("theme", PALETTES)
@pytest.mark.parametrize(("ink", "ground"), TEXTS)
def test_text_can_be_read(theme: ThemeName, ink: str, ground: str) -> None:
    palette = PALETTES[theme]
    assert contrast(value(palette, ink), value(palette, ground)) >= 4.5


@pytest.mark.parametrize("theme", PALETTES)
@pytest.mark.parametrize(("edge", "ground"), EDGES)
def test_control_edges_can_be_seen(theme: ThemeName, edge: str, ground: str) -> None:
    palette = PALETTES[theme]
    assert contrast(value(palette, edge), value(palette, ground)) >= 3.0


@pytest.mark.parametrize("theme", PALETTES)
def test_the_filled_part_of_a_meter_stands_out(theme: ThemeName) -> None:
    palette = PALETTES[theme]
    assert contrast(palette["text"], palette["track2"]) >= 3.0
    assert contrast(palette["text"], palette["track"]) >= 3.0


@pytest.mark.parametrize("theme", PALETTES)
def test_surfaces_are_neutral(theme: ThemeName) -> None:
    """Tone is judged beside them: equal red, green and blue."""
    palette = PALETTES[theme]
    for token in (*SURFACES, "well", "line", "ctl", "text", "dim", "dis", "track", "track2"):
        colour = value(palette, token)
        assert colour[1:3] == colour[3:5] == colour[5:7], token


def test_pictures_lie_on_the_same_grey_in_every_theme() -> None:
    assert {palette["well"] for palette in PALETTES.values()} == {"#2b2b2b"}


@pytest.mark.parametrize("theme", PALETTES)
def test_tokens_are_six_digits(theme: ThemeName) -> None:
    for token, colour in PALETTES[theme].items():
        assert len(colour) == 7, token
        int(colour[1:], 16)
