"""Tone curves and exposure tags: checked, recovered and corrected on brackets of real scenes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.colour import srgb_decode
from app.core.measure.bracket.curve.brightness_transfer import match_codes, reach
from app.core.measure.bracket.curve.exposure_steps import MeasuredStep, StepCheck, check_matches
from app.core.measure.bracket.curve.response import (
    ResponseChoice,
    choose_response,
    srgb_response,
)
from app.core.measure.bracket.curve.response_recovery import srgb_table
from app.words.remarks import sentences
from benchmarks.light.camera_curves import CURVES, FILMIC, GAMMA_18, GAMMA_22, GAMMA_26, SRGB, Curve
from tests.helpers.brackets import (
    FULL,
    PAPER,
    SCENES,
    errors,
    light,
    pictures,
    samples,
    shot,
)
from tests.helpers.cases import sample_first
from tests.helpers.shared import SHARED, needs_shared

OTHERS = [curve for curve in CURVES if curve is not SRGB]
# Harder than any in CURVES: a full S-curve, Reinhard's shoulder, and ten stops in a logarithm.
SIGMOID = Curve("sigmoid", lambda x: 0.2 * SRGB.encode(x) + 0.8 * _smooth(SRGB.encode(x)))
REINHARD = Curve("reinhard", lambda x: SRGB.encode(4.0 * x / (1.0 + 3.0 * x)))
DEEP_LOG = Curve("deep-log", lambda x: np.log1p(1000.0 * x) / np.log1p(1000.0))


def check_steps(samples: NDArray[Any], stops: Sequence[float], table: Any = None) -> StepCheck:
    """Measure the steps between the frames of a bracket, by sRGB when no table is given."""
    matches = match_codes(samples, stops, reach(stops))
    return check_matches(matches, stops, srgb_table() if table is None else table)


def _smooth(value: NDArray[np.float64]) -> NDArray[np.float64]:
    return value * value * (3.0 - 2.0 * value)


def lying(scene: str, stops: tuple[float, ...], frame: int, by: float, curve: Curve) -> Any:
    real = list(stops)
    real[frame] += by
    return choose_response(shot(scene, real, curve), stops)


def said(choice: ResponseChoice) -> tuple[str, ...]:
    names = [f"frame {number + 1}" for number in range(len(choice.stops))]
    return sentences(choice.with_tags(names))


def relative(choice: ResponseChoice) -> list[float]:
    """Exposures against the last frame's."""
    return [stop - choice.stops[-1] for stop in choice.stops]


def _spread(step: MeasuredStep) -> float:
    """How far a step depends on the level: range of the middle 80 % of levels, in stops."""
    low, high = np.quantile(step.levels, (0.1, 0.9))
    return float(high - low)


class TestResponse:
    def test_srgb_is_the_published_curve(self) -> None:
        response = srgb_response()
        assert response.name == "sRGB"
        expected = srgb_decode(np.arange(256) / 255.0)
        np.testing.assert_allclose(response.table[1], expected, rtol=1e-5, atol=1e-9)
        # IEC 61966-2-1: code 118 is 18.1 % grey.
        assert response.table[0, 118] == pytest.approx(0.1812, abs=1e-4)


class TestPlainBrackets:
    @pytest.mark.slow
    @pytest.mark.parametrize("scene", sample_first(SCENES, 2))
    @pytest.mark.parametrize("stops", [PAPER, FULL])
    def test_srgb_is_kept_and_nothing_is_said(self, scene: str, stops: tuple[float, ...]) -> None:
        choice = choose_response(shot(scene, stops), stops)
        assert choice.response.name == "sRGB"
        assert choice.stops == stops
        assert said(choice) == ()
        assert choice.check.disagreement < 0.6
        assert choice.response.residual_stops < 0.02

    @pytest.mark.parametrize("stops", [(1.0, 0.0, -1.0), (1.31, 0.0, -2.66), (4.0, 0.0, -4.0)])
    def test_other_steps_are_as_good(self, stops: tuple[float, ...]) -> None:
        choice = choose_response(shot("interior", stops), stops)
        assert choice.response.name == "sRGB"
        assert said(choice) == ()
        for step in choice.check.steps:
            assert step.measured == pytest.approx(step.nominal, abs=0.03)

    def test_a_wrong_curve_shows_as_a_step_that_depends_on_the_level(self) -> None:
        matches = match_codes(shot("courtyard", PAPER, FILMIC), PAPER)
        check = check_matches(matches, PAPER, srgb_table())
        assert not check.agrees
        assert max(_spread(step) for step in check.steps) > 0.2
        true = check_matches(matches, PAPER, FILMIC.response())
        assert true.agrees
        assert max(_spread(step) for step in true.steps) < 0.1

    def test_asked_for_srgb_stays_and_warns(self) -> None:
        choice = choose_response(shot("interior", PAPER, FILMIC), PAPER, "srgb")
        assert choice.response.name == "sRGB"
        assert choice.stops == PAPER
        assert len(said(choice)) == 1
        assert "not sRGB" in said(choice)[0]

    def test_recovered_although_srgb_is_hardly_worse(self) -> None:
        choice = choose_response(shot("sunset", PAPER), PAPER, "recover")
        found = errors(choice.response.table[0], SRGB, light("sunset"), PAPER)
        assert choice.response.name == "recovered"
        assert said(choice) == ()
        assert np.median(found) < 0.01
        assert np.percentile(found, 95) < 0.02


class TestRecovery:
    @pytest.mark.slow
    @pytest.mark.parametrize("scene", sample_first(["interior", "city", "night", "sunrise"], 1))
    @pytest.mark.parametrize(
        "curve", [*OTHERS, SIGMOID, REINHARD, DEEP_LOG], ids=lambda curve: str(curve.name)
    )
    def test_light_within_the_bar(self, scene: str, curve: Curve) -> None:
        choice = choose_response(shot(scene, PAPER, curve), PAPER)
        assert choice.response.name == "recovered"
        assert choice.stops == PAPER
        table = choice.response.table
        assert np.all(np.diff(table, axis=1) > 0.0)
        np.testing.assert_array_equal(table[:, [0, 255]], [[0.0, 1.0]] * 3)
        found = errors(table[1], curve, light(scene), PAPER)
        assert np.median(found) <= 0.015
        assert np.percentile(found, 95) <= 0.045
        assert f"{choice.response.residual_stops:.2f} stops" in said(choice)[0]

    @pytest.mark.parametrize("stops", [(2.0, 0.0), (1.0, 0.0, -1.0), (1.31, 0.0, -2.66), FULL])
    def test_other_brackets(self, stops: tuple[float, ...]) -> None:
        choice = choose_response(shot("courtyard", stops, FILMIC), stops)
        found = errors(choice.response.table[1], FILMIC, light("courtyard"), stops)
        assert np.median(found) <= 0.015
        assert np.percentile(found, 95) <= 0.045

    @pytest.mark.slow
    @pytest.mark.parametrize("curve", [GAMMA_18, FILMIC, REINHARD], ids=lambda c: str(c.name))
    def test_at_least_as_accurate_as_opencv(self, curve: Curve) -> None:
        frames = pictures(light("interior"), PAPER, curve)
        times = np.exp2(np.array(PAPER, np.float32))
        ours = choose_response(samples(frames), PAPER, "recover").response.table[1]
        mine = errors(ours, curve, light("interior"), PAPER)
        small = [np.ascontiguousarray(frame[::4, ::4]) for frame in frames]
        for calibrate in (cv2.createCalibrateDebevec(300), cv2.createCalibrateRobertson()):
            table = calibrate.process(small, times)[:, 0, 1].astype(np.float64)
            table = np.maximum.accumulate(table / table[255]) + np.arange(256) * 1e-9
            peer = errors(table, curve, light("interior"), PAPER)
            assert np.median(mine) <= np.median(peer)
            assert np.percentile(mine, 95) <= np.percentile(peer, 95)

    def test_channels_with_curves_of_their_own(self) -> None:
        curves = (FILMIC, SRGB, GAMMA_26)
        table = choose_response(shot("courtyard", PAPER, curves), PAPER).response.table
        for channel, curve in enumerate(curves):
            found = errors(table[channel], curve, light("courtyard"), PAPER)
            assert np.median(found) <= 0.02
            assert np.percentile(found, 95) <= 0.06

    def test_one_curve_is_not_taken_for_three(self) -> None:
        for curve in (FILMIC, REINHARD):
            table = choose_response(shot("interior", PAPER, curve), PAPER).response.table
            np.testing.assert_array_equal(table[0], table[2])

    def test_scans_whose_black_is_not_nought(self) -> None:
        stops = tuple(5.0 - step for step in range(12))
        frames = pictures(light("sunset"), stops, GAMMA_22, quality=None, black=17)
        choice = choose_response(samples(frames), stops)
        assert choice.tag_errors == ()
        lifted = Curve("lifted", lambda x: (17.0 + 238.0 * GAMMA_22.encode(x)) / 255.0)
        bright = np.clip(light("sunset"), 2.0**-7, None)
        found = errors(choice.response.table[1], lifted, bright, stops)
        assert np.median(found) <= 0.03

    @needs_shared
    def test_memorial_church(self) -> None:
        paths = sorted((SHARED / "brackets" / "memorial").glob("memorial00*.png"))
        frames = [np.asarray(cv2.imread(str(path)), np.uint8) for path in paths]
        codes = samples([frame[..., ::-1] for frame in frames], 4)
        stops = tuple(5.0 - step for step in range(16))
        choice = choose_response(codes, stops)
        # Film scans: red and blue differ, and the marked borders say nothing about exposure.
        assert choice.response.name == "recovered"
        assert choice.stops == stops
        assert choice.response.residual_stops < 0.1
        for step in choice.check.steps:
            assert step.measured == pytest.approx(1.0, abs=0.25)


class TestWrongTags:
    @pytest.mark.slow
    @pytest.mark.parametrize("frame", [0, 1, 2])
    @pytest.mark.parametrize("by", sample_first([-0.34, 1.0, -1.0, 0.25], 2))
    @pytest.mark.parametrize("scene", sample_first(["forest", "interior"], 1))
    def test_the_frame_is_found_and_put_right(self, scene: str, frame: int, by: float) -> None:
        choice = lying(scene, PAPER, frame, by, SRGB)
        assert choice.response.name == "sRGB"
        assert [error.frame for error in choice.tag_errors] == [frame]
        assert choice.tag_errors[0].suspects == (frame,)
        assert choice.tag_errors[0].stops == pytest.approx(by, abs=0.03)
        expected = [stop + by * (index == frame) for index, stop in enumerate(PAPER)]
        np.testing.assert_allclose(choice.stops, expected, atol=0.03)
        (sentence,) = sentences(choice.with_tags(["a.jpg", "b.jpg", "c.jpg"]))
        assert sentence.startswith("ABC"[frame] + ".jpg is ")
        assert ("brighter" if by > 0 else "darker") in sentence

    @pytest.mark.slow
    @pytest.mark.parametrize("frame", [0, 2, 4])
    @pytest.mark.parametrize("by", [-1.0, 0.34])
    @pytest.mark.parametrize("curve", [FILMIC, GAMMA_26], ids=lambda curve: str(curve.name))
    def test_and_with_an_unknown_curve(self, frame: int, by: float, curve: Curve) -> None:
        choice = lying("interior", FULL, frame, by, curve)
        assert choice.response.name == "recovered"
        assert [error.frame for error in choice.tag_errors] == [frame]
        assert choice.tag_errors[0].suspects == (frame,)
        assert choice.tag_errors[0].stops == pytest.approx(by, abs=0.05)
        found = errors(choice.response.table[1], curve, light("interior"), FULL)
        assert np.median(found) <= 0.03
        assert np.percentile(found, 95) <= 0.1

    def test_three_frames_with_an_unknown_curve_name_all_who_may_be_wrong(self) -> None:
        choice = lying("interior", PAPER, 1, -1.0, FILMIC)
        (error,) = choice.tag_errors
        assert error.frame == 1
        assert error.stops == pytest.approx(-1.0, abs=0.05)
        assert error.suspects == (0, 1, 2)
        assert "may be wrong instead" in said(choice)[0]
        assert "frame 1 or frame 3" in said(choice)[0]

    def test_two_frames_cannot_tell_which(self) -> None:
        choice = choose_response(shot("interior", (2.0, 1.0)), (2.0, 0.0))
        assert choice.response.name == "sRGB"
        assert choice.tag_errors[0].suspects == (0, 1)
        assert choice.stops[0] - choice.stops[1] == pytest.approx(1.0, abs=0.03)
        curved = choose_response(shot("interior", (2.0, 0.0), GAMMA_26), (2.0, 0.0))
        assert curved.response.name == "recovered"
        assert any("third frame" in sentence for sentence in said(curved))

    def test_rounded_shutter_times_are_put_right_in_silence(self) -> None:
        # 1/15 s on the dial is 1/16 s on the shutter: 0.09 stops.
        real = (2.0, -0.093, -2.0)
        choice = choose_response(shot("interior", real), PAPER)
        assert choice.response.name == "sRGB"
        assert said(choice) == ()
        assert relative(choice) == pytest.approx([4.0, 1.907, 0.0], abs=0.02)

    def test_all_steps_off_by_one_factor_is_the_curve(self) -> None:
        power = Curve("power", lambda x: SRGB.encode(x**0.8))
        choice = choose_response(shot("interior", FULL, power), FULL)
        assert choice.response.name == "recovered"
        assert choice.tag_errors == ()
        found = errors(choice.response.table[1], power, light("interior"), FULL)
        assert np.percentile(found, 95) <= 0.04

    def test_several_wrong_tags_with_a_known_curve(self) -> None:
        real = (2.0, 0.5, -2.4, -4.0, -6.0)
        choice = choose_response(shot("sunset", real), FULL)
        assert choice.response.name == "sRGB"
        np.testing.assert_allclose(relative(choice), np.array(real) + 6.0, atol=0.05)
        assert [error.frame for error in choice.tag_errors] == [1, 2]

    def test_what_nothing_explains_is_said(self) -> None:
        frames = [
            pictures(light(scene), [stop])[0]
            for scene, stop in zip(("city", "night", "studio"), PAPER, strict=True)
        ]
        choice = choose_response(samples(frames), PAPER)
        assert any("do not match" in sentence for sentence in said(choice))
        assert np.all(np.diff(choice.response.table, axis=1) > 0.0)


class TestDamagedBrackets:
    @pytest.mark.slow
    @pytest.mark.parametrize("curve", [SRGB, FILMIC], ids=lambda curve: str(curve.name))
    @pytest.mark.parametrize("damage", ["person", "grey", "black", "turned", "compressed"])
    def test_borne(self, curve: Curve, damage: str) -> None:
        frames = pictures(light("courtyard"), PAPER, curve)
        height, width = frames[0].shape[:2]
        if damage == "person":
            for index, frame in enumerate(frames):
                left = width // 6 * (index + 1)
                frame[height // 3 :, left : left + width // 12] = (90, 60, 40)
        elif damage == "grey":
            frames[1][height // 2 :] = 128
        elif damage == "black":
            frames[0][height // 2 :] = 0
        elif damage == "turned":
            turn = cv2.getRotationMatrix2D((width / 2, height / 2), 3.0, 1.0)
            turn[:, 2] = turn[:, 2] + 8.0
            frames[2] = np.asarray(
                cv2.warpAffine(frames[2], turn, (width, height), borderMode=cv2.BORDER_REFLECT),
                dtype=np.uint8,
            )
        else:
            frames = pictures(light("courtyard"), PAPER, curve, quality=60)
        choice = choose_response(samples(frames), PAPER)
        assert (choice.response.name == "sRGB") == (curve is SRGB)
        assert choice.tag_errors == ()
        found = errors(choice.response.table[1], curve, light("courtyard"), PAPER)
        assert np.median(found) <= 0.03
        assert np.percentile(found, 95) <= 0.1


class TestNothingToCompare:
    @pytest.mark.parametrize("mode", ["srgb", "auto", "recover"])
    def test_frames_without_overlap(self, mode: Any) -> None:
        frames = pictures(np.clip(light("studio"), 0.05, 0.2), (2.0, -6.0))
        choice = choose_response(samples(frames), (2.0, -6.0), mode)
        assert choice.response.name == "sRGB"
        assert choice.stops == (2.0, -6.0)
        assert not choice.check.possible
        assert np.isnan(choice.response.residual_stops)
        assert len(said(choice)) == 1
        assert "could not be" in said(choice)[0]

    def test_black_and_white_frames(self) -> None:
        codes = np.stack([np.full((5000, 3), value, np.uint8) for value in (255, 255, 0)])
        choice = choose_response(codes, PAPER)
        assert choice.response.name == "sRGB"
        assert not choice.check.possible

    def test_one_frame_is_no_bracket(self) -> None:
        choice = choose_response(shot("city", (0.0,)), (0.0,))
        assert said(choice) == ()
        assert choice.response.name == "sRGB"

    def test_wrong_calls(self) -> None:
        good = np.zeros((3, 100, 3), np.uint8)
        with pytest.raises(ValueError, match="as many stops"):
            choose_response(good, (1.0, 0.0))
        with pytest.raises(ValueError, match="uint8"):
            match_codes(good.astype(np.float32), PAPER)
        with pytest.raises(ValueError, match='"guess"'):
            choose_response(good, PAPER, "guess")  # type: ignore[arg-type]
