"""``turnlight render``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from app.commands import render as command
from app.core.base import colour
from app.core.base.errors import CoreError, EnvironmentFileError, TransportError
from app.core.base.imaging.images import write_exr
from app.core.environment.environment import reduce_light
from app.core.portrait import render as head_render
from app.core.solver.transport import Transport, load_named, render, to_image
from benchmarks.truth.stock import rotate
from tests.helpers.synthetic import lambert_sphere_transport


@pytest.fixture(scope="module")
def transport() -> Transport:
    """Make a small head that needs no baking."""
    return lambert_sphere_transport(24)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Write a random panorama, 256 x 128."""
    radiance = np.exp(np.random.default_rng(2).normal(0, 2, (128, 256, 3))).astype(np.float32)
    write_exr(tmp_path / "hall.exr", radiance)
    return tmp_path / "hall.exr"


@pytest.fixture(autouse=True)
def _head(transport: Transport, monkeypatch: pytest.MonkeyPatch) -> None:
    real = load_named

    def load(name: str) -> Transport:
        return transport if name == "generic" else real(name)

    monkeypatch.setattr(head_render, "load_named", load)


def run(*words: object) -> int:
    """Run the command as the command line does."""
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    args = parser.parse_args([*map(str, words)])
    return int(args.run(args))


def pixels(path: Path) -> np.ndarray:
    """Read what a picture holds, as stored."""
    buffer = oiio.ImageBuf(str(path))
    return np.asarray(buffer.get_pixels(buffer.spec().format))


def test_exr_is_the_linear_picture_of_the_turned_environment(
    tmp_path: Path, place: Path, transport: Transport
) -> None:
    out = tmp_path / "a.exr"
    assert run(place, "--turn", "45", "-o", out) == 0
    radiance = np.asarray(oiio.ImageBuf(str(place)).get_pixels("float"))
    light = rotate(reduce_light(radiance), 8)
    expected = to_image(transport, render(transport, light))
    np.testing.assert_allclose(pixels(out), expected, rtol=1e-4, atol=1e-5)


def test_turns_between_texels_are_not_rounded(tmp_path: Path, place: Path) -> None:
    pictures = []
    for turn in ("0", "1", "5.625", "361"):
        assert run(place, "--turn", turn, "-o", tmp_path / "a.exr") == 0
        pictures.append(pixels(tmp_path / "a.exr"))
    scale = pictures[0].max()
    assert np.abs(pictures[0] - pictures[1]).max() > 1e-3 * scale
    assert np.abs(pictures[2] - pictures[1]).max() > 1e-3 * scale
    np.testing.assert_allclose(pictures[3], pictures[1], atol=1e-6 * scale)


def test_png_is_exposed_for_the_face(tmp_path: Path, place: Path, transport: Transport) -> None:
    assert run(place, "--turn", "-30", "-o", tmp_path / "a.PNG") == 0
    shown = pixels(tmp_path / "a.PNG")
    assert shown.dtype == np.uint8
    face = shown.reshape(-1, 3)[transport.pixels[transport.face]]
    assert 0.45 < colour.luminance(face / 255.0).mean() < 0.75
    assert (shown[0, 0] == 0).all()


def test_json_and_words(tmp_path: Path, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(place, "--turn", "10", "-o", tmp_path / "a.png", "--json")
    facts = json.loads(capsys.readouterr().out)
    assert facts["turn_deg"] == 10.0
    assert facts["file"].endswith("a.png")
    run(place, "--turn", "10", "-o", tmp_path / "a.png")
    assert "turn 10°" in capsys.readouterr().out


@pytest.mark.parametrize("plain", [False, True])
def test_a_portrait_has_the_size_asked_for_and_says_what_eyes_mirror(
    tmp_path: Path, place: Path, capsys: pytest.CaptureFixture[str], plain: bool
) -> None:
    more = ("--head", "male", *(("--plain",) if plain else ()))
    run(place, "--turn", "10", "--size", "320", "-o", tmp_path / "a.png", "--json", *more)
    facts = json.loads(capsys.readouterr().out)
    assert (facts["height"], facts["width"]) == (320, 256)
    assert pixels(tmp_path / "a.png").shape == (320, 256, 3)
    for one in facts["catchlights"]:
        assert set(one) == {"eye", "clock", "share", "what"}
    run(place, "--turn", "10", "--size", "320", "-o", tmp_path / "b.png", *more)
    assert "atchlight" in capsys.readouterr().out


def test_repairs_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    radiance = np.ones((16, 32, 3), np.float32)
    radiance[3, 3] = np.nan
    write_exr(tmp_path / "odd.exr", radiance)
    run(tmp_path / "odd.exr", "--turn", "0", "-o", tmp_path / "a.png")
    assert "repaired 1 NaN texel" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "error", "match"),
    [
        (("hall.exr", "--turn", "0", "-o", "a.jpg"), CoreError, "pictures are .png or .exr"),
        (("hall.exr", "--turn", "0", "-o", "none/a.png"), CoreError, "does not exist"),
        (("hall.exr", "--turn", "nan", "-o", "a.png"), CoreError, "number of degrees"),
        (("hall.exr", "--turn", "inf", "-o", "a.png"), CoreError, "number of degrees"),
        (("hall.exr", "--turn", "1e300", "-o", "a.png"), CoreError, "number of degrees"),
        (("hall.exr", "--turn", "0", "--size", "8", "-o", "a.png"), CoreError, "64 to 2048"),
        (("none.exr", "--turn", "0", "-o", "a.png"), EnvironmentFileError, "no file"),
        (("hall.exr", "--turn", "0", "-o", "a.png", "--head", "x"), TransportError, "no head"),
    ],
)
def test_bad_words_are_refused_and_nothing_is_written(
    tmp_path: Path,
    place: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    error: type[CoreError],
    match: str,
) -> None:
    monkeypatch.chdir(place.parent)
    with pytest.raises(error, match=match):
        run(*words)
    assert [path.name for path in tmp_path.iterdir()] == ["hall.exr"]


def test_turn_and_output_are_required(place: Path) -> None:
    with pytest.raises(SystemExit) as caught:
        run(place, "-o", "a.png")
    assert caught.value.code == 2
