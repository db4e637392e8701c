"""Open picture files with OpenImageIO, checking the header of an untrusted file first."""

from __future__ import annotations

import contextlib
import math
import os
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bytes
from app.core.base.atomic_files import open_file, os_errors_as
from app.core.base.colour import rec709_from
from app.core.base.errors import CoreError
from app.core.base.memory import says_memory_short
from app.core.base.native import native_path
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

_MOST_BLOCK: Final = 1 << 27  # bytes: 512 rows of RGBA at the largest width
_MOST_UNPACKED: Final = 1 << 32
_MOST_HEADER: Final = 1 << 24  # bytes; a header may contain a preview picture
_MOST_ATTRIBUTES: Final = 4096
_EXR: Final = b"\x76\x2f\x31\x01"
_TIFF: Final = (".tif", ".tiff", ".tx", ".env", ".sm", ".vsm")
_KINDS: Final = {
    _EXR: (".exr", ".sxr", ".mxr"),
    b"\xff\xd8\xff": (".jpg", ".jpeg", ".jpe", ".jif", ".jfif", ".jfi"),
    b"\x89PNG": (".png",),
    b"#?": (".hdr", ".rgbe"),
    **dict.fromkeys((b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"), _TIFF),
    b"BM": (".bmp", ".dib"),
}
"""Suffixes from which OpenImageIO chooses a decoder, keyed by the first bytes of the file."""
_PICTURES: Final = ("jpeg", "png", "tiff", "webp", "bmp")
ROUGH: Final = "turnlight:rough"
"""Attribute that marks light as mostly estimated, such as light from a single photo."""
SCALE: Final = "turnlight:scale"
"""Attribute in half-float files. Its value is the factor that restores the measured values."""
CLIPPED: Final = "turnlight.clipped"
"""Channel in an environment that contains the fraction of each texel that was clipped."""
UNSEEN: Final = "turnlight.unseen"
"""Channel in an environment that contains the fraction of each texel that no picture shows."""

COPY_AGAIN: Final = tr("Copy or export it again.")
"""Hint to the user about a damaged picture."""
_misnamed = threading.Lock()
# Number of rows that are compressed together, from OpenEXR's ImfCompression.h.
_PACKED_ROWS: Final = {"zip": 16, "piz": 32, "pxr24": 16, "b44": 32, "b44a": 32, "dwaa": 32}
_MOST_PACKED_ROWS: Final = 256
_SAME_PRIMARIES: Final = 2e-3  # tolerance of chromaticities, which headers round


def read_start(path: Path, count: int) -> bytes:
    """Read the first bytes of a picture file before the file reaches a decoder.

    Raises:
        OSError: If the file cannot be opened, is not a regular file, or has a name that decoders
            reject.
    """
    with open_file(path) as stream:
        start = stream.read(count)
    native_path(path)
    return start


def first_bytes(path: Path, error: type[CoreError], a_folder: str, name_files: str) -> bytes:
    """Read the first 16 bytes of a picture, or raise `error` if they cannot be read.

    Args:
        error: Class of the error to raise.
        a_folder, name_files: Sentence and hint for the error if the path is a folder.
    """
    with os_errors_as(error, tr("{file} cannot be read: {reason}."), file=path):
        try:
            if path.is_dir():
                raise error(a_folder, name_files)
            start = read_start(path, 16)
        except FileNotFoundError:
            raise error(tr("There is no file {file}.", file=path), tr("Check the name.")) from None
    if not start:
        raise error(tr("{name} is empty.", name=path.name), COPY_AGAIN)
    return start


def open_image(path: Path, config: ImageSpec | None = None) -> ImageInput | None:
    """Open a picture, or return None if it is not a regular file of a supported format.

    The decoder is chosen from the file's first bytes. OpenImageIO itself would try each of its
    forty decoders, some of which read the whole file first.
    """
    import OpenImageIO as oiio

    try:
        endings = _endings(path)
    except (OSError, ValueError):
        return None
    if not endings:
        return None
    misnamed = path.suffix.lower() not in endings
    with _misnamed if misnamed else contextlib.nullcontext():
        oiio.attribute("try_all_readers", int(misnamed))
        source = None
        with contextlib.suppress(UnicodeError):  # damaged headers contain invalid text
            source = oiio.ImageInput.open(native_path(path), config or oiio.ImageSpec())
        oiio.attribute("try_all_readers", 0)
    if source is None and says_memory_short(clear_error()):
        raise MemoryError
    return source


def picture_bytes(path: Path, most_bytes: int, most_pixels: int) -> Bytes | None:
    """Read a whole picture file for another decoder, after checking its header.

    Returns:
        (n,) uint8. The bytes of the file, or None if it is not a regular file, is too large or is
        not in a camera or screen format.
    """
    source = open_image(path)
    if source is None:
        return None
    spec, kind = source.spec(), source.format_name()
    source.close()
    pixels = int(spec.width) * int(spec.height) * int(spec.depth)
    if kind not in _PICTURES or not 0 < pixels <= most_pixels:
        return None
    try:
        with open_file(path) as stream:
            data = stream.read(min(os.fstat(stream.fileno()).st_size, most_bytes) + 1)
    except OSError:
        return None
    return None if len(data) > most_bytes else np.frombuffer(data, np.uint8)


def read_picture(path: Path, most_bytes: int, most_pixels: int) -> Bytes | None:
    """Decode a picture for display and turn it upright.

    Returns:
        (H, W, 3) uint8 sRGB, or None if the file is damaged or `picture_bytes` returns None.
    """
    data = picture_bytes(path, most_bytes, most_pixels)
    with contextlib.suppress(cv2.error):
        picture = None if data is None else cv2.imdecode(data, cv2.IMREAD_COLOR_RGB)
        return None if picture is None else np.asarray(picture, np.uint8)
    return None


def _endings(path: Path) -> tuple[str, ...]:
    """Return the suffixes of the format that a file's first bytes indicate, or an empty tuple."""
    start = read_start(path, 16)
    if start.startswith(_EXR):
        with open_file(path) as stream:
            return _KINDS[_EXR] if _is_plain(stream) else ()
    for signature, endings in _KINDS.items():
        if start.startswith(signature):
            return endings
    if start.startswith(b"RIFF") and start[8:12] == b"WEBP":
        # The WebP decoder starts by reading the whole file.
        return (".webp",) if path.stat().st_size <= _MOST_BLOCK else ()
    # A Radiance file may begin with comments, so its signature proves nothing.
    return (".hdr",) if path.suffix.lower() == ".hdr" else ()


def _is_plain(stream: BinaryIO) -> bool:
    """Return whether the headers of an OpenEXR file have only a few attributes.

    A file with very many attributes takes minutes to read. In the OpenEXR file layout, names and
    types end with 0, and a header ends with an empty name, as does the list of headers in a
    multi-part file.
    """
    head = stream.read(_MOST_HEADER)
    several = len(head) > 5 and head[5] & 0x10
    place, count, last = 8, 0, -1
    while count <= _MOST_ATTRIBUTES:
        stop = head.find(b"\0", place)
        if stop < 0:
            return False
        if stop == place:
            if not several or last == count:
                return True
            last, place = count, place + 1
            continue
        size = head.find(b"\0", stop + 1) + 1
        length = int.from_bytes(head[size : size + 4], "little", signed=True)
        if not size or length < 0:
            return False
        place, count = size + 4 + length, count + 1
    return False


def is_unwieldy(spec: ImageSpec) -> bool:
    """Return whether a decoder must unpack more than 128 MB for one row, or 4 GB in total.

    All channels count, although only the colour channels are used.
    """
    rows = int(spec.tile_height)
    if not rows:
        packing = spec.get_string_attribute("compression").partition(":")[0]
        # Applied to other formats too: a row this large is never legitimate.
        rows = _PACKED_ROWS.get(packing, _MOST_PACKED_ROWS if packing == "dwab" else 1)
    row_bytes = int(spec.width) * int(spec.pixel_bytes(native=True))
    return row_bytes * rows > _MOST_BLOCK or row_bytes * int(spec.height) > _MOST_UNPACKED


def rows_at_once(spec: ImageSpec, rows: int) -> int:
    """Return how many rows to read at a time, which is about `rows` but in whole tiles."""
    tall = int(spec.tile_height)
    return max(rows // tall, 1) * tall if tall else rows


def clear_error(source: ImageInput | None = None) -> str:
    """Return and clear the library's error message, which would otherwise be printed at exit."""
    import OpenImageIO as oiio

    with contextlib.suppress(UnicodeError):
        return str(oiio.geterror() if source is None else source.geterror())
    return ""


def read_rows(
    source: ImageInput,
    rows: tuple[int, int],
    channels: tuple[int, int],
    kind: str,
    part: int = 0,
) -> NDArray[Any] | None:
    """Read rows of a picture that is stored in rows or in tiles.

    Args:
        source: A picture with one plane (depth 1).
        rows, channels: The first index and one past the last. Rows are counted from the top of the
            stored data.
        kind: OpenImageIO's name for the value type.
        part: Index of the subimage.

    Returns:
        (rows, W, channels) array of the given type, or None if the rows cannot be read. In that
        case `clear_error` returns the reason.
    """
    spec = source.spec(part, 0)
    (start, stop), (begin, end) = rows, channels
    left, top, width = int(spec.x), int(spec.y), int(spec.width)
    first, last = start, stop
    if spec.tile_width:
        first -= first % spec.tile_height
        last = min(-(-last // spec.tile_height) * spec.tile_height, int(spec.height))
        place = (left, left + width, top + first, top + last, 0, 1)
        pixels = source.read_tiles(part, 0, *place, begin, end, kind)
    else:
        pixels = source.read_scanlines(part, 0, top + first, top + last, 0, begin, end, kind)
    if pixels is None:
        with contextlib.suppress(UnicodeError):
            if says_memory_short(source.geterror(False)):
                raise MemoryError
        return None
    whole = np.asarray(pixels).reshape(last - first, width, end - begin)
    return whole[start - first : stop - first]


def stated_value(spec: ImageSpec, name: str) -> object:
    """Return an attribute of a file, or None if the attribute is missing or cannot be decoded."""
    with contextlib.suppress(UnicodeError):
        return spec.getattribute(name)
    return None


def as_stored() -> ImageSpec:
    """Return a configuration that keeps colours as stored instead of multiplying them by alpha."""
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    return config


def stated_scale(path: Path) -> float:
    """Return the factor for the values in a file, or 1 if it has no attribute `SCALE`."""
    source = open_image(path)
    if source is None:
        return 1.0
    with contextlib.closing(source):
        scale = stated_value(source.spec(), SCALE)
    is_valid = isinstance(scale, float) and 0.0 < scale < math.inf
    return float(scale) if is_valid and isinstance(scale, float) else 1.0


def stated_orientation(source: ImageInput) -> int:
    """Return a file's EXIF orientation, 1 to 8, or its equivalent for a Radiance file."""
    orientation = int(source.spec().get_int_attribute("Orientation", 1))
    if source.format_name() == "hdr":
        # OpenImageIO 3.2 confuses "-X -Y" and "+X +Y".
        orientation = {6: 8, 8: 6}.get(orientation, orientation)
    return orientation if 1 <= orientation <= 8 else 1


def stated_primaries(spec: ImageSpec) -> tuple[float, ...]:
    """Return the x and y chromaticities that a file states for red, green, blue and white.

    Returns:
        The eight numbers, or an empty tuple if the file states none or states those of Rec. 709.

    Raises:
        ValueError: If the chromaticities are impossible.
    """
    chromaticities = spec.getattribute("chromaticities")
    if not isinstance(chromaticities, tuple):
        return ()
    off = np.abs(rec709_from(chromaticities) - np.eye(3)).max()
    return () if off < _SAME_PRIMARIES else chromaticities


def upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Turn a picture, (H, W, C), upright according to its EXIF 2.32 orientation (tag 0x0112).

    An orientation other than 1 to 8 leaves the picture unchanged.
    """
    if orientation in (5, 6, 7, 8):
        pixels = pixels.transpose(1, 0, 2)
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    return np.ascontiguousarray(pixels)
