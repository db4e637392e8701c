"""The photograph that was taken: read within bounds, located, and how far off the light it was.

A photograph is a live picture with more pixels and more to say: EXIF knows which way is up, when it
was taken and how wide the lens was. Its width is a hint only, since pictures are cropped; a photo
that is not found with it is looked for without it.
"""

from __future__ import annotations

import contextlib
import math
import stat
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.angles import wrap
from app.core.errors import CoreError
from app.core.gallery import value_at
from app.core.probe.decoding import decode
from app.core.probe.metadata import read_header
from app.core.progress import Report, Token, silent
from app.core.turning.field import ASSUMED_DEG
from app.core.turning.guidance import Goal, Reading, guide
from app.core.turning.heading import UNSURE, Heading, HeadingIndex, find_heading
from app.core.turning.headings import offset_angle, turn_of_heading
from app.core.turning.picture_file import upright
from app.core.turning.sitter import background_mask, find_sitter
from app.core.turning.words import whole

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.probe.metadata import Header
    from app.core.solve import StyleResult
    from app.core.turning.sitter import Sitter

__all__ = [
    "PHOTO_ENDINGS",
    "Photo",
    "Taken",
    "Verdict",
    "is_panorama",
    "judge",
    "locate_photo",
    "read_photo",
]

Bytes: TypeAlias = NDArray[np.uint8]

PHOTO_ENDINGS: Final = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff"})
"""Endings of files that may be a photograph."""

_LONGEST: Final = 1600  # pixels of the longer side: more show nothing more of the background
_SHORTEST: Final = 200
_MOST_BYTES: Final = 512 << 20
_MOST_PIXELS: Final = 160_000_000
_FRAME_DIAGONAL_MM: Final = math.hypot(36.0, 24.0)
_FOCAL_MM: Final = (6.0, 2000.0)
_PANORAMA: Final = 2.0
_PANORAMA_OFF: Final = 0.01
_NO_SITTER: Final = 0.7
_SEEN: Final = "Looking for the background"


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A photograph, upright and small enough to work on.

    Attributes
    ----------
    picture : (H, W, 3) uint8
        sRGB, at most 1,600 pixels on its longer side.
    size : tuple of int
        Columns and rows of the file's picture, upright.
    taken_at : datetime or None
        As the camera says; without an offset from UTC where it states none.
    focal_mm : float or None
        As on a frame of 36 x 24 mm.
    """

    picture: Bytes = field(repr=False)
    size: tuple[int, int]
    taken_at: datetime | None = None
    focal_mm: float | None = None

    @property
    def fov_deg(self) -> float | None:
        """Horizontal field of view by the focal length, deg; it means the frame's diagonal."""
        if self.focal_mm is None:
            return None
        half = _FRAME_DIAGONAL_MM / 2.0 / self.focal_mm * self.size[0] / math.hypot(*self.size)
        return 2.0 * math.degrees(math.atan(half))


@dataclass(frozen=True, slots=True)
class Taken:
    """From where a photograph was taken.

    Attributes
    ----------
    status : str
        ``found`` or ``unsure``.
    heading_deg : float or None
        Panorama azimuth of the camera's axis, deg; None when unsure.
    facing_deg : float or None
        Panorama azimuth that the sitter faced, deg: the turn, but for where it is counted from.
    sitter_deg : float or None
        The sitter from the axis, deg, positive to the right; None where none was seen, and they
        are taken to be in the middle.
    fov_deg : float or None
        Horizontal, as it turned out, deg.
    confidence : float
        0 to 1.
    """

    status: Literal["found", "unsure"]
    heading_deg: float | None = None
    facing_deg: float | None = None
    sitter_deg: float | None = None
    fov_deg: float | None = None
    confidence: float = 0.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """How far off the light a photograph was taken, in the numbers that are shown.

    Attributes
    ----------
    turn_deg, goal_deg : int
        Whole degrees of turn.
    to_go_deg : int
        goal - turn the shorter way, positive clockwise.
    outside_deg : int
        Whole degrees to the arc; 0 in it.
    match, best : int
        At that turn, and of the style here; rounded down.
    """

    turn_deg: int
    goal_deg: int
    to_go_deg: int
    outside_deg: int
    match: int
    best: int


def is_panorama(path: Path) -> bool:
    """Tell a whole panorama from a photograph by its shape, without decoding a pixel.

    Parameters
    ----------
    path : Path
        A picture.

    Raises
    ------
    CoreError
        When it cannot be read.
    """
    rows, columns = _header(path).frame.shape
    return abs(columns / rows - _PANORAMA) <= _PANORAMA_OFF * _PANORAMA


def read_photo(path: Path, token: Token | None = None) -> Photo:
    """Read a photograph.

    Parameters
    ----------
    path : Path
        JPEG, PNG or TIFF of 8 or 16 bits; it is only read.
    token : Token, optional
        Stops it.

    Returns
    -------
    Photo

    Raises
    ------
    CoreError
        When it is missing, damaged, no photograph, or too large.
    Cancelled
    """
    header = _header(path)
    rows, columns = header.frame.shape
    if header.frame.kind not in ("uint8", "uint16"):
        raise CoreError(
            f"{path.name} is not a photograph as cameras make them.", "Export it as a JPEG."
        )
    if rows * columns > _MOST_PIXELS:
        raise CoreError(f"{path.name} has too many pixels to be looked at.", "Export it smaller.")
    if min(rows, columns) < _SHORTEST:
        raise CoreError(
            f"{path.name} is only {columns} x {rows} pixels.",
            "Open the photograph itself, not its thumbnail.",
        )
    pixels = decode(header.frame, token or Token())
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    picture = upright(_small(np.asarray(pixels, np.uint8)), header.orientation)
    size = (rows, columns) if header.orientation >= 5 else (columns, rows)
    taken_at, focal = _said(path)
    return Photo(picture, size, taken_at, focal)


def _header(path: Path) -> Header:
    try:
        about = path.stat()
    except OSError as error:
        raise CoreError(f"There is no file {path}.", "Check the name.") from error
    # A pipe would be waited for, and a device has no end.
    if not stat.S_ISREG(about.st_mode) or about.st_size > _MOST_BYTES:
        raise CoreError(f"{path.name} is no photograph.", "Open a JPEG, PNG or TIFF file.")
    return read_header(path)


def _small(picture: Bytes) -> Bytes:
    rows, columns = picture.shape[:2]
    share = _LONGEST / max(rows, columns)
    if share >= 1.0:
        return picture
    size = (max(round(columns * share), 1), max(round(rows * share), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _said(path: Path) -> tuple[datetime | None, float | None]:
    """When it was taken, and the focal length for 35 mm, where the file says so."""
    import OpenImageIO as oiio

    said: dict[str, Any] = {}
    names = ("Exif:DateTimeOriginal", "Exif:OffsetTimeOriginal", "Exif:FocalLengthIn35mmFilm")
    with contextlib.suppress(UnicodeError):  # Texts of damaged headers.
        source = oiio.ImageInput.open(str(path))
        if source is None:
            oiio.geterror()
            return None, None
        try:
            spec = source.spec()
            for name in names:
                with contextlib.suppress(UnicodeError):
                    said[name] = spec.getattribute(name)
        finally:
            source.close()
    focal = said.get(names[2])
    if not isinstance(focal, (int, float)) or not _FOCAL_MM[0] <= focal <= _FOCAL_MM[1]:
        focal = None
    return _time(said.get(names[0]), said.get(names[1])), None if focal is None else float(focal)


def _time(words: Any, offset: Any) -> datetime | None:
    """Read a time of EXIF, with its offset from UTC where it is stated."""
    for text, form in ((f"{words}{offset}", "%Y:%m:%d %H:%M:%S%z"), (words, "%Y:%m:%d %H:%M:%S")):
        with contextlib.suppress(ValueError):
            return datetime.strptime(str(text).strip("\0 "), form)
    return None


def locate_photo(
    photo: Photo, index: HeadingIndex, token: Token | None = None, report: Report = silent
) -> Taken:
    """Find from where a photograph was taken, with the sitter's own angle in it.

    Parameters
    ----------
    photo : Photo
        Of the sitter: its camera looked at them.
    index : HeadingIndex
        Of the panorama.
    token : Token, optional
        Stops it.
    report : Report, optional
        Progress.

    Returns
    -------
    Taken
        ``unsure`` rather than a wrong number.

    Raises
    ------
    Cancelled
    """
    token = token or Token()
    report(0.2, _SEEN)
    fov = photo.fov_deg
    sitter = _sitter_in(photo.picture, fov or _assumed_fov(photo.picture))
    token.check()
    heading = UNSURE
    # Cropped, perhaps: then the focal length says nothing. Or it was not the sitter who was seen.
    tries = [(fov, sitter), (None, sitter), (None, None)]
    for number, (width, who) in enumerate(dict.fromkeys(tries)):
        token.check()
        report(0.4 + 0.2 * number, _SEEN)
        heading, sitter = _heading_of(photo.picture, index, width, who), who
        if heading.status == "found":
            break
    if heading.heading_deg is None:
        return Taken("unsure", confidence=heading.confidence)
    angle = _angle(sitter, heading.fov_deg)
    facing = turn_of_heading(heading.heading_deg, sitter_deg=angle or 0.0)
    # Somebody may be anywhere in a picture in which nobody is seen.
    confidence = heading.confidence * (_NO_SITTER if angle is None else 1.0)
    return Taken("found", heading.heading_deg, facing, angle, heading.fov_deg, confidence)


def _sitter_in(picture: Bytes, fov_deg: float) -> Sitter | None:
    try:
        return find_sitter(picture, fov_deg)
    except CoreError:
        # Nobody can be found without the network that does it; the background still can.
        return None


def _heading_of(
    picture: Bytes, index: HeadingIndex, fov_deg: float | None, sitter: Sitter | None
) -> Heading:
    angle = _angle(sitter, fov_deg or _assumed_fov(picture))
    mask = None if sitter is None else background_mask(sitter, picture.shape[:2])
    try:
        return find_heading(picture, index, fov_deg, sitter_deg=angle, mask=mask, fine=True)
    except cv2.error:
        # A picture that the library cannot work on is one without a heading.
        return UNSURE


def _assumed_fov(picture: Bytes) -> float:
    """Horizontal field of view where nothing says how wide it is, deg."""
    rows, columns = picture.shape[:2]
    half = math.tan(math.radians(ASSUMED_DEG) / 2.0) * columns / max(rows, columns)
    return 2.0 * math.degrees(math.atan(half))


def _angle(sitter: Sitter | None, fov_deg: float) -> float | None:
    return None if sitter is None else offset_angle(sitter.column, 1, fov_deg)


def judge(turn_deg: float, goal: Goal, result: StyleResult) -> Verdict:
    """Say how far off the light a turn is.

    Parameters
    ----------
    turn_deg : float
        Turn of the photograph, deg.
    goal : Goal
        Where the light is.
    result : StyleResult
        Of the style, seen from the same place as the turns.

    Returns
    -------
    Verdict
    """
    shown, _ = guide(goal, Reading(turn_deg, 0.0))
    turn = whole(turn_deg)
    here = value_at(result.match_curve, float(turn))
    if turn == whole(result.turn_refined_deg):
        here = result.match
    elif float(result.match_curve.max()) <= result.match + 1e-6:
        # Between the turns of the grid the curve may rise a little above its best.
        here = min(here, result.match)
    return Verdict(
        turn_deg=turn,
        goal_deg=shown.goal,
        to_go_deg=int(wrap(shown.goal - turn)),
        outside_deg=shown.until_light or 0,
        match=max(math.floor(here), 0),
        best=max(math.floor(result.match), 0),
    )
