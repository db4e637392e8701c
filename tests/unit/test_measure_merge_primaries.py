"""Linear frames in another colour space than Rec. 709 are converted to it, as panoramas are."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from app.core.base.colour import REC709, rec709_from
from app.core.base.errors import ProbeError
from app.core.measure.bracket.measure import measure
from app.core.measure.options import MeasureOptions
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.metadata import read_header
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack

ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
STOPS = (2.0, 0.0, -2.0)


@lru_cache
def pack() -> StylePack:
    return load_named_pack("generic")


def light() -> np.ndarray:
    """Light in Rec. 709, (64, 128, 3), with a coloured lamp; in ACES too nothing is negative."""
    radiance = np.random.default_rng(3).uniform(0.01, 0.1, (64, 128, 3)).astype(np.float32)
    radiance[20:24, 40:46] = (0.9, 0.5, 0.3)
    return radiance


def write(folder: Path, radiance: np.ndarray, primaries: tuple[float, ...] | None) -> list[Path]:
    """A bracket of OpenEXR frames in the colours that they state."""
    folder.mkdir()
    linear = radiance
    if primaries is not None:
        linear = radiance @ np.linalg.inv(rec709_from(primaries)).T
    files = []
    for stop in STOPS:
        exposed = np.clip(linear * 2.0**stop, 0.0, 1.0).astype(np.float32)
        spec = oiio.ImageSpec(exposed.shape[1], exposed.shape[0], 3, "float")
        spec.attribute("ExposureTime", 2.0**stop / 30.0)
        if primaries is not None:
            spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), primaries)
        file = folder / f"{stop + 4:.0f}.exr"
        output = oiio.ImageOutput.create(str(file))
        assert output is not None
        assert output.open(str(file), spec)
        assert output.write_image(exposed)
        assert output.close()
        files.append(file)
    return files


def merged(files: list[Path]) -> MergedLight:
    times = tuple(2.0**stop / 30.0 for stop in STOPS)
    return measure(files, MeasureOptions(times=times)).finished.measured


def test_frames_of_aces_colours_merge_to_the_light_of_rec709(tmp_path: Path) -> None:
    """No frame has noise, and none is clipped everywhere: what is left is rounding."""
    found = merged(write(tmp_path / "aces", light(), ACES))
    truth = light() * (found.radiance[10, 10, 1] / light()[10, 10, 1])
    np.testing.assert_allclose(found.radiance, truth, rtol=2e-5, atol=1e-6)
    plain = merged(write(tmp_path / "plain", light(), None))
    np.testing.assert_allclose(plain.radiance, truth, rtol=2e-5, atol=1e-6)


def test_what_clips_is_judged_by_the_cameras_own_colours(tmp_path: Path) -> None:
    """A lamp that is white when clipped stays white, is marked, and sets the same clip level."""
    radiance = light()
    radiance[20:24, 40:46] = 50.0
    found = merged(write(tmp_path / "aces", radiance, ACES))
    assert (found.clipped[20:24, 40:46] == 1.0).all()
    assert np.count_nonzero(found.clipped) == 24
    np.testing.assert_allclose(found.radiance[21, 42], found.clip_level, rtol=1e-3)


def test_colours_outside_of_rec709_are_not_negative(tmp_path: Path) -> None:
    radiance = light()
    radiance[40:44, 60:64] = np.array([-0.2, 0.6, 0.01], np.float32)
    found = merged(write(tmp_path / "aces", radiance, ACES))
    assert found.radiance.min() == 0.0
    assert found.radiance[42, 62, 1] > 0.1


@pytest.mark.parametrize("primaries", [None, REC709])
def test_our_own_primaries_change_nothing(
    tmp_path: Path, primaries: tuple[float, ...] | None
) -> None:
    assert read_header(write(tmp_path / "b", light(), primaries)[0]).frame.primaries == ()


def test_frames_of_two_colour_spaces_are_no_bracket(tmp_path: Path) -> None:
    one, other = write(tmp_path / "a", light(), ACES), write(tmp_path / "b", light(), None)
    with pytest.raises(ProbeError, match="another colour space"):
        merged([*one[:2], other[2]])


def test_primaries_that_no_light_has_are_damage(tmp_path: Path) -> None:
    files = write(tmp_path / "a", light(), None)
    spec = oiio.ImageSpec(128, 64, 3, "float")
    spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), (0.3,) * 8)
    output = oiio.ImageOutput.create(str(files[0]))
    assert output is not None
    assert output.open(str(files[0]), spec)
    assert output.write_image(light())
    assert output.close()
    with pytest.raises(ProbeError, match="damaged"):
        read_header(files[0])
