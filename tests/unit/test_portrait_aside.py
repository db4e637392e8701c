"""Portraits from aside: against the views' transports, against yaw 0, and by symmetry."""

from __future__ import annotations

import argparse
import json
import math
import time
import zipfile
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest

from app.commands import render as render_command
from app.core.base.archive import write_sealed
from app.core.base.colour import luminance
from app.core.base.errors import TransportError
from app.core.base.imaging.images import write_exr
from app.core.base.paths import resources
from app.core.environment.environment import Environment
from app.core.measure.finish.findings import Findings
from app.core.portrait import portrait_file
from app.core.portrait.catchlights import catchlights
from app.core.portrait.full_size_portrait import portrait_picture, portrait_pictures
from app.core.portrait.head import load_head
from app.core.portrait.head_views import YAWS, load_views_of
from app.core.portrait.light import ROUGHNESS, lamps_light, portrait_light
from app.core.portrait.portrait_file import HAIRS, load_portrait
from app.core.portrait.portrait_head import PortraitHead, PortraitSkin
from app.core.portrait.turned_portrait import mirrored
from app.core.solver.place_light import Facing, picture_at, prepare
from app.core.solver.transport import render, to_image
from app.core.styles.style import StyleLamp
from app.core.styles.style_pack_file import load_named_pack
from tests.helpers.cases import sample_first
from tests.unit.test_portrait_picture import HEADS, as_transport, soft_sky

BOTH = [sign * yaw for yaw in YAWS for sign in (1, -1)]


def turned(
    yaw: float, hair: str = "plain", head: str = "generic", skin: str = "medium"
) -> tuple[PortraitHead, PortraitSkin]:
    found = load_portrait(head, skin, hair, yaw)
    assert found is not None
    return found


@pytest.mark.parametrize(("head", "skin"), HEADS)
@pytest.mark.parametrize("yaw", sample_first([30.0, 15.0, -45.0], 1))
def test_it_agrees_with_the_views_transport_in_soft_light(head: str, skin: str, yaw: float) -> None:
    name = head if skin == "medium" else f"{head}-{skin}"
    pack = load_named_pack(name)
    try:
        transport = load_views_of(pack, name).at(yaw, pack.styles).transport
    except TransportError:
        pytest.skip("no views of this head ship")
    for azimuth in (0.0, 60.0, -110.0):
        sky = soft_sky(azimuth)
        small = np.asarray(cv2.resize(sky, (64, 32), interpolation=cv2.INTER_AREA), np.float32)
        wanted = to_image(transport, render(transport, small))
        picture = portrait_picture(*turned(yaw, head=head, skin=skin), portrait_light(sky), 0.0)
        found = as_transport(picture, transport.size)
        whole = np.zeros(transport.size**2, bool)
        whole[transport.pixels[transport.coverage > 0.999]] = True
        whole = cv2.erode(whole.reshape(100, 100).astype(np.uint8), np.ones((3, 3))) > 0
        np.testing.assert_allclose(found[whole].mean(0), wanted[whole].mean(0), rtol=0.03)
        away = np.sqrt(((found - wanted)[whole] ** 2).mean() / (wanted[whole] ** 2).mean())
        assert away < 0.06


@pytest.mark.parametrize("hair", ["plain", *HAIRS])
@pytest.mark.parametrize("yaw", sample_first(YAWS, 1))
def test_the_other_side_is_the_mirror_image_in_mirrored_light(hair: str, yaw: float) -> None:
    sky = soft_sky(70.0)
    sky[40:42, 100:102] = 300
    lights = [portrait_light(one) for one in (sky, sky[:, ::-1])]
    one, other = (turned(side, hair) for side in (yaw, -yaw))
    here, there = (
        portrait_picture(*who, light, turn)
        for who, light, turn in zip((one, other), lights, (25.0, -25.0), strict=True)
    )
    np.testing.assert_allclose(here[:, ::-1], there, rtol=2e-3, atol=2e-3 * float(here.mean()))
    np.testing.assert_array_equal(one[0].coverage[:, ::-1], other[0].coverage)
    # Not the same picture by chance.
    assert np.abs(here - there).mean() > 0.05 * here.mean()


def test_even_light_gives_exact_mirror_images() -> None:
    light = portrait_light(np.ones((64, 128, 3), np.float32))
    one, other = (portrait_picture(*turned(yaw, "long"), light, 0.0) for yaw in (30.0, -30.0))
    np.testing.assert_allclose(one[:, ::-1], other, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("yaw", sample_first(BOTH, 2))
def test_the_face_has_the_colours_that_it_has_from_the_front(yaw: float) -> None:
    light = portrait_light(np.ones((64, 128, 3), np.float32))

    def skin(yaw: float) -> np.ndarray:
        head, tone = turned(yaw, "short")
        half = head.halved
        picture = portrait_picture(half, tone, light, 0.0)
        side = picture.shape[0]
        # Cheeks, nose and mouth, where the vertical through the ears is in the middle.
        middle = round(side * (0.5 + 0.17 * math.sin(math.radians(yaw))))
        part = picture[round(0.45 * side) : round(0.75 * side), middle - 25 : middle + 25]
        return np.asarray(part.reshape(-1, 3).mean(axis=0))

    np.testing.assert_allclose(skin(yaw), skin(0.0), rtol=0.12)
    ratio = skin(yaw) / skin(0.0)
    np.testing.assert_allclose(ratio / ratio.mean(), 1, atol=0.06)


@pytest.mark.parametrize("hair", HAIRS)
def test_nothing_is_negative_in_hard_sun(hair: str) -> None:
    for azimuth in range(-180, 180, 60):
        light = lamps_light([StyleLamp(float(azimuth), 35.0, 0.53, 1.0, 9.0)])
        picture = portrait_picture(*turned(45.0, hair), light, 0.0)
        assert picture.min() >= 0
        assert np.isfinite(picture).all()


def test_the_lit_side_follows_the_lamp() -> None:
    """The head's own left, which is right in the picture, whatever the yaw."""
    left, right = (lamps_light([StyleLamp(a, 20.0, 10.0, 1.0, 2.0)]) for a in (70.0, -70.0))
    for yaw in (-30.0, 0.0, 30.0):
        head, skin = turned(yaw)
        one, other = (portrait_picture(head.halved, skin, light, 0.0) for light in (left, right))
        columns = np.arange(one.shape[1])
        place = [
            float((luminance(p).sum(axis=0) * columns).sum() / luminance(p).sum())
            for p in (one, other)
        ]
        assert place[0] > place[1] + 20


@pytest.mark.parametrize("yaw", sample_first(BOTH, 2))
def test_a_lamp_before_the_nose_is_mirrored_on_the_side_of_the_lens(yaw: float) -> None:
    """Half-way between lamp and lens; the lens is on the other side than the face turns to."""
    light = lamps_light([StyleLamp(0.0, 30.0, 14.0, 3.0, 2.0)])
    head, skin = turned(yaw)
    found = catchlights(head, light, portrait_picture(head, skin, light, 0.0), 0.0, Findings())
    assert found
    near = "right" if yaw > 0 else "left"
    assert near in {one.eye for one in found}
    for one in found:
        across = (one.clock + 6) % 12 - 6
        assert -4 < across < 0.3 if yaw > 0 else -0.3 < across < 4


def test_small_heads_alone_show_what_whole_ones_show() -> None:
    head, skin = turned(30.0, "short")
    light = lamps_light([StyleLamp(40.0, 25.0, 8.0, 1.0, 3.0)])
    whole, close = (portrait_picture(one, skin, light, 0.0) for one in (head, head.close))
    kept = close.any(axis=2)
    assert kept.mean() > 0.3
    np.testing.assert_allclose(close[kept], whole[kept], rtol=1e-4, atol=1e-6)
    assert head.halved is head


def test_what_surfaces_mirror_is_what_was_baked_for_the_front() -> None:
    """The bake followed rays; from aside the same share is added up over facets."""
    head, _ = turned(0.0)
    seen = head.visible
    gain, way = mirrored(head.nodes, seen.index, seen.normals, seen.view, ROUGHNESS)
    skin = ~seen.eye & (seen.straight > 0.3)
    assert gain[skin].mean() == pytest.approx(seen.gain[skin].mean(), rel=0.03)
    assert np.corrcoef(gain[skin], seen.gain[skin])[0, 1] > 0.85
    assert (way * seen.way)[skin].sum(axis=1).mean() > 0.98


@pytest.mark.slow
@pytest.mark.alone
def test_a_gallery_from_aside_takes_little_longer_than_from_the_front() -> None:
    light = portrait_light(soft_sky(20.0))
    turns = [14.4 * number for number in range(25)]

    def seconds(yaw: float) -> float:
        head, skin = turned(yaw, "short")
        # Of the processor, not of the clock: other tests are busy at the same time.
        started = time.thread_time()
        assert len(list(portrait_pictures(head.close, skin, light, turns))) == 25
        return time.thread_time() - started

    for yaw in (0.0, 30.0):
        seconds(yaw)
    times = [(seconds(30.0), seconds(0.0)) for _ in range(5)]
    aside, front = (min(one[k] for one in times) for k in (0, 1))
    assert aside < 1.6 * front


def _copied(folder: Path) -> None:
    (folder / "portraits").mkdir()
    for file in (resources() / "portraits").glob("female*"):
        (folder / "portraits" / file.name).write_bytes(file.read_bytes())


def _forget() -> None:
    for each in (portrait_file._straight, portrait_file._seen_aside, portrait_file._aside):
        each.cache_clear()


@pytest.mark.parametrize(
    ("end", "name"),
    sample_first([("", "positions"), ("-medium", "share"), ("-hair-short", "basis_30")], 1),
)
def test_a_file_that_contradicts_itself_is_refused(
    end: str, name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    _copied(tmp_path)
    monkeypatch.setattr("app.core.portrait.portrait_file.resources", lambda: tmp_path)
    _forget()
    try:
        assert load_portrait("female", "medium", "short", 30.0) is not None
        file = tmp_path / "portraits" / f"female{end}-aside.npz"
        arrays = dict(np.load(file))
        header = json.loads(arrays.pop("header").tobytes())
        write_sealed(file, arrays | {name: arrays[name][:-1]}, header)
        _forget()
        with pytest.raises(TransportError, match="inconsistent"):
            load_portrait("female", "medium", "short", 30.0)
        file.write_bytes(b"PK")
        _forget()
        with pytest.raises(TransportError, match="damaged"):
            load_portrait("female", "medium", "short", 30.0)
        (tmp_path / "portraits" / "female-aside.npz").unlink()
        _forget()
        assert load_portrait("female", "medium", "short", 30.0) is None
    finally:
        _forget()


def test_a_yaw_that_is_not_baked_is_refused() -> None:
    with pytest.raises(TransportError, match="inconsistent"):
        load_portrait("generic", "medium", "plain", 20.0)


def test_packing_smaller_changes_nothing(tmp_path: Path) -> None:
    values, sizes = np.repeat(np.arange(2000, dtype=np.int16), 7), []
    for packing in (zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA):
        file = tmp_path / f"{packing}.npz"
        write_sealed(file, {"values": values}, {"format_version": 1}, packing=packing)
        sizes.append(file.stat().st_size)
        np.testing.assert_array_equal(np.load(file)["values"], values)
    assert sizes[1] < sizes[0]


def test_replacing_hair_leaves_the_view_as_it_is() -> None:
    head, skin = turned(45.0, "long")
    bare, light = replace(head, hair=None), portrait_light(np.ones((64, 128, 3), np.float32))
    one, other = (portrait_picture(each, skin, light, 0.0) for each in (head, bare))
    assert head.hair is not None
    free = np.ones(head.inside.size, bool)
    free[head.hair.pixel] = False
    np.testing.assert_array_equal(one.reshape(-1, 3)[free], other.reshape(-1, 3)[free])


@pytest.mark.parametrize("yaw", [30.0, -45.0])
def test_full_size_replaces_the_quick_picture_without_a_jump(yaw: float) -> None:
    head = load_head("generic", in_place=True).turned(yaw)
    light = prepare(Environment(soft_sky(60.0).astype(np.float32), "soft"))
    lit = [Facing(light, 10.0)]
    linear = [picture_at(head.transport, light, 10.0)]
    for size in ((256, 200), (512, 410)):
        (quick,), (full,) = (
            head.portraits(linear, size, lit, quick=quick) for quick in (True, False)
        )
        assert quick.shape == full.shape == (*size, 3)
        small = [cv2.GaussianBlur(one, (0, 0), size[0] / 40).astype(float) for one in (quick, full)]
        assert np.abs(small[0] - small[1]).mean() < 4
        assert abs(quick.mean() - full.mean()) < 2


def pixels(path: Path) -> np.ndarray:
    buffer = oiio.ImageBuf(str(path))
    return np.asarray(buffer.get_pixels(buffer.spec().format))


def test_render_draws_it_with_the_place_behind_it(tmp_path: Path) -> None:
    """In a place that is its own mirror image, the two sides are each other's."""
    sky = soft_sky(0.0)
    write_exr(tmp_path / "hall.exr", (sky + sky[:, ::-1]) / 2)
    found = []
    for yaw in (30, -30):
        parser = argparse.ArgumentParser()
        render_command.add_arguments(parser)
        words = ["--turn", str(yaw), "--yaw", str(yaw), "--size", "160", "-o", f"{yaw}.exr"]
        words[-1] = str(tmp_path / words[-1])
        args = parser.parse_args([str(tmp_path / "hall.exr"), *words])
        assert args.run(args) == 0
        found.append(pixels(tmp_path / f"{yaw}.exr"))
    assert found[0].shape == (160, 128, 3)
    assert found[0].min() > 0
    np.testing.assert_allclose(found[0][:, ::-1], found[1], rtol=0.02, atol=0.01)
