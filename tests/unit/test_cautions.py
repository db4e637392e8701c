"""Cautions: a step between lenses is found, edges of the place are not, and places keep both."""

from __future__ import annotations

from datetime import UTC, datetime
from functools import lru_cache

import cv2
import numpy as np
import pytest

from app.core.base.arrays import Float32
from app.core.base.sphere import direction, directions
from app.core.cautions.caution import Caution, Hazard, hazards_of
from app.core.cautions.find_cautions import lens_cautions
from app.core.cautions.lens_step import evened, lens_step
from app.core.environment.environment import Environment
from app.core.measure.finish.findings import Findings
from app.core.places.place import CaptureFacts, Place
from app.core.places.saved.saved_cautions import cautions_of, cautions_to_json, with_cautions
from app.core.styles.style_pack_file import load_named_pack
from app.ui.screens.probe.capture.camera import CameraBlock
from app.ui.screens.probe.capture.notice import CARDS_SHOW_ANSWERS, advice_notice
from app.words.measure.doubts import caution_lines, hazard_words, notice_lines
from app.words.verdict import doubt_words

SHAPE = (192, 384)


@lru_cache(maxsize=1)
def room() -> Float32:
    """Return a place with texture at several sizes and a bright sky, without a step."""
    generator = np.random.default_rng(5)
    logs = np.linspace(1.5, -1.5, SHAPE[0])[:, None] + np.zeros(SHAPE)
    for size, depth in ((6, 0.4), (24, 0.2), (96, 0.1)):
        coarse = generator.normal(0.0, depth, (size, 2 * size)).astype(np.float32)
        around = np.tile(coarse, (1, 3))
        wide = cv2.resize(around, (3 * SHAPE[1], SHAPE[0]), interpolation=cv2.INTER_CUBIC)
        logs += wide[:, SHAPE[1] : 2 * SHAPE[1]]
    return np.asarray(np.exp2(logs)[..., None] * [1.0, 0.9, 0.8], np.float32)


def with_step(light: Float32, stops: float, azimuth: float, elevation: float = 0.0) -> Float32:
    """Return a panorama whose hemisphere around a direction is brighter, blended over 3 degrees."""
    axis = direction(azimuth, elevation)
    angle = np.degrees(np.arcsin(np.clip(directions(SHAPE) @ axis, -1.0, 1.0)))
    share = np.clip(0.5 + angle / 3.0, 0.0, 1.0)
    return np.asarray(light * np.exp2(stops * share)[..., None], np.float32)


@pytest.mark.parametrize(
    ("stops", "azimuth", "elevation"), [(0.5, 0.0, 0.0), (-0.7, 0.0, 0.0), (1.0, 117.0, -4.0)]
)
def test_lens_step_is_found_with_its_size_and_side(
    stops: float, azimuth: float, elevation: float
) -> None:
    step = lens_step(with_step(room(), stops, azimuth, elevation))
    assert step is not None
    assert step.stops == pytest.approx(abs(stops), abs=0.15)
    axis = np.sign(stops) * direction(azimuth, elevation)
    reported = direction(step.azimuth_deg, step.elevation_deg)
    assert np.degrees(np.arccos(axis @ reported)) < 4.0


def test_a_wall_on_one_side_is_no_lens_step() -> None:
    wall = room().copy()
    wall[:, 96:192] *= 2.0
    assert lens_step(wall) is None


def test_evened_panorama_has_no_lens_step() -> None:
    marred = with_step(room(), 0.7, 30.0)
    step = lens_step(marred)
    assert step is not None
    assert lens_step(evened(marred, step)) is None


def test_a_coarse_panorama_is_not_searched() -> None:
    coarse = cv2.resize(with_step(room(), 1.0, 0.0), (128, 64), interpolation=cv2.INTER_AREA)
    assert lens_step(np.asarray(coarse, np.float32)) is None


def test_lens_caution_lists_only_styles_that_change() -> None:
    pack = load_named_pack("generic")
    (caution,) = lens_cautions(Environment(with_step(room(), 1.0, 90.0), "room"), pack)
    assert caution.hazard is Hazard.LENS_STEP
    assert caution.amount == pytest.approx(1.0, abs=0.15)
    assert caution.styles is not None
    assert set(caution.styles) < {style.name for style in pack.styles}


CAUTIONS = (
    Caution(Hazard.CLIPPED, 0.25, ("top",)),
    Caution(Hazard.LENS_STEP, 0.7, ()),
    Caution(Hazard.TILT, None, None),
)


def test_hazards_of_a_style_include_those_of_every_style() -> None:
    assert hazards_of(CAUTIONS, "top") == (Hazard.CLIPPED, Hazard.TILT)
    assert hazards_of(CAUTIONS, "flat") == (Hazard.TILT,)


def test_cautions_survive_saving() -> None:
    facts = cautions_to_json(CAUTIONS)
    assert cautions_of(facts["cautions"]) == CAUTIONS
    newer = [*facts["cautions"], {"hazard": "earthquake", "amount": 7.0, "styles": None}]
    assert cautions_of(newer) == CAUTIONS


@pytest.mark.parametrize(("plan", "hazard"), [("rough", Hazard.ROUGH), ("files", Hazard.CLIPPED)])
def test_cautions_of_an_earlier_version_are_read(plan: str, hazard: Hazard) -> None:
    facts = {"plan": plan, "clipped_share": 0.1, "doubtful": ["top"], "doubtful_unseen": []}
    assert cautions_of(with_cautions(facts)["cautions"]) == (Caution(hazard, 0.1, ("top",)),)


def test_every_hazard_has_words_for_a_card() -> None:
    words = {doubt_words((hazard,), rough=False) for hazard in Hazard}
    assert "" not in words
    assert len(words) == len(Hazard) - 1  # clipped light is the same in one photo and in several


def test_a_lens_step_is_described_with_its_size_and_effect() -> None:
    step = Caution(Hazard.LENS_STEP, 0.7, ("top",))
    assert "0.7" in hazard_words(step)
    assert notice_lines((CAUTIONS[0], step)) == (hazard_words(step),)
    effect = caution_lines((step,), ("top", "flat"))[-1]
    assert "top" in effect
    assert "flat" not in effect


def test_probe_notice_starts_with_a_lens_step() -> None:
    step = Caution(Hazard.LENS_STEP, 0.7, ("top",))
    capture = CaptureFacts(plan="files", cautions=(step,))
    here = Place("Here", datetime(2026, 6, 21, 12, tzinfo=UTC), capture=capture)
    notice = advice_notice(here, Findings(), None, CameraBlock())
    assert notice is not None
    assert notice.tone == "advice"
    assert notice.title == hazard_words(step)
    assert notice.body.endswith(CARDS_SHOW_ANSWERS)
