"""Baking against analytic cases, stock Mitsuba and itself."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from app.core.baking.kernel_lanes import select_variant
from app.core.baking.light_sources import compress, mirror_pixels, symmetrise, texel_noise
from app.core.baking.skin import SKINS, dipole_reflectance, find_skin
from app.core.base.errors import BakeError, Cancelled, HeadError
from app.core.base.paths import resources
from app.core.base.progress import Progress, Token
from benchmarks.speed.plain_search import matrix
from tests.helpers.meshes import sphere, write_obj

needs_llvm = pytest.mark.llvm
HEADS = resources() / "heads"


def test_dipole_gives_the_published_reflectance_of_skin1() -> None:
    # Jensen et al. 2001, figure 5: skin1 has diffuse reflectance 0.44, 0.22, 0.13 at index 1.3.
    found = [dipole_reflectance(a, 1.3) for a in find_skin("medium").albedo]
    assert found == pytest.approx([0.44, 0.22, 0.13], abs=0.01)


def test_tones_reproduce_their_published_reflectance() -> None:
    for name, published in (("light", (0.539, 0.305, 0.223)), ("dark", (0.171, 0.084, 0.058))):
        found = [dipole_reflectance(a, 1.3) for a in find_skin(name).albedo]
        assert found == pytest.approx(published, abs=1e-6)
    assert all(skin.source for skin in SKINS)


def test_unknown_skin_and_variant_are_refused_with_the_known_ones() -> None:
    with pytest.raises(BakeError, match="light, medium, dark"):
        find_skin("green")
    with pytest.raises(BakeError, match="scalar"):
        select_variant("abacus")


def test_mirrored_pixels() -> None:
    size = 10
    pixels = np.array([3, 6, 12, 17, 44], np.int32)
    assert mirror_pixels(pixels, size).tolist() == [1, 0, 3, 2, 4]


def test_symmetrise_is_exact_and_tells_the_noise() -> None:
    from app.core.baking.light_sources import TexelColumns

    rng = np.random.default_rng(1)
    texels = TexelColumns(4, 8)
    half = rng.random((30, 4, 8, 3)).astype(np.float32) + 1
    pixels = np.arange(60, dtype=np.int32)
    twin = mirror_pixels(pixels, 60)
    clean = np.concatenate([half, half[::-1][:, :, ::-1]]).reshape(60, 32, 3)
    noisy = clean * (1 + 0.1 * rng.standard_normal(clean.shape).astype(np.float32))
    symmetric, noise = symmetrise(noisy, twin, texels)
    mirrored = symmetric[twin].reshape(60, 4, 8, 3)[:, :, ::-1].reshape(60, 32, 3)
    np.testing.assert_array_equal(symmetric, mirrored)
    assert noise == pytest.approx(0.1 / math.sqrt(2), rel=0.1)
    assert np.median(texel_noise(noisy, clean)) == pytest.approx(0.1 / math.sqrt(2), rel=0.1)


def test_compress_keeps_a_low_rank_matrix_and_its_mirror_symmetry() -> None:
    from app.core.baking.light_sources import TexelColumns

    rng = np.random.default_rng(2)
    texels = TexelColumns(4, 8)
    matrix = np.einsum("prc,rt->ptc", rng.random((50, 5, 3)), rng.random((5, 32)))
    pixel_basis, texel_basis, lost = compress(matrix.astype(np.float32), texels, 10)
    again = np.einsum("cpr,rt->ptc", pixel_basis, texel_basis)
    np.testing.assert_allclose(again, matrix, rtol=2e-4)
    assert lost < 1e-3
    mirrored = texel_basis.reshape(-1, 4, 8)[:, :, ::-1].reshape(-1, 32)
    even = np.abs(mirrored - texel_basis).max(axis=1)
    odd = np.abs(mirrored + texel_basis).max(axis=1)
    assert np.minimum(even, odd).max() < 1e-6


@needs_llvm
class TestWithMitsuba:
    """Everything that traces rays."""

    @pytest.fixture(autouse=True)
    def _variant(self) -> None:
        select_variant("llvm")

    @pytest.mark.parametrize("name", ["generic", "female", "male"])
    def test_no_pixel_sees_the_cut_or_misses_the_crown(self, name: str) -> None:
        import mitsuba as mi

        from app.core.baking.scene import build_scene, frame_head, load_head

        head = load_head(name, HEADS / f"{name}.ply", HEADS / f"{name}-eyes.ply")
        camera = frame_head(head, 400)
        scene = build_scene(head, find_skin("medium"), camera)
        grid = (np.arange(400, dtype=np.float32) + 0.5) / 400
        x, y = np.meshgrid(grid, grid)
        film = mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel()))
        ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
        si = scene.ray_intersect(ray)
        hit = np.array(si.is_valid()).reshape(400, 400)
        height = np.array(si.p).reshape(3, -1)[1].reshape(400, 400)
        down = np.array(si.n).reshape(3, -1)[1].reshape(400, 400) < -0.99
        cut = float(head.skin.vertices[:, 1].min())
        assert not (hit & down & (height < cut + 0.01)).any()
        assert not hit[0].any()
        assert hit[20].any()
        assert hit[-1].sum() > 50
        assert height[hit].min() > cut + 0.01
        assert 7 < camera.fov_deg <= 9

    def test_white_furnace(self, tmp_path: Path) -> None:
        # Without absorption, under radiance 1 from everywhere, everything is 1, less the share that
        # a single-scattering microfacet surface loses.
        from dataclasses import replace

        from app.core.baking.exposure import vertex_points
        from app.core.baking.random_walk import scene_tables
        from app.core.baking.scene import build_scene, frame_head, load_head
        from benchmarks.truth.plain_walk import trace_plainly

        head = load_head("sphere", write_obj(tmp_path / "s.obj", *sphere()), None)
        # A thin medium: in a dense one some walks never come out of the middle of the sphere.
        white = replace(
            find_skin("medium"),
            scattering=(0.02, 0.03, 0.04),
            absorption=(0.0, 0.0, 0.0),
            roughness=0.05,
        )
        camera = frame_head(head, 16)
        scene = build_scene(head, white, camera)
        tables = scene_tables(scene, head, white, vertex_points(head), 16)
        middle = np.array([16 * 8 + 8, 16 * 7 + 7], np.int32)
        total = trace_plainly(tables, middle, 20_000, 1, (8, 16)).sum(axis=1)
        assert total == pytest.approx(np.ones((2, 3)), abs=0.03)

    def test_product_equals_plain_path_tracing(self, tmp_path: Path) -> None:
        from app.core.baking.bake import bake
        from app.core.baking.exposure import vertex_points
        from app.core.baking.quality import Quality
        from app.core.baking.random_walk import scene_tables
        from app.core.baking.scene import build_scene, frame_head, load_head
        from benchmarks.truth.plain_walk import trace_plainly

        head = load_head("generic", HEADS / "generic.ply", HEADS / "generic-eyes.ply")
        skin = find_skin("medium")
        shape, size = (8, 16), 12
        baked = bake(
            head,
            skin,
            (),
            environment=shape,
            picture=size,
            quality=Quality(paths=4096, glints=256, shadows=8, rank=128),
            seed=3,
            work=tmp_path,
            report=lambda fraction, message: None,
            token=Token(),
        )
        transport = baked.transport
        ours = np.stack([matrix(transport, c) for c in range(3)], axis=-1).astype(np.float64)
        camera = frame_head(head, size)
        scene = build_scene(head, skin, camera)
        tables = scene_tables(scene, head, skin, vertex_points(head), size)
        one, two = (trace_plainly(tables, transport.pixels, 16_384, s, shape) for s in (8, 9))
        mean = (one + two).astype(np.float64) / 2
        assert ours.mean(axis=(0, 1)) == pytest.approx(mean.mean(axis=(0, 1)), rel=0.01)
        noise = np.square(one - two).mean(axis=(0, 2)) / 4
        error = np.square(ours - mean).mean(axis=(0, 2))
        power = np.square(mean).mean(axis=(0, 2))
        beyond = np.sqrt(np.maximum(error - noise, 0) / power)
        upper = power > 0.05 * power.max()
        assert np.median(beyond[upper]) < 0.05

    def test_exported_scene_is_the_baked_scene(self, tmp_path: Path) -> None:
        import mitsuba as mi

        from app.core.baking.scene import build_scene, export_scene, frame_head, load_head

        head = load_head("generic", HEADS / "generic.ply", HEADS / "generic-eyes.ply")
        skin, camera = find_skin("light"), frame_head(head, 24)
        file = export_scene(tmp_path / "scene", head, skin, camera)
        text = file.read_text()
        lit = text.replace("</scene>", '<emitter type="constant"/></scene>')
        file.write_text(lit)
        one = np.array(mi.render(mi.load_file(str(file)), spp=64, seed=1))
        same = build_scene(head, skin, camera, {"light": {"type": "constant"}})
        integrators = [str(scene.integrator()) for scene in (mi.load_file(str(file)), same)]
        # An earlier roulette makes volpathmis darker than it should be; see `build_scene`.
        assert integrators[0] == integrators[1]
        assert "rr_depth = 128" in integrators[0]
        two = np.array(mi.render(same, spp=64, seed=1))
        np.testing.assert_allclose(one.mean(axis=(0, 1)), two.mean(axis=(0, 1)), rtol=0.01)
        assert np.abs(one - two).mean() / two.mean() < 0.2
        hit = two[8:20, 8:16]
        assert hit.mean() < 0.9

    def test_a_stopped_bake_goes_on_and_ends_the_same(self, tmp_path: Path) -> None:
        from app.core.baking.bake import bake
        from app.core.baking.quality import Quality
        from app.core.baking.scene import load_head

        head = load_head("generic", HEADS / "generic.ply", HEADS / "generic-eyes.ply")

        def run(work: Path, token: Token, stop_at: float = 2.0) -> np.ndarray:
            def report(fraction: float, step: Progress) -> None:
                if fraction >= stop_at:
                    token.cancel()

            baked = bake(
                head,
                find_skin("medium"),
                (),
                environment=(4, 8),
                picture=32,
                quality=Quality(paths=16, glints=4, shadows=2, rank=8),
                seed=5,
                work=work,
                report=report,
                token=token,
            )
            return baked.transport.luminance_basis @ baked.transport.texel_basis

        whole = run(tmp_path / "a", Token())
        with pytest.raises(Cancelled):
            run(tmp_path / "b", Token(), stop_at=0.4)
        assert list((tmp_path / "b").rglob("*.npz"))
        again = run(tmp_path / "b", Token())
        np.testing.assert_allclose(again, whole, rtol=1e-4, atol=1e-6)
        assert not list(tmp_path.rglob("*.npz"))

    def test_bad_heads_are_refused_with_a_sentence(self, tmp_path: Path) -> None:
        from app.core.baking.scene import load_head

        vertices, faces = sphere(1)
        with pytest.raises(HeadError, match="no head file"):
            load_head("x", tmp_path / "missing.ply", None)
        (tmp_path / "bad.ply").write_bytes(b"ply\nformat nonsense\n")
        with pytest.raises(HeadError, match="damaged"):
            load_head("x", tmp_path / "bad.ply", None)
        with pytest.raises(HeadError, match="not a PLY or OBJ"):
            load_head("x", write_obj(tmp_path / "a.txt", vertices, faces), None)
        with pytest.raises(HeadError, match="not closed: 3 edges"):
            load_head("x", write_obj(tmp_path / "open.obj", vertices, faces[1:]), None)
        with pytest.raises(HeadError, match="20 mm tall"):
            load_head("x", write_obj(tmp_path / "s.obj", vertices, faces), None, unit_mm=10)
        inside_out = write_obj(tmp_path / "i.obj", vertices, faces[:, ::-1])
        head = load_head("x", inside_out, None)
        centre = head.skin.vertices[head.skin.faces].mean(axis=1)
        a, b, c = (head.skin.vertices[head.skin.faces[:, i]] for i in range(3))
        assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), centre) > 0).all()
