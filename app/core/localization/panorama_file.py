"""A panorama to compare pictures with, from any file that holds one.

Environments are shown as everywhere in the program; an ordinary picture of the right shape, such as
a 360 camera's own JPEG, will do as well, since only its points are compared.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.errors import CoreError, EnvironmentFileError
from app.core.base.files import open_file
from app.core.base.progress import Token
from app.core.hdr.decoding import decode
from app.core.hdr.display import WIDTH, display_panorama
from app.core.hdr.dual_fisheye import find_circles
from app.core.hdr.frame import Bracket
from app.core.hdr.frame_preprocessing import proxy_shape, shrunk
from app.core.hdr.level import levelling
from app.core.hdr.metadata import read_header
from app.core.solver.environment import read_environment

if TYPE_CHECKING:
    from app.core.hdr.frame import Frame

Bytes: TypeAlias = NDArray[np.uint8]

_WIDEST: Final = 4096  # finer detail than a camera shows behind a sitter
_NARROWEST: Final = 512
_PICTURES: Final = (b"\xff\xd8", b"\x89PNG", b"II*\0", b"MM\0*")


def read_shown_panorama(path: Path | str, token: Token | None = None) -> Bytes:
    """Read a panorama as a picture.

    Parameters
    ----------
    path : Path or str
        OpenEXR or Radiance environment, or a JPEG, PNG or TIFF picture that is a whole
        equirectangular panorama; it is levelled where it says how it was tilted.

    Returns
    -------
    (H, 2 H, 3) uint8
        sRGB, 512 to 4,096 columns.

    Raises
    ------
    CoreError
        When it is missing, damaged, too large, too small, or no whole panorama.
    Cancelled
    """
    file = Path(path)
    if not _is_picture(file):
        radiance = read_environment(file).radiance
        return display_panorama(radiance, width=min(max(radiance.shape[1], WIDTH), _WIDEST))
    frame = read_header(file).frame
    _check(frame)
    pixels = decode(frame, token or Token())
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    picture = np.asarray(pixels, np.uint8)
    if frame.fisheye or find_circles(shrunk(picture, proxy_shape(frame.shape))) is not None:
        raise EnvironmentFileError(
            f"{file.name} is two fisheye circles, not a stitched panorama.",
            "Merge its bracket with Turnlight, or stitch it with the camera maker's program.",
        )
    if frame.shape[1] > _WIDEST:
        small = cv2.resize(picture, (_WIDEST, _WIDEST // 2), interpolation=cv2.INTER_AREA)
        picture = np.asarray(small, np.uint8)
    rotation = levelling(Bracket((frame,), (0.0,))).rotation
    return picture if rotation is None else np.asarray(sphere.remap_frame(picture, rotation))


def _is_picture(file: Path) -> bool:
    """Whether it starts as an ordinary picture does; what cannot be read is the reader's to say."""
    try:
        with open_file(file) as stream:
            return stream.read(8).startswith(_PICTURES)
    except (OSError, ValueError):
        return False


def _check(frame: Frame) -> None:
    rows, columns = frame.shape
    name, size = frame.path.name, f"{columns} x {rows}"
    if columns != 2 * rows:
        raise EnvironmentFileError(
            f"{name} is {size}, but a full panorama is twice as wide as high.",
            "Name the panorama first and the photograph second.",
        )
    if columns < _NARROWEST:
        raise EnvironmentFileError(
            f"{name} is only {size}: too few pixels to find a camera by.",
            "Use the panorama itself, not its thumbnail.",
        )
    if frame.kind not in ("uint8", "uint16"):
        raise CoreError(f"{name} is not a picture as cameras make them.", "Export it as a JPEG.")
