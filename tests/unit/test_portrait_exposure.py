"""Portraits are exposed for the subject of their style."""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from app.core.base.arrays import Bytes
from app.core.base.colour import luminance, srgb_decode
from app.core.base.paths import resources
from app.core.environment.environment import from_radiance, read_environment
from app.core.portrait.head import Head, load_head
from app.core.solver.place_light import Facing, PlaceLight, pictures_at, prepare
from app.core.solver.solve import solve_all
from app.core.styles.lamps import AS_PUBLISHED, Studio
from app.core.styles.styles import load_styles

SIZE = (120, 96)
LABELS = Path(__file__).resolve().parents[2] / "benchmarks" / "labels" / "exposures.json"


@pytest.fixture(scope="module")
def head() -> Head:
    return load_head("generic")


def lightness(picture: Bytes) -> np.ndarray:
    """CIE L* of an sRGB picture, by its definition."""
    grey = luminance(srgb_decode(picture / np.float32(255.0)))
    return np.asarray(np.where(grey > 216 / 24389, 116 * np.cbrt(grey) - 16, grey * 24389 / 27))


def here(head: Head, light: PlaceLight, style: str, turn_deg: float) -> np.ndarray:
    facing = Facing(light, turn_deg, head.expose_of(style))
    linear = pictures_at(head.transport, light, [turn_deg])
    return lightness(head.portraits(linear, SIZE, [facing])[0])


def corners(picture: np.ndarray) -> np.ndarray:
    """The upper corners, where there is only background."""
    return np.concatenate([picture[:30, :12].ravel(), picture[:30, -12:].ravel()])


def face(picture: np.ndarray) -> np.ndarray:
    return picture[45:75, 36:60]


def window_behind(stops: float) -> PlaceLight:
    """Even light, and a bright wall behind the sitter at turn 0."""
    radiance = np.ones((64, 128, 3), np.float32)
    azimuth = (np.arange(128) + 0.5) / 128 * 360 - 180
    radiance[16:48, np.abs(azimuth) > 140] = 2.0**stops
    return prepare(from_radiance(radiance, "window"))


@pytest.mark.parametrize("stops", [0.0, 2.0, 5.0])
def test_the_background_of_a_silhouette_is_as_bright_in_any_place(head: Head, stops: float) -> None:
    picture = here(head, window_behind(stops), "silhouette", 0.0)
    assert np.median(corners(picture)) == pytest.approx(85.0, abs=4.0)


def test_a_face_before_a_bright_wall_gets_dark_and_before_an_even_one_it_does_not(
    head: Head,
) -> None:
    bright, even = (here(head, window_behind(stops), "silhouette", 0.0) for stops in (5.0, 0.0))
    assert np.median(face(bright)) < 45.0 < np.median(face(even))


def test_other_styles_do_not_follow_the_background(head: Head) -> None:
    flat, silhouette = (
        np.median(face(here(head, window_behind(3.0), style, 0.0)))
        for style in ("flat", "silhouette")
    )
    assert flat > silhouette + 10.0


@pytest.mark.parametrize("style", ["left-rim", "right-rim", "double-rim", "left-kicker"])
@pytest.mark.parametrize("place", ["forest", "interior", "sunset"])
def test_a_face_beside_a_rim_stays_dark(head: Head, place: str, style: str) -> None:
    light = prepare(read_environment(resources() / "demo" / "scenes" / f"{place}.exr"))
    result = next(one for one in solve_all(head.pack, light.searched) if one.name == style)
    picture = here(head, light, style, result.turn_refined_deg)
    assert np.median(face(picture)) <= 50.0


@pytest.mark.parametrize("studio", [AS_PUBLISHED, Studio(30.0, 2.0)])
@pytest.mark.parametrize("quick", [True, False])
def test_the_studio_shows_a_silhouette_as_one(head: Head, quick: bool, studio: Studio) -> None:
    lit = head.lit_by({"": studio})
    style = lit.pack.styles[lit.pack.index("silhouette")]
    target = [lit.pack.target("silhouette")]
    picture = lightness(lit.portraits(target, SIZE, [style], quick=quick)[0])
    assert np.median(corners(picture)) == pytest.approx(85.0, abs=4.0)
    assert np.median(face(picture)) < 15.0


def test_the_colour_of_the_skin_does_not_change_a_background() -> None:
    light = window_behind(3.0)
    dark, medium = (
        np.median(corners(here(load_head(name), light, "silhouette", 0.0)))
        for name in ("generic-dark", "generic")
    )
    assert dark == pytest.approx(medium, abs=0.5)


def test_styles_are_exposed_as_blind_readers_chose() -> None:
    """No other rule is ahead of a style's own by more than the readers' third of a point."""
    points: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    for row in json.loads(LABELS.read_text(encoding="utf-8"))["rows"]:
        for reading in row["readings"]:
            best, wrong = reading["best"], reading["wrong"]
            for rule in ("face", "key", "background", "dark"):
                gained = 2.0 * (best[0] == rule) + 1.0 * (rule in best[1:]) - 2.0 * (rule in wrong)
                points[row["style"]][rule] += gained / len(row["readings"])
    for style in load_styles():
        chosen = points.get(style.name)
        if chosen is not None:
            rules = {rule: chosen[rule] / 6 for rule in ("face", "background", "dark")}
            assert rules[style.expose] >= max(rules.values()) - 1 / 3, style.name
