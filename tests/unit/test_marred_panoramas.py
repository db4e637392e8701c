"""Panoramas that do not hold all light: clipped, with gaps, with several layers, with infinity."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest

from app.cli import main
from app.core.base.angles import difference
from app.core.base.colour import srgb_encode
from app.core.base.paths import resources
from app.core.base.sphere import solid_angles
from app.core.environment.clipping import plateau
from app.core.environment.environment import Environment, from_radiance, read_environment, reduce
from app.core.environment.holes import canvas
from app.core.environment.layers import LayerError
from app.core.environment.remarks import LayerChosen, PartUnseen
from app.core.measure.bracket.measure import measure
from app.core.measure.finish.doubtful_answers import doubt_of
from app.core.measure.options import MeasureOptions
from app.core.solver.solve import solve_all
from app.core.styles.style_pack_file import load_named_pack
from app.words.remarks import sentences
from tests.helpers.cases import sample_first
from tests.helpers.probes import place
from tests.helpers.shared import SHARED, needs_shared

SCENES = ("city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset")
SHAPE = (128, 256)
Pixels = np.ndarray


def scene(name: str) -> Pixels:
    """A measured place, (512, 1024, 3)."""
    return np.array(read_environment(resources() / "demo" / "scenes" / f"{name}.exr").radiance)


def small(name: str) -> Pixels:
    """The same at (128, 256)."""
    return cv2.resize(scene(name), SHAPE[::-1], interpolation=cv2.INTER_AREA)


def write(
    path: Path,
    pixels: Pixels,
    names: Sequence[str] = (),
    kind: str = "float",
    compression: str = "zip",
    **more: object,
) -> Path:
    """Write a picture; `more` sets fields of the ImageSpec or attributes."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.attribute("compression", compression)
    if names:
        spec.channelnames = tuple(names)
    for key, value in more.items():
        if hasattr(spec, key):
            setattr(spec, key, value)
        else:
            spec.attribute(key.replace("_", ":"), value)
    with_spec(path, spec, pixels)
    return path


def with_spec(path: Path, spec: oiio.ImageSpec, pixels: Pixels) -> None:
    """Write a picture by its specification."""
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels)), output.geterror()
    assert output.close()


def nadir(share: float, shape: tuple[int, int] = SHAPE) -> Pixels:
    """(H, W) bool, the lowest part of the sphere."""
    heights = np.sin(np.radians(90.0 - (np.arange(shape[0]) + 0.5) * 180.0 / shape[0]))
    return np.repeat((heights < 2.0 * share - 1.0)[:, None], shape[1], axis=1)


def share_of(mask: Pixels) -> float:
    """Share of the sphere."""
    areas = solid_angles((mask.shape[0], mask.shape[1])) * mask.shape[1] / (4.0 * np.pi)
    return float((mask.mean(axis=1) * areas).sum())


class TestClipped:
    @pytest.mark.parametrize("name", SCENES)
    def test_a_measured_place_is_not_clipped(self, name: str) -> None:
        assert plateau(scene(name)) is None

    @pytest.mark.parametrize("name", sample_first(SCENES, 3))
    @pytest.mark.parametrize("ending", ["exr", "hdr", "half.exr", "dwaa.exr", "tif"])
    def test_eight_times_the_median_is_told_in_any_file(
        self, tmp_path: Path, name: str, ending: str
    ) -> None:
        light = scene(name)
        level = 8.0 * float(np.median(light.max(axis=-1)))
        light = np.minimum(light, level) * np.float32(1000.0 / level)
        kind = "half" if "." in ending else "float"
        packing = "dwaa" if "dwaa" in ending else "zip"
        file = write(tmp_path / f"clipped.{ending}", light, kind=kind, compression=packing)
        environment = read_environment(file)
        assert environment.clipped is not None
        found = environment.clipped > 0.5
        truth = light.max(axis=-1) >= 999.9
        assert (found & truth).sum() >= 0.9 * truth.sum()
        assert any("clipped" in line for line in sentences(environment.warnings))

    @pytest.mark.parametrize("name", SCENES)
    def test_two_stops_under_the_brightest_lamp_is_told(self, name: str) -> None:
        light = scene(name)
        clipped = np.minimum(light, light.max() / 4.0)
        assert plateau(clipped) is not None
        # Two texels of the sunset, each clipped in another channel, are too few.
        if name != "sunset":
            assert plateau(clipped * np.array([0.5, 1.0, 1.7], np.float32)) is not None

    def test_an_even_panel_and_a_point_lamp_are_not_clipped(self) -> None:
        panel = place([(30.0, 20.0, 25.0, 50.0)], (256, 512))
        assert plateau(panel) is None
        assert plateau(np.full((64, 128, 3), 0.7, np.float32)) is None
        point = place([], (64, 128))
        point[20, 30] = 1000.0
        assert plateau(point) is None

    def test_styles_that_need_more_light_are_doubtful(self) -> None:
        """Two lamps at one value: which is the brighter is not known."""
        light = place([(-70.0, 15.0, 30.0, 8.0), (80.0, 40.0, 30.0, 8.0)], (64, 128))
        marks = (light.max(axis=-1) >= 8.0).astype(np.float32)
        pack = load_named_pack("generic")
        doubt = doubt_of(Environment(light, "two", clipped=marks), pack)
        assert doubt is not None
        assert "left-split" in doubt.clipped
        assert "right-split" in doubt.clipped
        assert doubt.unseen == ()
        assert doubt_of(Environment(light, "two"), pack) is None


class TestInfinite:
    @pytest.mark.parametrize("kind", ["half", "float"])
    def test_infinite_texels_are_beyond_a_half_float_and_clipped(
        self, tmp_path: Path, kind: str
    ) -> None:
        light = small("courtyard")
        light[40, 60] = np.inf
        environment = read_environment(write(tmp_path / "sun.exr", light, kind=kind))
        assert environment.radiance[40, 60].min() >= 65504.0
        assert environment.repairs.infinite == 1
        assert environment.clipped is not None
        assert environment.clipped[40, 60] == 1.0
        assert environment.clipped.sum() == 1.0

    def test_a_brighter_rest_is_the_least_that_infinity_is(self) -> None:
        light = small("courtyard")
        light[3, 3], light[40, 60] = 1e6, np.inf
        assert from_radiance(light, "hall").radiance[40, 60].min() == 1e6

    def test_a_full_half_float_is_clipped(self, tmp_path: Path) -> None:
        light = small("courtyard")
        light[40, 60] = 65504.0
        environment = read_environment(write(tmp_path / "sun.exr", light, kind="half"))
        assert environment.clipped is not None
        assert np.flatnonzero(environment.clipped).tolist() == [40 * 256 + 60]

    def test_other_primaries_keep_it_infinite(self, tmp_path: Path) -> None:
        """ACES AP0: a matrix with negative parts makes infinity minus infinity of it."""
        light = small("courtyard")
        light[40, 60] = np.inf
        aces = oiio.TypeDesc("float[8]")
        spec = oiio.ImageSpec(256, 128, 3, "half")
        values = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
        spec.attribute("chromaticities", aces, values)
        with_spec(tmp_path / "aces.exr", spec, light)
        environment = read_environment(tmp_path / "aces.exr")
        assert environment.radiance[40, 60].min() >= 65504.0
        assert environment.repairs.nan == 0

    def test_a_sun_of_half_floats_gives_the_turns_of_floats(self) -> None:
        """A sun of 3e5 over an ordinary sky, as files state it who keep floats."""
        pack = load_named_pack("generic")
        light = small("courtyard")
        light *= np.float32(0.3 / np.median(light))
        whole, lost = light.copy(), light.copy()
        whole[40, 60], lost[40, 60] = 3e5, np.inf
        truth, answer = (
            solve_all(pack, reduce(from_radiance(each, "sun"))) for each in (whole, lost)
        )
        away = [
            abs(difference(a.turn_refined_deg, b.turn_refined_deg))
            for a, b in zip(truth, answer, strict=True)
        ]
        assert np.median(away) < 1.0
        assert sum(each > 2.0 for each in away) <= 2


class TestGaps:
    @pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
    def test_alpha_of_zero_is_not_seen_in_a_file_of_floats(
        self, tmp_path: Path, share: float
    ) -> None:
        light, gap = small("courtyard"), nadir(share)
        alpha = np.where(gap, 0.0, 1.0)[..., None].astype(np.float32)
        file = write(tmp_path / "gap.exr", np.dstack([light * alpha, alpha]), ("R", "G", "B", "A"))
        environment = read_environment(file)
        assert environment.unseen is not None
        assert np.array_equal(environment.unseen, gap)
        assert environment.blind == pytest.approx(share_of(gap), abs=1e-6)
        assert environment.radiance[gap].min() > 0.0
        assert np.array_equal(environment.radiance[~gap][:100], light[~gap][:100])
        assert any(isinstance(remark, PartUnseen) for remark in environment.warnings)

    def test_alpha_that_nobody_filled_is_no_gap(self, tmp_path: Path) -> None:
        light = small("courtyard")
        empty = np.dstack([light, np.zeros(SHAPE, np.float32)])
        environment = read_environment(write(tmp_path / "a.exr", empty, ("R", "G", "B", "A")))
        assert environment.unseen is None
        assert np.array_equal(environment.radiance, light)

    def test_partial_alpha_dims_premultiplied_colours_only(self, tmp_path: Path) -> None:
        light = small("courtyard")
        alpha = np.ones((*SHAPE, 1), np.float32)
        alpha[50:60] = 0.6
        premultiplied = np.dstack([light * alpha, alpha])
        file = write(tmp_path / "dim.exr", premultiplied, ("R", "G", "B", "A"))
        assert np.allclose(read_environment(file).radiance, light, rtol=1e-5)
        straight = np.dstack([light, alpha])
        file = write(tmp_path / "straight.tif", straight, oiio_UnassociatedAlpha=1)
        assert np.allclose(read_environment(file).radiance, light, rtol=1e-5)

    def test_a_data_window_leaves_a_gap(self, tmp_path: Path) -> None:
        light = small("courtyard")
        path = tmp_path / "trim.exr"
        write(path, light[8:104], x=0, y=8, full_width=256, full_height=128)
        environment = read_environment(path)
        assert environment.unseen is not None
        assert environment.unseen[:8].all()
        assert environment.unseen[104:].all()
        assert not environment.unseen[8:104].any()
        assert environment.radiance[:8].min() > 0.0

    def test_half_a_panorama_on_black_canvas_is_a_gap(self, tmp_path: Path) -> None:
        light = small("courtyard")
        light[:, 128:] = 0.0
        environment = read_environment(write(tmp_path / "half.exr", light))
        assert environment.blind == pytest.approx(0.5, abs=0.01)
        assert environment.radiance[:, 128:].max() > 0.0

    @pytest.mark.parametrize("name", SCENES)
    def test_darkness_that_was_measured_is_no_canvas(self, name: str) -> None:
        assert canvas(scene(name)) is None

    def test_lamps_in_a_void_stay_as_they_are(self) -> None:
        assert canvas(place([(30.0, 20.0, 25.0, 50.0)], (64, 128), fill=0.0)) is None

    @pytest.mark.parametrize("ending", ["png", "tif"])
    def test_a_transparent_picture_has_a_gap(self, tmp_path: Path, ending: str) -> None:
        light, gap = small("courtyard"), nadir(0.2)
        codes = np.rint(255.0 * srgb_encode(np.minimum(light / light.mean(), 1.0)))
        alpha = np.where(gap, 0, 255)
        codes[gap] = 0
        pixels = np.dstack([codes, alpha]).astype(np.uint8)
        file = write(tmp_path / f"stitched.{ending}", pixels, kind="uint8")
        check_photograph(file, gap)

    @pytest.mark.parametrize(("ending", "quality"), [("png", 0), ("jpg", 75)])
    def test_a_picture_on_black_canvas_has_a_gap(
        self, tmp_path: Path, ending: str, quality: int
    ) -> None:
        light, gap = small("courtyard"), nadir(0.2)
        codes = np.rint(255.0 * srgb_encode(np.minimum(light / light.mean(), 1.0)))
        codes[gap] = 0
        options = [cv2.IMWRITE_JPEG_QUALITY, quality] if quality else []
        file = tmp_path / f"canvas.{ending}"
        assert cv2.imwrite(str(file), codes.astype(np.uint8)[..., ::-1], options)
        check_photograph(file, gap)

    def test_a_hidden_lamp_is_a_doubt(self) -> None:
        """One lamp in front, and half of the sphere not seen."""
        light = place([(0.0, 30.0, 20.0, 40.0)], (64, 128))
        gap = np.zeros((64, 128), np.bool_)
        gap[:, 96:] = gap[:, :32] = True
        doubt = doubt_of(Environment(light, "half", unseen=gap), load_named_pack("generic"))
        assert doubt is not None
        assert len(doubt.unseen) > 10
        assert doubt.clipped == ()


def check_photograph(file: Path, gap: Pixels) -> None:
    """Expect the gap to be found, filled and told."""
    probe = measure([file], MeasureOptions(alone=True))
    assert probe.blind == pytest.approx(share_of(gap), abs=0.02)
    environment = probe.environment("photograph")
    assert environment.unseen is not None
    assert (environment.unseen ^ gap).mean() < 0.02
    assert environment.radiance[gap].min() > 0.0
    assert any(isinstance(remark, PartUnseen) for remark in probe.warnings)


class TestLayers:
    @staticmethod
    def layered(path: Path, names: Sequence[str]) -> Path:
        """Layer k has radiance k + 1."""
        planes = [np.full((*SHAPE, 3), k + 1.0, np.float32) for k, _ in enumerate(names)]
        channels = [f"{name}.{c}".lstrip(".") for name in names for c in "RGB"]
        return write(path, np.dstack(planes), channels)

    @pytest.mark.parametrize(
        ("names", "read"),
        [
            (("AO", "Combined"), "Combined"),
            (("AO", "ViewLayer.Combined", "ViewLayer.DiffCol"), "ViewLayer.Combined"),
            (("denoise", "Beauty"), "Beauty"),
            (("albedo", "RGBA"), "RGBA"),
            (("albedo", "composite"), "composite"),
            (("albedo", ""), "RGB"),
            (("beauty", "Combined"), "Combined"),
        ],
    )
    def test_the_beauty_is_read_and_named(
        self, tmp_path: Path, names: tuple[str, ...], read: str
    ) -> None:
        file = self.layered(tmp_path / "layers.exr", names)
        environment = read_environment(file)
        assert environment.layer == read
        assert set(environment.layers) == {name or "RGB" for name in names}
        assert environment.radiance.max() == names.index("" if read == "RGB" else read) + 1.0
        assert any(
            isinstance(remark, LayerChosen) and remark.layer == read
            for remark in environment.warnings
        )

    def test_without_a_beauty_the_layer_is_asked_for(self, tmp_path: Path) -> None:
        file = self.layered(tmp_path / "layers.exr", ("key", "fill", "rim"))
        with pytest.raises(LayerError, match="has several layers") as caught:
            read_environment(file)
        assert set(caught.value.layers) == {"key", "fill", "rim"}
        assert "--layer NAME" in caught.value.hint
        assert read_environment(file, "FILL").radiance.max() == 2.0
        with pytest.raises(LayerError, match="no layer 'back'"):
            read_environment(file, "back")

    def test_parts_are_layers(self, tmp_path: Path) -> None:
        path = tmp_path / "parts.exr"
        specs = []
        for name in ("AO", "rgba", "depth"):
            spec = oiio.ImageSpec(256, 128, 1 if name == "depth" else 3, "float")
            spec.attribute("oiio:subimagename", name)
            if name == "depth":
                spec.channelnames = ("Z",)
            specs.append(spec)
        output = oiio.ImageOutput.create(str(path))
        assert output is not None
        assert output.open(str(path), tuple(specs)), output.geterror()
        for k, spec in enumerate(specs):
            if k:
                assert output.open(str(path), spec, "AppendSubimage"), output.geterror()
            assert output.write_image(np.full((128, 256, spec.nchannels), k + 1.0, np.float32))
        assert output.close()
        environment = read_environment(path)
        assert (environment.layer, environment.layers) == ("rgba", ("AO", "rgba"))
        assert environment.radiance.max() == 2.0


class TestCommands:
    def test_solve_tells_layer_gap_and_doubt(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        light = np.dstack([small("courtyard"), np.where(nadir(0.3), 0.0, 1.0)]).astype(np.float32)
        pixels = np.dstack([light * light[..., 3:], light])
        names = [f"{layer}.{c}" for layer in ("key", "fill") for c in "RGBA"]
        file = write(tmp_path / "layers.exr", pixels, names)
        for command in ("solve", "render"):
            more = ["--turn", "0", "-o", str(tmp_path / "out.png")] * (command == "render")
            assert main([command, str(file), *more]) == 2
            assert "has several layers" in capsys.readouterr().err
            assert main([command, str(file), *more, "--layer", "key", "--json"]) == 0
            output = capsys.readouterr()
            values = json.loads(output.out)
            assert values["layer"] == "key"
            assert values["layers"] == ["fill", "key"]
            assert values["blind"] == pytest.approx(share_of(nadir(0.3)), abs=1e-3)
            assert "leaves 30% of the sphere empty" in output.err
            if command == "solve":
                doubtful = [one["name"] for one in values["styles"] if one["doubtful"]]
                assert doubtful
                assert all("unseen" in one["depends_on"] for one in values["styles"]
                           if one["doubtful"])  # fmt: skip

    def test_a_merge_of_one_photograph_keeps_its_doubts(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        light = small("courtyard")
        codes = np.rint(255.0 * srgb_encode(np.minimum(light / light.mean(), 1.0)))
        photograph, kept = tmp_path / "photo.png", tmp_path / "kept.exr"
        assert cv2.imwrite(str(photograph), codes.astype(np.uint8)[..., ::-1])
        assert main(["merge", str(photograph), "-o", str(kept)]) == 0
        capsys.readouterr()
        doubts = []
        for file in (photograph, kept):
            assert main(["solve", str(file), "--json"]) == 0
            values = json.loads(capsys.readouterr().out)
            assert values["rough"]
            doubts.append([one["name"] for one in values["styles"] if one["doubtful"]])
        assert doubts[0]
        assert doubts[0] == doubts[1]


@needs_shared
def test_files_of_neighbouring_tools_are_read_right() -> None:
    """The same light in other files gives the same turns; what is missing is told."""
    folder, pack = SHARED / "outside" / "solve", load_named_pack("generic")

    def turns(name: str) -> tuple[Environment, list[float]]:
        environment = read_environment(folder / name)
        return environment, [one.turn_refined_deg for one in solve_all(pack, reduce(environment))]

    base, expected = turns("base.exr")
    assert (base.clipped, base.unseen, base.layers) == (None, None, ())
    layered, found = turns("two_layers.exr")
    assert (layered.layer, set(layered.layers)) == ("beauty", {"beauty", "denoise"})
    assert found == pytest.approx(expected, abs=0.01)
    assert turns("float32.tif")[1] == pytest.approx(expected, abs=0.5)
    sun, expected = turns("sun_float.exr")
    half, found = turns("sun_half_inf.exr")
    assert sun.clipped is None
    assert half.clipped is not None
    assert max(abs(difference(a, b)) for a, b in zip(expected, found, strict=True)) < 0.5
    for name in ("nadir_hole.exr", "trimmed.exr"):
        gap, _ = turns(name)
        assert 0.09 < gap.blind < 0.11
        doubt = doubt_of(gap, pack)
        assert doubt is not None
        assert doubt.unseen
