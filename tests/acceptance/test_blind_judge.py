"""What a judge of pictures says who was never told the program's rules; see `blind-judge.md`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.base.paths import resources
from app.core.solver.transport import load_named, render, to_image
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp
from app.core.styles.styles import NAMES, load_styles
from benchmarks.answers.blind_judge import Floats, compare, knows, opinion, panoramas, summary

ROOT = Path(__file__).resolve().parents[2]


KNOWN = [name for name in NAMES if knows(name)]


@pytest.fixture(scope="module")
def recorded() -> dict[str, Any]:
    text = (ROOT / "benchmarks" / "results" / "blind-judge.json").read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def _lit_by(*lamps: StyleLamp) -> Floats:
    head = load_named("generic")
    light = sum(far_lamp(lamp, head.environment_shape) for lamp in lamps)
    return to_image(head, render(head, np.asarray(light, np.float32)))


def test_each_studio_picture_shows_its_own_style_alone() -> None:
    for style in (style for style in load_styles() if knows(style.name)):
        picture = _lit_by(*style.lamps)
        assert [name for name in KNOWN if opinion(picture, name).shown] == [style.name]


@pytest.mark.parametrize(
    ("azimuth", "elevation", "style"),
    [
        (0, 30, "butterfly"),
        (25, 30, "left-loop"),
        (-25, 45, "right-loop"),
        (45, 30, "left-rembrandt"),
        (-55, 45, "right-rembrandt"),
        (80, 0, "left-split"),
        (-90, 15, "right-split"),
        (135, 15, "left-rim"),
        (0, -25, "below"),
        (-45, -45, "right-below-side"),
        (15, 75, "top"),
    ],
)
def test_single_lamps_are_named_right(azimuth: float, elevation: float, style: str) -> None:
    picture = _lit_by(StyleLamp(azimuth, elevation, 20.0, 1.0, 3.0))
    assert [name for name in KNOWN if opinion(picture, name).shown] == [style]


def test_the_first_three_demo_scenes_agree() -> None:
    """81.5 % when it was recorded; 8 of 10 is asked for."""
    scenes = panoramas([resources() / "demo" / "scenes"])[:3]
    found = summary(list(compare(scenes)))
    assert found["pairs"] == 3 * len(KNOWN)
    assert found["agree_percent"] >= 80.0


def test_the_page_says_what_was_recorded(recorded: dict[str, Any]) -> None:
    page = (ROOT / "benchmarks" / "blind-judge.md").read_text(encoding="utf-8")
    assert len(recorded["places"]) >= 20
    assert recorded["agree_percent"] >= 80.0
    assert f"{recorded['agree_percent']:.1f} % of {recorded['pairs']} pairs" in page
