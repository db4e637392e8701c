"""What moved between the frames of a bracket."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base import sphere
from app.core.base.colour import luminance
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.bracket.contradiction import CLOSE, LOOSE, Predictions, contradiction
from app.core.measure.bracket.curve.response import Response, srgb_response
from app.core.measure.bracket.deghosting import FrameTrust, trust
from app.core.measure.bracket.grouping import read_bracket
from app.core.measure.bracket.merge import merge
from app.core.measure.read.frame import Exposure
from app.core.measure.read.opened_frame import proxy_shape
from app.core.measure.read.pixels import open_frames
from app.core.solver.solve import solve_all
from app.core.styles.style_pack_file import load_named_pack
from app.devices.simulated.cameras import SENSORS
from app.devices.simulated.exposure_maker import jpeg
from app.devices.simulated.optics import meter
from app.words.remarks import sentences
from benchmarks.light.camera_curves import curve_named
from benchmarks.light.shots.brackets import develop
from tests.helpers.cases import sample_first
from tests.helpers.people import mean_luminance, with_person

SCENES = ["city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset"]
PAPER = (2.0, 0.0, -2.0)
FULL = (2.0, 0.0, -2.0, -4.0, -6.0, -8.0, -10.0, -12.0)
COLOURS = [(0.5, 0.05, 0.05), (0.04, 0.04, 0.05), (0.8, 0.8, 0.8), (0.05, 0.1, 0.5)]
CAMERA = SENSORS["Z1"]
SHAPE = (512, 1024)


@lru_cache
def scene(name: str) -> np.ndarray:
    return np.array(read_environment(resources() / "demo" / "scenes" / f"{name}.exr").radiance)


@lru_cache
def metered(name: str) -> Exposure:
    return meter(scene(name), CAMERA)


def exposed(base: Exposure, stops: float) -> Exposure:
    return Exposure(base.shutter_s * 2.0**stops, base.iso, base.aperture)


def small(frames: list[np.ndarray]) -> list[np.ndarray]:
    """Proxies as `open_frames` makes them."""
    height, width = proxy_shape(frames[0].shape[:2])
    return [cv2.resize(f, (width, height), interpolation=cv2.INTER_AREA) for f in frames]


def pictures(name: str, lights: list[np.ndarray], stops: tuple[float, ...]) -> list[np.ndarray]:
    """Coded frames of these lights, without noise and JPEG, twice as large as the scenes."""
    shape = (2 * SHAPE[0], 2 * SHAPE[1])
    return [
        develop(light, CAMERA, exposed(metered(name), stop), shape=shape, smooth=True, noise=False)
        for light, stop in zip(lights, stops, strict=True)
    ]


def merged(
    folder: Path, frames: list[np.ndarray], stops: tuple[float, ...], treated: bool = True
) -> tuple[np.ndarray, FrameTrust]:
    """Merged light of the scenes' size, and what moved; by way of files without losses."""
    folder.mkdir(exist_ok=True)
    paths = [folder / f"{index}.png" for index in range(len(frames))]
    for path, frame in zip(paths, frames, strict=True):
        assert cv2.imwrite(str(path), frame[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])
    bracket = read_bracket(paths, [2.0**stop for stop in stops])
    with open_frames(bracket) as stack:
        motion = trust(stack.proxies, stack.stops, srgb_response())
        masks = motion.masks if treated else None
        result = merge(stack, srgb_response(), stack.stops, trust=masks, size=SHAPE)
    return result.radiance, motion


def linear(frame: np.ndarray, size: tuple[int, int] = SHAPE) -> np.ndarray:
    """What one frame says, reduced; (h, w, 3)."""
    light = srgb_response().table[0].astype(np.float32)[frame]
    return np.asarray(cv2.resize(light, size[::-1], interpolation=cv2.INTER_AREA))


def tint(light: np.ndarray) -> np.ndarray:
    return np.asarray(light / np.maximum(light.sum(axis=2, keepdims=True), 1e-9))


def foreign_tint(light: np.ndarray, frames: list[np.ndarray]) -> np.ndarray:
    """Distance in chromaticity from the nearest frame's own, (h, w)."""
    own = [np.abs(tint(light) - tint(linear(frame))).max(axis=2) for frame in frames]
    return np.asarray(np.min(own, axis=0))


def half_a_code(frame: np.ndarray) -> np.ndarray:
    """Light that half a code of an 8-bit frame of exposure 0 stands for, (h, w)."""
    step = np.gradient(srgb_response().table[0]).astype(np.float32)
    worst = step[frame].max(axis=2)
    return np.asarray(cv2.resize(0.5 * worst, SHAPE[::-1], interpolation=cv2.INTER_AREA))


def turns_given_up(wanted: np.ndarray, got: np.ndarray) -> float:
    """Worst over the styles, both objectives, share of the curve's range."""
    pack = load_named_pack("generic")
    lights = [luminance(reduce_radiance(light)) for light in (wanted, got)]
    worst = 0.0
    for true, found in zip(*(solve_all(pack, one, "paper") for one in lights), strict=True):
        curve = true.quality_curve
        worst = max(worst, (curve.max() - curve[found.turn_index]) / np.ptp(curve))
    for true, found in zip(*(solve_all(pack, one, "picture") for one in lights), strict=True):
        curve = true.match_curve
        worst = max(worst, (curve[true.turn_index] - curve[found.turn_index]) / np.ptp(curve))
    return worst


@pytest.mark.parametrize("curve", ["srgb", "filmic"])
@pytest.mark.parametrize("name", sample_first(SCENES, 2))
def test_a_still_scene_is_left_alone(name: str, curve: str) -> None:
    # Noise, JPEG, frames a little off one another, unequal lenses, a curve 3 % wrong.
    ripple = 1.0 + 0.03 * np.sin(np.linspace(0.0, 9.0, 256))
    known = curve_named(curve)
    table = known.response() * (ripple if curve == "filmic" else 1.0)
    response = Response("own", np.repeat(np.maximum.accumulate(table / table[-1])[None], 3, axis=0))
    frames = []
    for index, stop in enumerate(FULL):
        shift = sphere.rotation(0.03, 0.02, 0.0) if index % 2 else None
        gains = (1.0, 1.03) if index % 2 else (1.03, 1.0)
        picture = develop(
            scene(name),
            CAMERA,
            exposed(metered(name), stop),
            seed=index,
            curve=known,
            shift=shift,
            lens_gain=gains,
        )
        data = np.frombuffer(jpeg(picture), np.uint8)
        frames.append(np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR_RGB)))
    for number in (3, 8):
        stops = FULL[:number]
        motion = trust(small(frames[:number]), stops, response)
        assert motion == FrameTrust((None,) * number)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "place"), sample_first(zip(SCENES, range(8), strict=True), 2))
def test_a_person_who_moved_leaves_no_ghost(tmp_path: Path, name: str, place: int) -> None:
    azimuth = -160.0 + 45.0 * place
    light, colour = scene(name), COLOURS[place % 4]
    there, first = with_person(light, azimuth, distance_m=3.5, reflectance=colour)
    here, second = with_person(light, azimuth + 10.0, distance_m=3.5, reflectance=colour)
    frames = pictures(name, [there, here, here], PAPER)
    got, motion = merged(tmp_path, frames, PAPER)
    without, nothing = merged(tmp_path, pictures(name, [light] * 3, PAPER), PAPER)
    assert nothing.masks == (None, None, None)
    assert 0.005 < motion.share < 0.03
    assert motion.masks[1:] == (None, None)
    assert all(abs(region.azimuth_deg - azimuth - 5.0) < 15.0 for region in motion.where)

    # Scene texels are enlarged smoothly: a silhouette reaches one texel further.
    either = cv2.dilate((first | second).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    # 2 %, and where it is dark what half a code of a frame in use is worth.
    change = np.abs(got - without).max(axis=2)
    assert (change / (0.02 * without.max(axis=2) + half_a_code(frames[1])))[~either].max() <= 1.0
    assert np.count_nonzero(change[~either] > 0.02 * without.max(axis=2)[~either]) <= 5

    assert foreign_tint(got, frames)[either].max() <= 0.02
    assert turns_given_up(without, got) <= 0.02

    ghost, _ = merged(tmp_path, frames, PAPER, treated=False)
    assert foreign_tint(ghost, frames)[either].max() > 0.02


@pytest.mark.slow
def test_whoever_is_in_one_frame_of_many_disappears(tmp_path: Path) -> None:
    light, stops = scene("courtyard"), FULL[:6]
    person, _ = with_person(light, 60.0, distance_m=3.0)
    frames = pictures("courtyard", [light, person, light, light, light, light], stops)
    got, motion = merged(tmp_path, frames, stops)
    assert motion.masks[1] is not None
    assert motion.masks[2:] == (None, None, None, None)
    without, _ = merged(tmp_path, pictures("courtyard", [light] * 6, stops), stops)
    change = np.abs(got - without).max(axis=2) / without.max(axis=2)
    assert change.max() <= 0.02
    assert turns_given_up(without, got) <= 0.001


@pytest.mark.slow
def test_a_person_who_walks_all_the_time(tmp_path: Path) -> None:
    light, stops = scene("interior"), FULL[:6]
    walk = [
        with_person(light, 20.0 + 10.0 * k, distance_m=3.0, reflectance=(0.1, 0.5, 0.1))
        for k in range(6)
    ]
    frames = pictures("interior", [one[0] for one in walk], stops)
    got, _ = merged(tmp_path, frames, stops)
    assert foreign_tint(got, frames).max() <= foreign_tint_of_a_still_scene(tmp_path, stops)
    anywhere = np.any([one[1] for one in walk], axis=0)
    empty = pictures("interior", [light] * 6, stops)
    without, _ = merged(tmp_path, empty, stops)
    change = np.abs(got - without).max(axis=2)
    # 2 %, and where it is dark what half a code is worth; the merge's unit is exposure -2 here.
    limit = 0.02 * without.max(axis=2) + 0.25 * half_a_code(empty[1])
    either = cv2.dilate(anywhere.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    assert (change / limit)[~either].max() <= 1.0
    assert turns_given_up(without, got) <= 0.02


def foreign_tint_of_a_still_scene(folder: Path, stops: tuple[float, ...]) -> float:
    frames = pictures("interior", [scene("interior")] * len(stops), stops)
    return max(0.02, float(foreign_tint(merged(folder, frames, stops)[0], frames).max()))


@pytest.mark.slow
@pytest.mark.parametrize("stops", [(2.0, -1.0), (1.0, -1.0)])
@pytest.mark.parametrize("name", sample_first(["courtyard", "forest", "studio"], 1))
def test_of_two_frames_one_is_believed(tmp_path: Path, name: str, stops: tuple[float, ...]) -> None:
    light = scene(name)
    there, first = with_person(light, 30.0, reflectance=(0.5, 0.05, 0.05))
    here, second = with_person(light, 40.0, reflectance=(0.5, 0.05, 0.05))
    frames = pictures(name, [there, here], stops)
    got, motion = merged(tmp_path, frames, stops)
    assert sum(mask is not None for mask in motion.masks) == 1
    both = cv2.erode((first & second).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    either = cv2.dilate((first | second).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    assert both.any()
    assert np.quantile(foreign_tint(got, frames)[either], 0.999) <= 0.02


def test_a_window_is_kept_around_the_person_who_stands_before_it(tmp_path: Path) -> None:
    # Only the darkest frame shows the window unclipped, and in that frame somebody is in the way.
    light = np.full((*SHAPE, 3), 0.1, np.float32)
    light[160:300, 600:800] = (4.0, 5.0, 7.0)
    person, mask = with_person(light, 66.0, distance_m=4.0, reflectance=(0.5, 0.05, 0.05))
    assert mask[160:300, 600:800].any()
    codes = [
        np.rint(255.0 * curve_named("srgb").encode(np.clip(one * gain, 0.0, 1.0)))
        for one, gain in ((light, 2.0), (light, 0.5), (person, 0.125))
    ]
    frames = [one.astype(np.uint8) for one in codes]
    got, _ = merged(tmp_path, frames, (1.0, -1.0, -3.0))
    around = np.zeros(SHAPE, bool)
    around[162:298, 602:798] = True
    around &= cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) == 0
    np.testing.assert_allclose(
        got[around], np.tile(0.5 * light[165, 605], (around.sum(), 1)), rtol=0.04
    )


def test_clouds_that_drift(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    cloud = cv2.GaussianBlur(rng.random(SHAPE).astype(np.float32), (0, 0), 12.0)
    cloud = np.clip((cloud - cloud.mean()) / cloud.std(), 0.0, 2.0)[..., None]
    up = np.linspace(1.0, -1.0, SHAPE[0])[:, None, None] > 0.2
    ground = np.array([0.2, 0.18, 0.12], np.float32)
    skies = [
        np.array([0.5, 0.7, 1.1], np.float32) + np.roll(cloud, 20 * k, axis=1) for k in range(3)
    ]
    lights = [np.where(up, sky, ground).astype(np.float32) for sky in skies]
    frames = [
        np.rint(
            255.0 * curve_named("srgb").encode(np.clip(one * 2.0**stop / 2.0, 0.0, 1.0))
        ).astype(np.uint8)
        for one, stop in zip(lights, (1.0, 0.0, -1.0), strict=True)
    ]
    got, motion = merged(tmp_path, frames, (1.0, 0.0, -1.0))
    assert motion.where
    assert all(region.elevation_deg > 0.0 for region in motion.where)
    ghost, _ = merged(tmp_path, frames, (1.0, 0.0, -1.0), treated=False)
    treated, untreated = (foreign_tint(light, frames) for light in (got, ghost))
    assert np.quantile(treated, 0.999) <= 0.02
    assert treated.max() <= 0.05
    assert untreated.max() > 0.2


@pytest.mark.slow
def test_a_lamp_that_flickered_is_left_out(tmp_path: Path) -> None:
    light = scene("studio").copy()
    light[180:204, 300:324] = 20.0 * mean_luminance(light)
    dark = light.copy()
    dark[180:204, 300:324] = 0.05 * mean_luminance(light)
    frames = pictures("studio", [light, dark, light, light], FULL[:4])
    got, motion = merged(tmp_path, frames, FULL[:4])
    assert len(motion.where) == 1
    region = motion.where[0]
    assert 1 in region.frames
    assert region.azimuth_deg == pytest.approx(360.0 * (312 / 1024 - 0.5), abs=1.5)
    assert region.elevation_deg == pytest.approx(90.0 - 180.0 * 192 / 512, abs=1.5)
    assert "at azimuth -7" in sentences(motion.remarks)[0]
    without, _ = merged(tmp_path, pictures("studio", [light] * 4, FULL[:4]), FULL[:4])
    np.testing.assert_allclose(got[182:202, 302:322], without[182:202, 302:322], rtol=0.02)


def walker() -> list[np.ndarray]:
    """Proxies of a paper bracket with somebody who moved, 256 x 128."""
    lights = [with_person(scene("city"), azimuth)[0] for azimuth in (20.0, 40.0, 40.0)]
    return small(
        [
            develop(light, CAMERA, exposed(metered("city"), stop), noise=False)
            for light, stop in zip(lights, PAPER, strict=True)
        ]
    )


@pytest.mark.parametrize("columns", [1, 97, 128, 140, 146])
def test_the_seam_of_the_panorama_does_not_matter(columns: int) -> None:
    proxies = walker()
    here = trust(proxies, PAPER, srgb_response())
    there = trust([np.roll(p, columns, axis=1) for p in proxies], PAPER, srgb_response())
    assert [mask is None for mask in here.masks] == [False, True, True]
    assert there.masks[1:] == (None, None)
    first, second = here.masks[0], there.masks[0]
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(np.roll(first, columns, axis=1), second)
    assert there.share == pytest.approx(here.share)
    moved_by = (there.where[0].azimuth_deg - here.where[0].azimuth_deg) % 360.0
    assert moved_by == pytest.approx(360.0 * columns / 256, abs=1e-6)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0), (2, 1, 0)])
def test_frames_may_come_in_any_order(order: tuple[int, ...]) -> None:
    proxies = walker()
    motion = trust([proxies[k] for k in order], [PAPER[k] for k in order], srgb_response())
    straight = trust(proxies, PAPER, srgb_response())
    for index, mask in zip(order, motion.masks, strict=True):
        expected = straight.masks[index]
        assert (mask is None) == (expected is None)
        if mask is not None:
            np.testing.assert_array_equal(mask, expected)
    assert [r.frames for r in motion.where] == [(order.index(0),)]


def test_a_picture_that_is_no_panorama() -> None:
    rng = np.random.default_rng(3)
    light = cv2.GaussianBlur(rng.random((120, 160, 3)).astype(np.float32), (0, 0), 4.0)
    frames = []
    for index, gain in enumerate((1.0, 0.4, 0.16)):
        changed = light.copy()
        if index == 0:
            changed[50:80, :20] = (0.02, 0.2, 0.02)
        coded = curve_named("srgb").encode(np.clip(changed * gain, 0.0, 1.0))
        frames.append(np.rint(255.0 * coded).astype(np.uint8))
    stops = [float(np.log2(gain)) for gain in (1.0, 0.4, 0.16)]
    motion = trust(frames, stops, srgb_response())
    assert [mask is None for mask in motion.masks] == [False, True, True]
    mask = motion.masks[0]
    assert mask is not None
    assert not mask[50:80, :20].any()
    # What touches the left edge has nothing to do with the right one.
    assert mask[:, 30:].all()
    assert "7% from the left, 54% from the top" in sentences(motion.remarks)[0]
    assert motion.share == pytest.approx(np.mean(mask == 0), abs=1e-12)


def test_frames_of_different_places_are_said_to_be_so() -> None:
    proxies = small(
        [
            develop(scene(name), CAMERA, exposed(metered(name), stop), noise=False)
            for name, stop in (("city", 2.0), ("studio", 0.0), ("forest", -2.0))
        ]
    )
    motion = trust(proxies, PAPER, srgb_response())
    assert motion.share > 0.3
    assert "show different things" in sentences(motion.remarks)[-1]
    assert "Shoot the bracket again" in sentences(motion.remarks)[-1]


@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.floats(0.0, 4.0))
@settings(max_examples=60, deadline=None)
def test_every_pixel_keeps_a_frame(seed: int, number: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, 256, (number, 8, 16, 3), np.uint8)
    frames = [cv2.resize(one, (64, 32), interpolation=cv2.INTER_NEAREST) for one in coarse]
    stops = [-step * index for index in range(number)]
    motion = trust(frames, stops, srgb_response())
    used = [np.ones((32, 64)) if mask is None else mask for mask in motion.masks]
    assert np.max(used, axis=0).min() == 1.0
    assert set(np.unique(used)) <= {0.0, 1.0}
    assert 0.0 <= motion.share <= 1.0
    left_out = {frame for region in motion.where for frame in region.frames}
    assert left_out == {k for k, mask in enumerate(motion.masks) if mask is not None}


@given(st.integers(0, 255), st.floats(0.0, 6.0))
@settings(max_examples=200, deadline=None)
def test_light_that_stays_is_no_contradiction(code: int, step: float) -> None:
    # Any light as both frames code it, one code off each, flat all around.
    known = curve_named("srgb")
    light = known.decode(code / 255.0)
    dark = round(255.0 * float(known.encode(light)))
    bright = round(255.0 * float(known.encode(min(float(light) * 2.0**step, 1.0))))
    predictions = Predictions(srgb_response().table, (step, 0.0))
    for tolerance in (LOOSE, CLOSE):
        expected = predictions.between(0, 1, tolerance)
        for off in (-1, 0, 1):
            frames = [
                np.full((4, 4, 3), np.clip(value, 0, 255), np.uint8)
                for value in (bright - off, dark + off)
            ]
            assert not contradiction(frames[0], frames[1], expected).any()


@pytest.mark.parametrize(
    ("bright", "dark", "contradicts"),
    [
        (255, 255, False),  # both clipped
        (255, 140, False),  # the brighter one clips
        (255, 20, True),  # it should not have
        (100, 255, True),  # clipped in the darker frame must be clipped in the brighter one
        (200, 140, True),
        (0, 0, False),  # black in both
        (3, 0, False),
        (90, 0, True),  # no light for that much
        (0, 60, True),
        (118, 60, False),  # two stops, sRGB
        (118, 90, True),
        (118, 40, True),
    ],
)
def test_clipped_and_black_frames_only_say_at_least_and_at_most(
    bright: int, dark: int, contradicts: bool
) -> None:
    expected = Predictions(srgb_response().table, (0.0, -2.0)).between(0, 1, LOOSE)
    frames = [np.full((4, 4, 3), code, np.uint8) for code in (bright, dark)]
    assert contradiction(frames[0], frames[1], expected).any() == contradicts


def test_one_channel_is_enough() -> None:
    expected = Predictions(srgb_response().table, (0.0, -2.0)).between(0, 1, LOOSE)
    bright, dark = np.full((4, 4, 3), 118, np.uint8), np.full((4, 4, 3), 60, np.uint8)
    dark[2, 2, 2] = 120
    found = contradiction(bright, dark, expected)
    # Next to it the contrast may be an edge that is not quite aligned, but the pixel is not.
    assert found[0, 0] == 0
    bright[:], dark[:] = (118, 118, 40), (60, 60, 60)
    assert contradiction(bright, dark, expected).all()


def test_what_does_not_fit_together_is_refused() -> None:
    frame = np.zeros((32, 64, 3), np.uint8)
    with pytest.raises(ValueError, match="same shape"):
        trust([frame, frame[:16]], (0.0, -2.0), srgb_response())
    with pytest.raises(ValueError, match="an exposure"):
        trust([frame, frame], (0.0,), srgb_response())
    assert trust([frame], (0.0,), srgb_response()) == FrameTrust((None,))
