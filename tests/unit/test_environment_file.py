"""Panorama files: channel orders, odd headers, and every way in which a file can be bad."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from app.core.base.errors import EnvironmentFileError
from app.core.base.progress import Token
from app.core.environment.environment import read_environment
from app.core.environment.environment_file import MAX_WIDTH, read_panorama
from app.core.measure.read.decoding import decode
from app.core.measure.read.metadata import read_header
from app.words.remarks import sentences


def write(
    path: Path, pixels: np.ndarray, names: Sequence[str] = (), kind: str = "float", **more: object
) -> Path:
    """Write an image with OpenImageIO; `more` sets fields of the ImageSpec."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if names:
        spec.channelnames = tuple(names)
    for key, value in more.items():
        setattr(spec, key, value)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels)), output.geterror()
    assert output.close()
    return path


@pytest.fixture
def pixels() -> np.ndarray:
    """Random (32, 64, 4) float32, no two channels alike."""
    return np.random.default_rng(1).random((32, 64, 4)).astype(np.float32) + 0.1


def opaque(pixels: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """As many channels as there are names; alpha is 1."""
    taken = pixels[..., : len(names)].copy()
    for k, name in enumerate(names):
        if name.lower().rpartition(".")[2] in ("a", "alpha"):
            taken[..., k] = 1.0
    return taken


@pytest.mark.parametrize(
    ("names", "order"),
    [
        (("R", "G", "B"), (0, 1, 2)),
        (("B", "G", "R"), (2, 1, 0)),
        (("G", "B", "R"), (2, 0, 1)),
        (("A", "B", "G", "R"), (3, 2, 1)),
        (("R", "G", "B", "A"), (0, 1, 2)),
        (("Z", "R", "G", "B"), (1, 2, 3)),
        (("sun.R", "sun.G", "sun.B", "sun.A"), (0, 1, 2)),
        (("a.b.G", "a.b.R", "a.b.B", "mist"), (1, 0, 2)),
        (("B", "R", "M", "G"), (1, 3, 0)),
        (("red", "green", "blue", "alpha"), (0, 1, 2)),
    ],
)
def test_exr_channels_are_taken_by_name(
    tmp_path: Path, pixels: np.ndarray, names: tuple[str, ...], order: tuple[int, ...]
) -> None:
    path = write(tmp_path / "place.exr", opaque(pixels, names), names)
    np.testing.assert_array_equal(read_environment(path).radiance, pixels[..., list(order)])


@pytest.mark.parametrize("names", [("Y",), ("Y", "A"), ("L", "A"), ("density",)])
def test_grey_is_spread_over_three_channels(
    tmp_path: Path, pixels: np.ndarray, names: tuple[str, ...]
) -> None:
    path = write(tmp_path / "grey.exr", opaque(pixels, names), names)
    radiance = read_environment(path).radiance
    for channel in range(3):
        np.testing.assert_array_equal(radiance[..., channel], pixels[..., 0])


@pytest.mark.parametrize("names", [("U", "V"), ("Y", "RY", "BY"), ("R", "G")])
def test_channels_without_colours_are_refused(
    tmp_path: Path, pixels: np.ndarray, names: tuple[str, ...]
) -> None:
    path = write(tmp_path / "odd.exr", pixels[..., : len(names)], names)
    with pytest.raises(EnvironmentFileError, match="no red, green and blue"):
        read_environment(path)


def test_half_and_tiles_and_name(tmp_path: Path, pixels: np.ndarray) -> None:
    path = write(
        tmp_path / "arch walkway.exr",
        pixels[..., :3],
        kind="half",
        tile_width=16,
        tile_height=16,
    )
    place = read_environment(str(path))
    np.testing.assert_array_equal(place.radiance, pixels[..., :3].astype(np.float16))
    assert place.name == "arch walkway"


def test_radiance_hdr(tmp_path: Path, pixels: np.ndarray) -> None:
    path = write(tmp_path / "place.hdr", pixels[..., :3])
    np.testing.assert_allclose(read_environment(path).radiance, pixels[..., :3], atol=0.009)


def test_a_wrong_ending_does_not_matter(tmp_path: Path, pixels: np.ndarray) -> None:
    write(tmp_path / "place.exr", pixels[..., :3]).rename(tmp_path / "place.hdr")
    np.testing.assert_array_equal(
        read_environment(tmp_path / "place.hdr").radiance, pixels[..., :3]
    )


def test_a_mirrored_radiance_header_is_undone(tmp_path: Path, pixels: np.ndarray) -> None:
    path = write(tmp_path / "place.hdr", pixels[..., :3])
    upright = read_environment(path).radiance
    data = path.read_bytes()
    assert b"-Y 32 +X 64" in data
    path.write_bytes(data.replace(b"-Y 32 +X 64", b"+Y 32 +X 64"))
    np.testing.assert_array_equal(read_environment(path).radiance, upright[::-1])
    path.write_bytes(data.replace(b"-Y 32 +X 64", b"-Y 32 -X 64"))
    np.testing.assert_array_equal(read_environment(path).radiance, upright[:, ::-1])


@pytest.mark.parametrize(
    ("size", "stored"),
    [
        ("+X 64 -Y 32", lambda texels: texels),
        ("-X 64 -Y 32", lambda texels: texels[:, ::-1]),
        ("+X 64 +Y 32", lambda texels: texels[::-1]),
        ("-X 64 +Y 32", lambda texels: texels[::-1, ::-1]),
    ],
)
def test_a_radiance_picture_by_columns_is_laid_down(
    size: str, stored: Callable[[np.ndarray], np.ndarray], tmp_path: Path
) -> None:
    """The size names the outer axis first and how each runs: X to the right, Y upward."""
    texels = np.random.default_rng(3).integers(128, 250, (32, 64, 4), np.uint8)
    texels[..., 3] = 128
    head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
    usual, other = tmp_path / "usual.hdr", tmp_path / "other.hdr"
    usual.write_bytes(f"{head}-Y 32 +X 64\n".encode() + texels.tobytes())
    columns = np.ascontiguousarray(stored(texels).transpose(1, 0, 2))
    other.write_bytes(f"{head}{size}\n".encode() + columns.tobytes())
    wanted = read_environment(usual).radiance
    np.testing.assert_array_equal(read_environment(other).radiance, wanted)
    first, second = (decode(read_header(path).frame, Token()) for path in (usual, other))
    np.testing.assert_array_equal(first, second)
    other.write_bytes(other.read_bytes().replace(b"X 64", b"X 32").replace(b"Y 32", b"Y 64"))
    with pytest.raises(EnvironmentFileError, match="is 32 x 64"):
        read_environment(other)


def test_a_cropped_exr_is_placed_on_its_panorama(tmp_path: Path, pixels: np.ndarray) -> None:
    path = write(tmp_path / "crop.exr", pixels[:20, :, :3], x=0, y=4, full_width=64, full_height=32)
    panorama = read_panorama(path)
    np.testing.assert_array_equal(panorama.radiance[4:24], pixels[:20, :, :3])
    assert panorama.unseen is not None
    assert np.flatnonzero(panorama.unseen.all(axis=1)).tolist() == [*range(4), *range(24, 32)]


def test_repairs_of_a_file_are_counted(tmp_path: Path, pixels: np.ndarray) -> None:
    damaged = pixels[..., :3].copy()
    damaged[0, 0, 0] = np.nan
    damaged[1, 1] = np.inf
    damaged[2, 2:5, 1] = -1.0
    place = read_environment(write(tmp_path / "odd.exr", damaged))
    assert (place.repairs.nan, place.repairs.infinite, place.repairs.negative) == (1, 1, 3)
    assert place.radiance[1, 1].min() >= 65504.0
    assert place.clipped is not None
    assert place.clipped[1, 1] == 1.0
    assert "1 NaN texel " in sentences(place.warnings)[0]


def check_refused(path: Path, words: str) -> None:
    """Expect a refusal in one sentence that names the file, and a next step."""
    with pytest.raises(EnvironmentFileError, match=words) as caught:
        read_environment(path)
    assert caught.value.message.endswith(".")
    assert "\n" not in str(caught.value)
    assert path.stem in caught.value.message
    assert caught.value.__cause__ is None


def test_missing_folder_and_empty(tmp_path: Path) -> None:
    check_refused(tmp_path / "none.exr", "There is no file")
    (tmp_path / "folder.exr").mkdir()
    check_refused(tmp_path / "folder.exr", "is a folder")
    (tmp_path / "empty.exr").touch()
    check_refused(tmp_path / "empty.exr", "is empty")


@pytest.mark.parametrize("ending", [".exr", ".hdr"])
@pytest.mark.parametrize("share", [0.0005, 0.01, 0.2, 0.5, 0.95])
def test_truncated_files_are_refused(
    tmp_path: Path, pixels: np.ndarray, ending: str, share: float
) -> None:
    path = write(tmp_path / f"cut{ending}", pixels[..., :3])
    data = path.read_bytes()
    path.write_bytes(data[: max(12, int(len(data) * share))])
    check_refused(path, "damaged or incomplete")


def test_scrambled_files_never_crash(tmp_path: Path, pixels: np.ndarray) -> None:
    rng = np.random.default_rng(3)
    messages: list[str] = []
    for ending in (".exr", ".hdr"):
        path = write(tmp_path / f"scrambled{ending}", pixels[..., :3])
        good = path.read_bytes()
        for _ in range(40):
            data = bytearray(good)
            for place in rng.integers(4, min(len(data), 600), 8):
                data[place] = rng.integers(0, 256)
            path.write_bytes(bytes(data))
            try:
                radiance = read_environment(path).radiance
            except EnvironmentFileError as error:
                messages.append(str(error))
            else:
                assert np.isfinite(radiance).all()
    assert len(messages) > 50
    assert not any("\n" in message for message in messages)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"\xff\xd8\xff\xe0 a photograph", "JPEG image.*needs an HDR panorama"),
        (b"\x89PNG\r\n\x1a\n", "PNG image.*needs an HDR panorama"),
        (b"II*\x00 a raw file", "TIFF or raw image"),
        (b"hello, this is text", "not an HDR panorama"),
        (b"\x00", "not an HDR panorama"),
        (b"#?RADIANCE\nrubbish", "damaged or incomplete"),
        (b"\x76\x2f\x31\x01rubbish", "damaged or incomplete"),
    ],
)
def test_what_is_no_environment_is_refused(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "thing.exr"
    path.write_bytes(data)
    check_refused(path, words)


@pytest.mark.parametrize("ending", [".exr", ".hdr"])
@pytest.mark.parametrize("shape", [(32, 32), (32, 63), (64, 32), (1, 100)])
def test_not_two_to_one_is_refused(tmp_path: Path, ending: str, shape: tuple[int, int]) -> None:
    path = write(tmp_path / f"shape{ending}", np.ones((*shape, 3), np.float32))
    check_refused(path, f"{shape[1]} x {shape[0]}, but a full panorama is twice as wide")


def test_one_by_two_pixels_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "tiny.exr", np.ones((1, 2, 3), np.float32))
    check_refused(path, "only 2 x 1")


def test_all_black_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "cellar.exr", np.zeros((32, 64, 3), np.float32))
    check_refused(path, "cellar is completely black")


@pytest.mark.parametrize("width", [MAX_WIDTH * 2, 100_000, 1_000_000])
def test_absurd_sizes_are_refused_from_the_header_alone(tmp_path: Path, width: int) -> None:
    path = tmp_path / "huge.hdr"
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {width // 2} +X {width}\n"
    path.write_bytes(header.encode())
    check_refused(path, f"{width} x {width // 2}; at most 16384 x 8192|damaged")


def test_unreadable_names_are_refused_in_words() -> None:
    with pytest.raises(EnvironmentFileError):
        read_environment("nul\0byte.exr")


def with_primaries(path: Path, pixels: np.ndarray, chromaticities: tuple[float, ...]) -> Path:
    """Write an OpenEXR file that states what its colours are."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "float")
    spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), chromaticities)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec)
    assert output.write_image(pixels)
    assert output.close()
    return path


def test_a_panorama_of_aces_colours_is_brought_to_rec709(tmp_path: Path) -> None:
    """By the matrix that the Academy publishes; grey stays grey."""
    aces = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
    pixels = np.tile(np.array([0.4, 0.3, 0.2], np.float32), (32, 64, 1))
    pixels[:16] = 0.5
    read = read_environment(with_primaries(tmp_path / "aces.exr", pixels, aces)).radiance
    red, green = (2.52169, -1.13413, -0.38756), (-0.27648, 1.37272, -0.09624)
    published = np.array([red, green, (-0.01538, -0.15298, 1.16835)])
    np.testing.assert_allclose(read[20, 10], published @ [0.4, 0.3, 0.2], atol=2e-3)
    np.testing.assert_allclose(read[4, 10], 0.5, atol=1e-5)


def test_primaries_that_no_light_has_are_damage(tmp_path: Path) -> None:
    path = with_primaries(tmp_path / "junk.exr", np.ones((32, 64, 3), np.float32), (0.3,) * 8)
    with pytest.raises(EnvironmentFileError, match="damaged"):
        read_environment(path)
