"""One photograph of all directions: what is clipped counts as what, and which turns hang on it."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.colour import srgb_encode
from app.core.base.errors import ProbeError
from app.core.base.imaging.images import write_exr
from app.core.environment.environment import reduce_light
from app.core.measure.bracket.measure import measure
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read.remarks import PhoneRendered
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.words.remarks import sentences
from tests.helpers.cameras import pack
from tests.helpers.exif_bytes import SHORT, camera_tags, exif, jpeg, pose_xmp
from tests.helpers.probes import Float32, away_deg, place

WINDOW, LAMP = (-70.0, 15.0, 30.0, 8.0), (80.0, 40.0, 30.0, 8.0)


def photograph(light: Float32, file: Path) -> Path:
    """Keep a light, 1 = white, as an 8-bit sRGB picture."""
    codes = np.rint(255.0 * srgb_encode(np.minimum(light, 1.0))).astype(np.uint8)
    assert cv2.imwrite(str(file), codes[..., ::-1])
    return file


def measured(light: Float32, folder: Path, **wishes: object) -> Measurement:
    file = photograph(light, folder / "sphere.png")
    return measure([file], MeasureOptions(alone=True, **wishes))  # type: ignore[arg-type]


def in_doubt(probe: Measurement) -> tuple[str, ...]:
    assert probe.finished.audit is not None
    return probe.finished.audit.in_doubt


def answers(light: Float32) -> dict[str, StyleResult]:
    return {one.name: one for one in solve_all(pack(), reduce_light(light, (32, 64)))}


def test_white_counts_as_four_stops_and_one_clipped_channel_as_one(tmp_path: Path) -> None:
    light = place([(0.0, 20.0, 20.0, 50.0)], fill=0.2)
    sky = away_deg((256, 512), 120.0, 50.0) < 15.0
    light[sky] = (0.3, 0.5, 3.0)
    probe = measured(light, tmp_path)
    white = light.min(axis=-1) > 1.0
    found = probe.merged.radiance
    assert found[white] == pytest.approx(16.0, rel=0.01)
    assert np.allclose(found[sky], (0.6, 1.0, 2.0), rtol=0.02)
    rest = ~(white | sky)
    assert found[rest] == pytest.approx(0.2, rel=0.01)
    assert probe.rough
    assert probe.merged.cd_m2 is None
    assert any("does not record its exposure time" in each for each in sentences(probe.warnings))


@pytest.mark.usefixtures("best_turns")
def test_a_single_lamp_is_answered_as_the_true_light_is(tmp_path: Path) -> None:
    light = place([(40.0, 35.0, 12.0, 20.0)], fill=0.01)
    probe, truth = measured(light, tmp_path), answers(light)
    rough = answers(probe.merged.radiance)
    reached = [name for name, one in truth.items() if one.grade == "yes"]
    assert len(reached) >= 5
    for name in reached:
        assert rough[name].turn_refined_deg == pytest.approx(truth[name].turn_refined_deg, abs=2.0)
    assert not set(reached) & set(in_doubt(probe))


def test_which_of_two_clipped_lamps_is_the_brighter_is_not_known(tmp_path: Path) -> None:
    """Whichever it is, the photograph is the same: one of the two answers must be wrong."""
    first = place([(*WINDOW[:3], 200.0), LAMP])
    second = place([WINDOW, (*LAMP[:3], 200.0)])
    one, other = answers(first), answers(second)
    apart = {
        name
        for name, result in one.items()
        if abs((result.turn_deg - other[name].turn_deg + 180.0) % 360.0 - 180.0) > 60.0
        and result.grade == "yes"
    }
    assert len(apart) >= 3
    doubted = in_doubt(measured(first, tmp_path))
    assert doubted == in_doubt(measured(second, tmp_path))
    assert len(apart & set(doubted)) >= 0.7 * len(apart)


def test_what_is_not_clipped_is_not_in_doubt(tmp_path: Path) -> None:
    probe = measured(place([(0.0, 40.0, 30.0, 0.8)], fill=0.05), tmp_path)
    assert in_doubt(probe) == ()
    assert probe.merged.radiance.max() == pytest.approx(0.8, rel=0.01)
    assert probe.finished.audit is not None
    assert "nothing in the photo is clipped" in sentences(probe.finished.audit.advice)[0]


def test_the_user_knows_a_lamp_better(tmp_path: Path) -> None:
    probe = measured(place([(0.0, 20.0, 20.0, 50.0)], fill=0.2), tmp_path, gains={"A": 3.0})
    assert probe.merged.radiance.max() == pytest.approx(8.0, rel=0.01)


def test_an_exposure_that_is_stated_makes_it_absolute(tmp_path: Path) -> None:
    """ISO 12232: saturation at 1/1000 s, ISO 64 and f/2 is 1.2 N^2 / (t S / 100) cd/m2."""
    file = tmp_path / "theta.jpg"
    file.write_bytes(jpeg(exif(camera=camera_tags()), shape=(64, 128)))
    probe = measure([file], MeasureOptions(alone=True))
    assert probe.merged.cd_m2 == pytest.approx(1.2 * 4.0 * 1000.0 * 100.0 / 64.0, rel=0.01)


def test_phones_that_rendered_it_are_named(tmp_path: Path) -> None:
    file = tmp_path / "phone.jpg"
    tags = [*camera_tags(), (0xA401, SHORT, (3,))]
    file.write_bytes(jpeg(exif(None, camera=tags), shape=(64, 128)))
    probe = measure([file], MeasureOptions(alone=True))
    assert any(isinstance(each, PhoneRendered) for each in probe.warnings)


GREY = np.full((128, 256, 3), 0.2, np.float32)


@pytest.mark.parametrize(
    ("light", "sentence", "hint"),
    [
        (np.full((128, 256, 3), 1.0, np.float32), "is overexposed: 100%", "shorter exposure"),
        (np.zeros((128, 256, 3), np.float32), "is completely black", "expose longer"),
        (GREY[:100], "is 256 x 100. A single picture must be a full panorama", "360 camera"),
    ],
)
def test_photographs_of_no_use(light: Float32, sentence: str, hint: str, tmp_path: Path) -> None:
    with pytest.raises(ProbeError) as refused:
        measured(light, tmp_path)
    assert sentence in refused.value.message
    assert hint in refused.value.hint


def test_a_part_of_a_sphere_is_no_panorama(tmp_path: Path) -> None:
    crop = {"CroppedAreaImageWidthPixels": 128, "FullPanoWidthPixels": 256}
    file = tmp_path / "part.jpg"
    file.write_bytes(jpeg(None, pose_xmp(**crop), shape=(64, 128)))
    with pytest.raises(ProbeError, match="only part of a panorama"):
        measure([file], MeasureOptions(alone=True))


def test_a_bracket_still_needs_two(tmp_path: Path) -> None:
    with pytest.raises(ProbeError, match="single frame"):
        measure([photograph(GREY, tmp_path / "one.png")], MeasureOptions())
    linear = tmp_path / "linear.exr"
    write_exr(linear, GREY)
    with pytest.raises(ProbeError, match="single frame"):
        measure([linear], MeasureOptions(alone=True))
