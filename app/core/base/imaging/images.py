"""Write pictures with OpenImageIO: PNG for display, OpenEXR and Radiance for linear light.

Every picture is written atomically. OpenImageIO misses disk errors in PNG files and in the last
bytes of OpenEXR and Radiance files. A new file is therefore read back before it replaces the old
one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bytes
from app.core.base.atomic_files import atomic_write, write_trouble
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError
from app.core.base.imaging.image_input import ROUGH, SCALE, clear_error, open_image, read_rows
from app.core.base.native import native_path
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageOutput

Halves: TypeAlias = NDArray[np.float16]

_CHECKED_ROWS: Final = 16
_PNG_END: Final = b"\0\0\0\0IEND\xaeB`\x82"


def write_png(path: Path, picture: Bytes, pixels_per_inch: int = 0) -> None:
    """Write an sRGB picture as a PNG.

    Args:
        picture: (H, W, 3) uint8. Picture in sRGB.
        pixels_per_inch: Resolution to state in the file, or 0 to state none.

    Raises:
        CoreError: If the file cannot be written.
    """
    # Level 4 takes half as long as the default 6, for files that are 5% larger.
    attributes: dict[str, object] = {
        "oiio:ColorSpace": "srgb_rec709_scene",
        "png:compressionLevel": 4,
    }
    if pixels_per_inch:
        attributes |= {
            "XResolution": float(pixels_per_inch),
            "YResolution": float(pixels_per_inch),
            "ResolutionUnit": "in",
        }
    write_image(path, np.ascontiguousarray(picture, dtype=np.uint8), "uint8", attributes)


def write_exr(
    path: Path,
    picture: FloatImage,
    white_cd_m2: float | None = None,
    check: Callable[[Path], None] | None = None,
    rough: bool = False,
    shares: Mapping[str, FloatImage] | None = None,
) -> None:
    """Write linear light as a 32-bit OpenEXR file.

    Args:
        picture: (H, W, 3) float32. Linear Rec. 709 light.
        white_cd_m2: Luminance of the value 1, in cd/m2, for OpenEXR's attribute ``whiteLuminance``.
        check: Function called with the temporary file before it replaces the old one. The function
            may raise an exception to keep the old file.
        rough: Whether much of the light is estimated. This is saved as the attribute `ROUGH`.
        shares: Extra channels to save, by name, each (H, W) float32.

    Raises:
        CoreError: If the file cannot be written.
    """
    attributes: dict[str, object] = {
        # Measured light has noise in its lowest bits, so packing saves only 8% and takes 0.25 s.
        "compression": "none",
        "oiio:ColorSpace": "lin_rec709_scene",
    }
    if white_cd_m2 is not None:
        attributes["whiteLuminance"] = float(white_cd_m2)
    if rough:
        attributes[ROUGH] = 1
    channels: tuple[str, ...] = ()
    if shares:
        picture = np.dstack([picture, *shares.values()])
        channels = ("R", "G", "B", *shares)
    pixels = np.ascontiguousarray(picture, dtype=np.float32)
    write_image(path, pixels, "float", attributes, channels, check=check)


def write_half_exr(
    path: Path,
    picture: FloatImage,
    scale: float,
    white_cd_m2: float | None = None,
    check: Callable[[Path], None] | None = None,
    rough: bool = False,
) -> None:
    """Write linear light as a half-float OpenEXR file, which PIZ compresses to a third of its size.

    Args:
        picture: (H, W, 3) float32. Linear Rec. 709 light.
        scale: Power of two by which to divide the picture, saved as the attribute `SCALE`.
        white_cd_m2: Luminance of the stored value 1, in cd/m2.
        check, rough: As in `write_exr`.

    Raises:
        CoreError: If the file cannot be written.
    """
    attributes: dict[str, object] = {
        "compression": "piz",
        "oiio:ColorSpace": "lin_rec709_scene",
        SCALE: float(scale),
    }
    if white_cd_m2 is not None:
        attributes["whiteLuminance"] = float(white_cd_m2) * scale
    if rough:
        attributes[ROUGH] = 1
    halves = np.ascontiguousarray(picture / np.float32(scale), np.float16)
    write_image(path, halves, "half", attributes, check=check)


def write_hdr(path: Path, picture: FloatImage) -> None:
    """Write linear light as a Radiance RGBE file, with 8 bits per channel and a common exponent.

    Args:
        picture: (H, W, 3) float32. Linear Rec. 709 light.

    Raises:
        CoreError: If the file cannot be written.
    """
    pixels = np.ascontiguousarray(picture, dtype=np.float32)
    write_image(path, pixels, "float", {"oiio:ColorSpace": "lin_rec709_scene"})


def write_image(
    path: Path,
    pixels: Bytes | FloatImage | Halves,
    kind: str,
    attributes: Mapping[str, object],
    channels: Sequence[str] = (),
    check: Callable[[Path], None] | None = None,
) -> None:
    """Write a picture in the format that the path's suffix indicates.

    Args:
        pixels: (H, W, C) uint8, float16 or float32, C-contiguous.
        kind: OpenImageIO's name for the value type.

    Raises:
        CoreError: If the file cannot be written.
    """
    import OpenImageIO as oiio

    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, kind)
    if channels:
        spec.channelnames = tuple(channels)
    for name, value in attributes.items():
        spec.attribute(name, value)

    def write(temporary: Path) -> None:
        output = _output(temporary, path)
        # If opening fails, nothing is written, but the file is always closed.
        ok = output.open(native_path(temporary), spec) and output.write_image(pixels)
        closed = output.close()
        output.geterror()  # Clear the message, which names library internals.
        if not (ok and closed and _reads_back(temporary, pixels, kind, channels)):
            error = CoreError(
                tr("Cannot write {path}.", path=path), tr("Check that the disk is not full.")
            )
            raise error from write_trouble(temporary, pixels.nbytes)
        if check is not None:
            check(temporary)

    atomic_write(path, write)


def _output(temporary: Path, path: Path) -> ImageOutput:
    import OpenImageIO as oiio

    output = oiio.ImageOutput.create(native_path(temporary))
    if output is None:
        clear_error()
        raise CoreError(
            tr("Cannot write {path}: unknown picture format.", path=path),
            tr("Change the file extension."),
        )
    return output


def _reads_back(
    path: Path, pixels: Bytes | FloatImage | Halves, kind: str, channels: Sequence[str]
) -> bool:
    """Compare the last rows, which a truncated file lacks since files are written from the top."""
    if path.suffix.lower() == ".png" and not path.read_bytes().endswith(_PNG_END):
        return False
    source = open_image(path)
    if source is None:
        return False
    height = len(pixels)
    first = max(height - _CHECKED_ROWS, 0)
    try:
        names = [str(name) for name in source.spec().channelnames]
        rows = read_rows(source, (first, height), (0, len(names)), kind)
        failed = source.has_error
        clear_error(source)
    finally:
        source.close()
    if rows is None or failed:
        return False
    # OpenEXR sorts its channels by name.
    stored = rows[..., [names.index(name) for name in channels]] if channels else rows
    expected = pixels[first:]
    if path.suffix.lower() != ".hdr":
        return np.array_equal(stored, expected, equal_nan=True)
    # Radiance keeps 8 bits of the brightest channel.
    rough = expected.max(axis=-1, keepdims=True) / 64 + np.float32(1e-30)
    return bool((np.abs(stored - expected) <= rough).all())
