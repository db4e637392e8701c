"""Pictures from files, upright, all of their pixels: for laying one on another.

Files come from anywhere: how large a picture is, is judged before any of it is decoded, nothing but
an ordinary file is opened, and a file that ends too early is said to.
"""

from __future__ import annotations

import contextlib
import math
import stat
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.errors import CoreError

if TYPE_CHECKING:
    from OpenImageIO import ImageInput

__all__ = ["PictureFile", "read_picture", "upright"]

Bytes: TypeAlias = NDArray[np.uint8]

_MOST_BYTES: Final = 256 << 20
_MOST_PIXELS: Final = 120_000_000
_LEAST_SIDE: Final = 32
_KINDS: Final = ("jpeg", "png", "tiff", "webp", "bmp", "heif")
_TYPES: Final = ("uint8", "uint16")
_FRAME_DIAGONAL_MM: Final = math.hypot(36.0, 24.0)
_FOCAL_MM: Final = (6.0, 2000.0)
_COPY_AGAIN: Final = "Copy or export it again."
_EXPORT: Final = "Export it as a JPEG or PNG."


@dataclass(frozen=True, slots=True, eq=False)
class PictureFile:
    """A picture as it is to be looked at.

    Attributes
    ----------
    picture : (H, W, 3) uint8
        sRGB, turned upright as its EXIF orientation says.
    fov_deg : float or None
        Horizontal field of view by the focal length for 35 mm that the file states, deg; None
        where it states none. Wrong where a picture was cropped.
    """

    picture: Bytes = field(repr=False)
    fov_deg: float | None = None


def read_picture(path: Path | str) -> PictureFile:
    """Read a picture.

    Parameters
    ----------
    path : Path or str
        JPEG, PNG, TIFF, WebP, BMP, or HEIF where the library reads it; 8 or 16 bits.

    Returns
    -------
    PictureFile

    Raises
    ------
    CoreError
        When it is missing, no ordinary file, no picture of these kinds, damaged, too small or too
        large.
    """
    import OpenImageIO as oiio

    path = Path(path)
    _check_file(path)
    # A text that is not UTF-8 in a damaged header must not get further than this.
    try:
        source = oiio.ImageInput.open(str(path))
    except UnicodeError:
        source = None
    if source is None:
        oiio.geterror()
        raise CoreError(f"{path.name} is not a picture that can be read.", _EXPORT)
    try:
        return _read(source, path.name)
    finally:
        source.close()


def upright(picture: Bytes, orientation: int) -> Bytes:
    """Turn a picture as EXIF 2.32 says (tag 0x0112): what its first row and column are.

    Parameters
    ----------
    picture : (H, W, C) uint8
        As stored.
    orientation : int
        1 to 8; anything else leaves it.

    Returns
    -------
    (H, W, C) or (W, H, C) uint8
    """
    if orientation in (5, 6, 7, 8):
        picture = picture.transpose(1, 0, 2)
    if orientation in (2, 3, 6, 7):
        picture = picture[:, ::-1]
    if orientation in (3, 4, 7, 8):
        picture = picture[::-1]
    return np.ascontiguousarray(picture)


def _check_file(path: Path) -> None:
    try:
        about = path.stat()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise CoreError(f"There is no file {path}.", "Check the name.") from error
    except OSError as error:
        raise CoreError(f"{path} cannot be read: {error.strerror or error}.") from error
    # A pipe would be waited for, and a device has no end.
    if not stat.S_ISREG(about.st_mode):
        raise CoreError(f"{path.name} is not a picture file.", "Give the name of a picture.")
    if about.st_size == 0:
        raise CoreError(f"{path.name} is empty.", _COPY_AGAIN)
    if about.st_size > _MOST_BYTES:
        raise CoreError(f"{path.name} is too large to be a photograph.", _EXPORT)


def _read(source: ImageInput, name: str) -> PictureFile:
    spec = source.spec()
    kind, rows, columns = source.format_name(), spec.height, spec.width
    if kind not in _KINDS or str(spec.format) not in _TYPES or spec.depth > 1:
        raise CoreError(f"{name} is not a picture as cameras and screens make them.", _EXPORT)
    if rows * columns > _MOST_PIXELS:
        raise CoreError(f"{name} has too many pixels to be looked at.", "Export it smaller.")
    if min(rows, columns) < _LEAST_SIDE:
        raise CoreError(f"{name} is only {columns} x {rows} pixels.", "Give a larger picture.")
    orientation, focal = _said(spec)
    channels = spec.nchannels
    pixels = source.read_image("uint8")
    if source.has_error or pixels is None or not isinstance(pixels, np.ndarray):
        source.geterror()
        raise CoreError(f"{name} is damaged or ends too early.", _COPY_AGAIN)
    grid = np.asarray(pixels, np.uint8).reshape(rows, columns, channels)
    if channels in (1, 2):
        grid = np.repeat(grid[..., :1], 3, axis=2)
    picture = upright(grid[..., :3], orientation)
    fov = None
    if focal is not None:
        # It is meant for the diagonal of a frame of 36 x 24 mm.
        half = _FRAME_DIAGONAL_MM / 2.0 / focal * picture.shape[1] / math.hypot(rows, columns)
        fov = 2.0 * math.degrees(math.atan(half))
    return PictureFile(picture, fov)


def _said(spec: Any) -> tuple[int, float | None]:
    """Orientation, and focal length for 35 mm where it is stated."""
    said: list[Any] = []
    for tag in ("Orientation", "Exif:FocalLengthIn35mmFilm"):
        value = None
        with contextlib.suppress(UnicodeError):
            value = spec.getattribute(tag)
        said.append(value)
    orientation = said[0] if isinstance(said[0], int) and 1 <= said[0] <= 8 else 1
    focal = said[1]
    if not isinstance(focal, (int, float)) or not _FOCAL_MM[0] <= focal <= _FOCAL_MM[1]:
        return orientation, None
    return orientation, float(focal)
