"""Read picture files within size limits, turn them upright, and read time and lens from EXIF.

Files are untrusted. The size is checked before anything is decoded, only regular files are opened,
and truncated files are reported.
"""

from __future__ import annotations

import contextlib
import math
import stat
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from datetime import datetime
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from app.core.base import sphere
from app.core.base.arrays import Bytes
from app.core.base.atomic_files import open_file, os_errors_as
from app.core.base.errors import CoreError, EnvironmentFileError
from app.core.base.imaging.image_input import (
    clear_error,
    is_unwieldy,
    open_image,
    read_rows,
    read_start,
    rows_at_once,
    stated_value,
    upright,
)
from app.core.base.progress import Token
from app.core.environment.environment import read_environment
from app.core.measure.bracket.alignment.levelling import levelling
from app.core.measure.finish.display import WIDTH, display_panorama
from app.core.measure.fisheye.circles import check_stitched, find_circles, unstitched
from app.core.measure.read.decoding import decode
from app.core.measure.read.frame import Bracket, Frame
from app.core.measure.read.metadata import read_header
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput


_WIDEST: Final = 4096  # finer than the detail that a camera shows behind a sitter
_NARROWEST: Final = 512
_CIRCLED: Final = 700  # pixels of the longer side when searching for circles
_PICTURES: Final = (b"\xff\xd8", b"\x89PNG", b"II*\0", b"MM\0*")


def read_shown_panorama(path: Path | str, token: Token | None = None) -> Bytes:
    """Read a panorama as a display picture.

    Args:
        path: OpenEXR or Radiance environment, or a JPEG, PNG or TIFF picture of a whole
            equirectangular panorama. The panorama is levelled if its metadata record a tilt.

    Returns:
        (H, 2 H, 3) uint8. sRGB picture, 512 to 4,096 columns wide.

    Raises:
        CoreError: If the file is missing, damaged, too large, too small, or not a whole panorama.
        Cancelled: If the token is cancelled.
    """
    file = Path(path)
    if not _is_picture(file):
        radiance = read_environment(file).radiance
        check_stitched(radiance, file.name)
        return display_panorama(radiance, width=min(max(radiance.shape[1], WIDTH), _WIDEST))
    frame = read_header(file).frame
    if frame.fisheye or shows_circles(file, token):
        raise unstitched(file.name)
    _check_shape(frame)
    pixels = decode(frame, token or Token())
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    picture = np.asarray(pixels, np.uint8)
    picture = sphere.bounded(picture, _WIDEST)
    rotation = levelling(Bracket((frame,), (0.0,))).rotation
    return picture if rotation is None else np.asarray(sphere.remap_frame(picture, rotation))


def shows_circles(file: Path, token: Token | None = None) -> bool:
    """Return whether a picture of any proportions shows two unstitched fisheye circles.

    Raises:
        CoreError, Cancelled: As in `read_picture`.
    """
    return find_circles(read_picture(file, _CIRCLED, token).picture) is not None


def _is_picture(file: Path) -> bool:
    """Return True if a file starts like an ordinary picture or if it cannot be read."""
    try:
        with open_file(file) as stream:
            return stream.read(8).startswith(_PICTURES)
    except (OSError, ValueError):
        return False


def _check_shape(frame: Frame) -> None:
    rows, columns = frame.shape
    name, size = frame.path.name, f"{columns} x {rows}"
    if columns != 2 * rows:
        raise EnvironmentFileError(
            tr(
                "{name} is {size}, but a full panorama is twice as wide as it is high.",
                name=name,
                size=size,
            ),
            tr("Name the panorama first, then the photo."),
        )
    if columns < _NARROWEST:
        raise EnvironmentFileError(
            tr("{name} is too small ({size}) to locate a camera.", name=name, size=size),
            tr("Use the original panorama, not its thumbnail."),
        )
    if frame.kind not in ("uint8", "uint16"):
        raise CoreError(
            tr("{name} is not an ordinary picture.", name=name),
            tr("Export it as a JPEG."),
        )


_MOST_BYTES: Final = 512 << 20
_MOST_PIXELS: Final = 160_000_000
_BAND_PIXELS: Final = 512
_LEAST_SIDE: Final = 32
_KINDS: Final = ("jpeg", "png", "tiff", "webp", "bmp")
_TYPES: Final = ("uint8", "uint16")
_HEAD_BYTES: Final = 32
_HEIF: Final = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"mif1", b"msf1", b"avif")
_FRAME_DIAGONAL_MM: Final = math.hypot(36.0, 24.0)
_FOCAL_MM: Final = (6.0, 2000.0)
_COPY_AGAIN: Final = tr("Copy or export it again.")
_EXPORT: Final = tr("Export it as a JPEG or PNG.")
_ORIENTATION: Final = "Orientation"
_FOCAL: Final = "Exif:FocalLengthIn35mmFilm"
RAW_ENDINGS: Final = frozenset(
    {".nef", ".nrw", ".cr2", ".cr3", ".arw", ".dng", ".orf", ".rw2", ".raf", ".pef", ".srw"}
)
"""Suffixes of raw files. Only the preview in such a file is read."""
_JPEG: Final = b"\xff\xd8\xff"
_FRAMES: Final = (0xC0, 0xC1, 0xC2)  # baseline and progressive
_LOSSLESS: Final = (0xC3, 0xC7, 0xCB, 0xCF)
_MOST_PREVIEWS: Final = 256
_MOST_PREVIEW_BYTES: Final = 1 << 26
_MOST_SEGMENTS: Final = 64
_TIMES: Final = ("Exif:DateTimeOriginal", "Exif:OffsetTimeOriginal")
_LENS: Final = "Exif:LensModel"
_FLASH: Final = "Exif:Flash"
_FIRED: Final = 1  # bit (EXIF 2.32, tag 0x9209)
_TAGS: Final = (_ORIENTATION, _FOCAL, _LENS, _FLASH, *_TIMES)
_FRONT: Final = (
    "front"  # as in "iPhone 15 front camera 2.69mm f/1.9", "Pixel 8 front camera 2.54mm"
)


@dataclass(frozen=True, slots=True, eq=False)
class PictureFile:
    """A picture prepared for viewing.

    Attributes:
        picture: (H, W, 3) uint8. sRGB, turned upright according to its EXIF orientation.
        size: Number of columns and rows of the upright picture in the file. They exceed those of
            `picture` if the picture was reduced.
        taken_at: Time recorded in EXIF, or None if there is none.
        focal_mm: Equivalent focal length on a frame of 36 x 24 mm, or None if it is not recorded.
        front_camera: Whether the file names a phone's front camera, whose pictures may be saved
            mirrored.
        flash: Whether a flash fired, or None if this is not recorded.
    """

    picture: Bytes = field(repr=False)
    size: tuple[int, int]
    taken_at: datetime | None = None
    focal_mm: float | None = None
    front_camera: bool = False
    flash: bool | None = None

    @property
    def flipped(self) -> PictureFile:
        """The mirror image of the picture."""
        return replace(self, picture=np.ascontiguousarray(self.picture[:, ::-1]))

    @property
    def fov_deg(self) -> float | None:
        """Horizontal field of view, in degrees, from the focal length. Wrong for cropped pictures.

        The focal length refers to the diagonal of the frame (CIPA DCG-001).
        """
        if self.focal_mm is None:
            return None
        half = _FRAME_DIAGONAL_MM / 2.0 / self.focal_mm * self.size[0] / math.hypot(*self.size)
        return 2.0 * math.degrees(math.atan(half))

    @property
    def focal_px(self) -> float | None:
        """The focal length, in pixels of `picture`."""
        fov = self.fov_deg
        half = None if fov is None else math.tan(math.radians(fov) / 2)
        return None if half is None else self.picture.shape[1] / 2 / half


def picture_size(path: Path | str) -> tuple[int, int]:
    """Read the size of a picture without decoding its pixels.

    Returns:
        The number of columns and rows, as stored.

    Raises:
        CoreError: As in `read_picture`.
    """
    with _open(Path(path)) as source:
        spec = source.spec()
        return int(spec.width), int(spec.height)


def read_picture(path: Path | str, longest: int = 0, token: Token | None = None) -> PictureFile:
    """Read a picture, and reduce it if fewer pixels are enough.

    Args:
        path: JPEG, PNG, TIFF, WebP or BMP file with 8 or 16 bits, in colour or greyscale, or a raw
            file with a preview.
        longest: Sufficient length of the longer side, in pixels, or 0 to keep all pixels.

    Raises:
        CoreError: If the file is missing, is not a regular file, is not a picture of these kinds,
            or is damaged, too small or too large.
        Cancelled: If the token is cancelled.
    """
    path = Path(path)
    with _open(path) as source:
        metadata = _metadata(source.spec())
        if _is_raw(path):
            metadata = {name: own or metadata[name] for name, own in _raw_said(path).items()}
        if token is not None:
            token.check()
        rows, columns = int(source.spec().height), int(source.spec().width)
        pixels = _pixels(source, path.name, longest)
    if token is not None:
        token.check()
    orientation = metadata[_ORIENTATION]
    orientation = orientation if isinstance(orientation, int) and 1 <= orientation <= 8 else 1
    focal = metadata[_FOCAL]
    if not isinstance(focal, (int, float)) or not _FOCAL_MM[0] <= focal <= _FOCAL_MM[1]:
        focal = None
    return PictureFile(
        upright(_small(pixels, longest), orientation),
        (rows, columns) if orientation >= 5 else (columns, rows),
        _time(*(metadata[name] for name in _TIMES)),
        None if focal is None else float(focal),
        _FRONT in str(metadata[_LENS] or "").lower().split(),
        bool(metadata[_FLASH] & _FIRED) if isinstance(metadata[_FLASH], int) else None,
    )


@contextlib.contextmanager
def _open(path: Path) -> Iterator[ImageInput]:
    """Open a picture after checking its size and format, without decoding any pixels."""
    _check_file(path)
    with tempfile.TemporaryDirectory() if _is_raw(path) else nullcontext("") as folder:
        picture_path = _preview(path, Path(folder)) if folder else path
        source = open_image(picture_path)
        if source is None:
            raise _unreadable(path)
        try:
            _check(source, path.name)
            yield source
        finally:
            source.close()


def _unreadable(path: Path) -> CoreError:
    words = tr("{name} is damaged or not a readable picture.", name=path.name)
    return CoreError(words, _EXPORT)


def _is_raw(path: Path) -> bool:
    return path.suffix.lower() in RAW_ENDINGS


def _preview(path: Path, folder: Path) -> Path:
    """Save the largest JPEG in a camera's raw file to a folder."""
    preview = folder / "preview.jpg"
    with os_errors_as(CoreError, tr("{path} cannot be read: {reason}."), path=path):
        preview.write_bytes(_largest_jpeg(path))
    return preview


def _largest_jpeg(path: Path) -> bytes:
    with open_file(path) as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as data:
        best, at = (0, 0), data.find(_JPEG)
        for _ in range(_MOST_PREVIEWS):
            if at < 0:
                break
            best = max(best, (_jpeg_pixels(data, at), at))
            at = data.find(_JPEG, at + 2)
        if not best[0]:
            raise _unreadable(path)
        return data[best[1] : best[1] + _MOST_PREVIEW_BYTES]


def _jpeg_pixels(data: mmap, at: int) -> int:
    """Return the pixel count of a JPEG, or 0 for a lossless one, such as the raw picture itself."""
    at += 2
    for _ in range(_MOST_SEGMENTS):
        mark, length = data[at : at + 2], int.from_bytes(data[at + 2 : at + 4])
        if len(mark) < 2 or mark[0] != 0xFF or length < 2:
            return 0
        if mark[1] in _FRAMES:
            size = data[at + 5 : at + 9]
            return int.from_bytes(size[:2]) * int.from_bytes(size[2:])
        if mark[1] in _LOSSLESS:
            return 0
        at += 2 + length
    return 0


def _check_file(path: Path) -> None:
    with os_errors_as(CoreError, tr("{path} cannot be read: {reason}."), path=path):
        try:
            about = path.stat()
        except (FileNotFoundError, NotADirectoryError) as error:
            missing = tr("There is no file {path}.", path=path)
            raise CoreError(missing, tr("Check the name.")) from error
    # A pipe would block, and a device has no end.
    if not stat.S_ISREG(about.st_mode):
        raise CoreError(
            tr("{name} is not a picture file.", name=path.name),
            tr("Enter the name of a picture file."),
        )
    if about.st_size == 0:
        raise CoreError(tr("{name} is empty.", name=path.name), _COPY_AGAIN)
    if about.st_size > _MOST_BYTES:
        raise CoreError(tr("{name} is too large to be a photo.", name=path.name), _EXPORT)
    _check_head(path)


def _check_head(path: Path) -> None:
    """Raise an error with advice if a file has a phone format that the program cannot read."""
    with os_errors_as(CoreError, tr("{path} cannot be read: {reason}."), path=path):
        head = read_start(path, _HEAD_BYTES)
    # ISO base media file: starts with a box "ftyp" and the brands (ISO 23008-12).
    if head[4:8] == b"ftyp" and any(brand in head[8:] for brand in _HEIF):
        raise CoreError(
            tr("{name} is a HEIC picture, which Turnlight cannot read.", name=path.name),
            tr(
                "Export it as a JPEG. To take JPEGs on an iPhone, choose Settings, "
                "Camera, Formats, Most Compatible."
            ),
        )


def _check(source: ImageInput, name: str) -> None:
    spec = source.spec()
    rows, columns = spec.height, spec.width
    if source.format_name() not in _KINDS or str(spec.format) not in _TYPES or spec.depth > 1:
        raise CoreError(tr("{name} is not an ordinary picture.", name=name), _EXPORT)
    if rows * columns > _MOST_PIXELS or is_unwieldy(spec):
        raise CoreError(
            tr("{name} has too many pixels.", name=name), tr("Export a smaller version.")
        )
    if min(rows, columns) < _LEAST_SIDE:
        raise CoreError(
            tr("{name} is only {columns} x {rows} pixels.", name=name, columns=columns, rows=rows),
            tr("Use a larger picture."),
        )


def _pixels(source: ImageInput, name: str, longest: int) -> Bytes:
    """Decode to (H, W, 3) uint8, row by row, averaging blocks of pixels if fewer are enough."""
    spec = source.spec()
    height, width = int(spec.height), int(spec.width)
    step = max(max(height, width) // longest, 1) if longest > 0 else 1
    size = (max(width // step, 1), max(height // step, 1))
    picture = np.empty((size[1], size[0], 3), np.uint8)
    channels = 1 if spec.nchannels < 3 else 3
    rows = max(rows_at_once(spec, _BAND_PIXELS) // step, 1)
    for start in range(0, size[1], rows):
        stop = min(start + rows, size[1])
        band = read_rows(source, (start * step, stop * step), (0, channels), "uint8")
        if band is None or clear_error(source):
            clear_error(source)
            raise CoreError(tr("{name} is damaged or incomplete.", name=name), _COPY_AGAIN)
        if step > 1:
            whole = np.ascontiguousarray(band[:, : size[0] * step])
            small = cv2.resize(whole, (size[0], stop - start), interpolation=cv2.INTER_AREA)
            band = small.reshape(stop - start, size[0], channels)
        picture[start:stop] = band
    return picture


def _small(picture: Bytes, longest: int) -> Bytes:
    rows, columns = picture.shape[:2]
    if longest <= 0 or max(rows, columns) <= longest:
        return picture
    share = longest / max(rows, columns)
    size = (max(round(columns * share), 1), max(round(rows * share), 1))
    whole = np.ascontiguousarray(picture)
    return np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA), np.uint8)


def _raw_said(path: Path) -> dict[str, Any]:
    """Return the tags of the raw file itself if it is a TIFF, since previews often have no tags."""
    source = open_image(path)
    if source is None:
        return dict.fromkeys(_TAGS)
    with contextlib.closing(source):
        return _metadata(source.spec())


def _metadata(spec: Any) -> dict[str, Any]:
    """Return the tags as stored, even if the header is damaged, with None for missing tags."""
    return {name: stated_value(spec, name) for name in _TAGS}


def _time(words: Any, offset: Any) -> datetime | None:
    """Parse an EXIF time and its offset from UTC, if one is recorded."""
    for text, form in ((f"{words}{offset}", "%Y:%m:%d %H:%M:%S%z"), (words, "%Y:%m:%d %H:%M:%S")):
        with contextlib.suppress(ValueError):
            return datetime.strptime(str(text).strip("\0 "), form)
    return None
