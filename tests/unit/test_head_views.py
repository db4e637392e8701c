"""Heads seen from aside: what a file of views keeps, mirror images, and files that are no use."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.portrait.head_views import (
    YAWS,
    HeadViews,
    load_views,
    pack_view,
    save_views,
    views_path,
)
from app.core.solver.head_shape import load_shape_of
from app.core.solver.transport import load_named, render, to_image
from tests.helpers.shipped import generic_pack, generic_views

SHIPPED = views_path(resources() / "transport" / "generic.npz")


def some_light(seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).random((32, 64, 3)).astype(np.float32)


def test_there_are_seven_yaws() -> None:
    assert generic_views().yaws == (-45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0)
    assert [generic_views().nearest(yaw) for yaw in (7.0, 8.0, -40.0, 7.5)] == [
        0.0,
        15.0,
        -45.0,
        0.0,
    ]


@pytest.mark.parametrize("yaw", YAWS)
def test_the_other_side_is_the_mirror_image(yaw: float) -> None:
    light = some_light()
    here, there = (
        generic_views().at(yaw, generic_pack().styles),
        generic_views().at(-yaw, generic_pack().styles),
    )
    one = to_image(here.transport, render(here.transport, light))
    two = to_image(there.transport, render(there.transport, light[:, ::-1]))
    np.testing.assert_allclose(two[:, ::-1], one, rtol=1e-4, atol=1e-5)
    np.testing.assert_array_equal(
        there.shape.positions[:, 0].max(), -here.shape.positions[:, 0].min()
    )


def test_a_face_turned_to_its_own_left_shows_its_right_ear() -> None:
    """Frame: +X is the sitter's left, and image right."""
    seen = generic_views().at(45.0, generic_pack().styles).shape.positions[:, 0]
    assert seen.min() < -0.07 < 0.07 < seen.max() < 0.13
    nose = generic_views().at(45.0, generic_pack().styles)
    tip = nose.transport.pixels[nose.shape.positions[:, 2].argmax()] % nose.transport.size
    assert tip > nose.transport.size / 2 + 10


@pytest.mark.parametrize("yaw", YAWS)
def test_a_view_is_as_bright_as_the_face_from_the_front(yaw: float) -> None:
    """In light that is the same all round, skin looks the same from anywhere."""
    even = np.ones((32, 64, 3), np.float32)
    front = load_named("generic")
    straight = np.median(render(front, even)[front.face], axis=0)
    view = generic_views().at(yaw, generic_pack().styles).transport
    np.testing.assert_allclose(
        np.median(render(view, even)[view.face], axis=0), straight, rtol=0.08
    )


def test_views_survive_their_file(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    front, shape = load_named("generic"), load_shape_of(load_named("generic"), "generic")
    half = rng.normal(size=(6, 32, 32)).astype(np.float32)
    basis = np.concatenate([half, half[:, :, ::-1] * np.array([1, -1] * 3)[:, None, None]], axis=2)
    basis = basis.reshape(6, -1).astype(np.float32)
    part = pack_view(
        grey=rng.normal(size=(9, 6)).astype(np.float32),
        tints=rng.normal(size=(2, 9, 4)).astype(np.float32),
        pixels=np.arange(9, dtype=np.int32) * 100,
        coverage=rng.random(9).astype(np.float32),
        positions=(rng.random((9, 3)).astype(np.float32) - 0.5) * 0.2,
        targets=rng.random((25, 9)).astype(np.float32),
        size=front.size,
    )
    save_views(tmp_path / "v.npz", front, basis, {20.0: part})
    found = load_views(tmp_path / "v.npz", front.digest, shape)
    assert found.yaws == (-20.0, 0.0, 20.0)
    np.testing.assert_allclose(found.texel_basis, basis, atol=np.abs(basis).max() / 1000)
    for name, values in part.items():
        np.testing.assert_array_equal(found.parts[20.0][name], values, err_msg=name)


@pytest.mark.parametrize("what", ["cut", "other head", "not views", "missing"])
def test_a_file_that_is_no_use_is_refused(what: str, tmp_path: Path) -> None:
    path, digest = tmp_path / "x.views.npz", generic_pack().header.transport_sha256
    if what == "cut":
        path.write_bytes(SHIPPED.read_bytes()[:-2000])
    elif what == "other head":
        path.write_bytes(SHIPPED.read_bytes())
        digest = "0" * 64
    elif what == "not views":
        path.write_bytes((resources() / "transport" / "generic.shape.npz").read_bytes())
    with pytest.raises(TransportError) as error:
        load_views(path, digest, generic_views().shape)
    assert error.value.hint


def test_a_head_that_is_not_symmetric_has_no_mirror_images() -> None:
    alone = HeadViews(
        replace(generic_views().header, symmetric=False),
        generic_views().shape,
        generic_views().texel_basis,
        generic_views().parts,
    )
    assert alone.yaws == (0.0, 15.0, 30.0, 45.0)
