"""Read the metadata of a frame.

The size, the number type and EXIF come from the header as read by OpenImageIO, and a Theta's maker
note comes from `measure.read.makernote`. Files are untrusted, so a file that cannot be a frame
raises a `ProbeError` with a one-sentence message, and tags with impossible values count as absent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.atomic_files import os_errors_as
from app.core.base.errors import ProbeError
from app.core.base.imaging.image_input import (
    COPY_AGAIN,
    first_bytes,
    is_unwieldy,
    open_image,
    stated_orientation,
    stated_primaries,
    stated_value,
)
from app.core.base.remarks import Remark
from app.core.measure.read.frame import Exposure, Frame, LensExposure, XmpPose
from app.core.measure.read.makernote import RicohNote, read_ricoh_note
from app.core.measure.read.remarks import PhoneRendered, TwoApertures, TwoTimes
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

ENDINGS: Final = (".jpg", ".jpeg", ".insp", ".png", ".tif", ".tiff", ".exr", ".hdr")
"""Suffixes of the files that are used in a folder. Insta360 uses .insp for unstitched JPEGs."""

FRAME_ENDINGS: Final = frozenset({".jpg", ".jpeg", ".insp", ".png", ".tif", ".tiff", ".dng"})
"""Suffixes of photos that may be frames of a bracket."""

MAX_SIDE: Final = 16384
"""Maximum length of a frame's side in pixels, as in a panorama of 16384 x 8192."""

MIN_WIDTH: Final = 16
"""Minimum width of a frame in pixels, twice the minimum height, at 22.5 degrees per pixel."""

SHUTTER_LIMITS_S: Final = (1e-7, 1e5)
"""Range of plausible exposure times, in seconds."""

ISO_LIMITS: Final = (0.5, 1e7)
"""Range of plausible ISO values."""

APERTURE_LIMITS: Final = (0.3, 1000.0)
"""Range of plausible f-numbers. Cameras record 0 for an unknown lens."""

# Maximum pixels in a row of tiles, one of which is in memory per frame.
_MOST_TILED: Final = 1 << 21

_KINDS: Final = {
    "uint8": "uint8",
    "uint16": "uint16",
    "half": "half",
    "float": "float",
    "double": "float",
}
_FORMATS: Final = ("jpeg", "png", "tiff", "openexr", "hdr")
_SIGNATURES: Final = (b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01", b"#?")
_TIFF_SIGNATURES: Final = (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")
_ISO_TAGS: Final = (
    "Exif:PhotographicSensitivity",
    "Exif:ISOSpeedRatings",
    "ISOSpeedRatings",
)
# The 16 bits of PhotographicSensitivity end at 65535 (EXIF 2.32, table 4). These tags hold larger
# values.
_LARGE_ISO_TAGS: Final = (
    "Exif:RecommendedExposureIndex",
    "Exif:StandardOutputSensitivity",
    "Exif:ISOSpeed",
)
_ISO_OVERFLOW: Final = 65535
_APEX_TOLERANCE: Final = 0.5
_PHONE_HDR: Final = (2.0, 3.0, 7.0)
_WHOLE: Final = 0.98
_FOCAL_MM: Final = (6.0, 2000.0)


@dataclass(frozen=True, slots=True)
class Header:
    """A frame with its EXIF time in seconds, ISO and f-number, each None if not recorded.

    Attributes:
        part: Whether the frame shows only part of the sphere (a cropped area in GPano).
    """

    frame: Frame
    shutter_s: float | None = None
    iso: float | None = None
    aperture: float | None = None
    orientation: int = 1
    note: RicohNote | None = None
    doubts: tuple[Remark, ...] = ()
    part: bool = False


def read_header(path: Path | str) -> Header:
    """Read the exposure and the orientation of a picture file without decoding its pixels.

    `Frame.exposure` is None if no exposure time is recorded. If only the ISO or the f-number is
    missing, it is assumed to be 100 or 1, respectively, and the exposure is marked as unknown.

    Raises:
        ProbeError: If the file is missing, empty, damaged or a folder, or the picture is of an
            unsupported kind, too large or too small.
    """
    file = Path(path)
    jpeg = _check_signature(file).startswith(b"\xff\xd8")
    source = open_image(file)
    if source is None:
        raise _damaged(file)
    try:
        note = read_ricoh_note(file) if jpeg else None
        return _header(source, file, note)
    finally:
        source.close()


def _damaged(file: Path) -> ProbeError:
    return ProbeError(tr("{name} is damaged or incomplete.", name=file.name), COPY_AGAIN)


def _unread(file: Path) -> ProbeError:
    return ProbeError(
        tr("{name} is not a readable picture.", name=file.name),
        tr("Turnlight reads JPEG, PNG, TIFF, OpenEXR and Radiance."),
    )


def _check_signature(file: Path) -> bytes:
    """Check the first bytes of a file before any decoder reads it."""
    start = first_bytes(
        file,
        ProbeError,
        tr("{file} is a folder, not a picture.", file=file),
        tr("Choose the files in it."),
    )
    if start.startswith(_TIFF_SIGNATURES):
        if file.suffix.lower() in (".tif", ".tiff"):
            return start
        raise ProbeError(
            tr("{name} is a raw or TIFF-like file that Turnlight cannot read.", name=file.name),
            tr("Export it to a TIFF file (.tif) without a tone curve, or use the camera’s JPEG."),
        )
    # A Radiance file may begin with comments, so its signature proves nothing.
    if not start.startswith(_SIGNATURES) and file.suffix.lower() != ".hdr":
        raise _unread(file)
    return start


def _header(source: ImageInput, file: Path, note: RicohNote | None) -> Header:
    spec = source.spec()
    _check_format(source.format_name(), spec, file)
    _check_size(spec, file)
    shutter, iso, aperture = _shutter(spec), _iso(spec), _aperture(spec)
    orientation = stated_orientation(source)
    rows, columns = int(spec.height), int(spec.width)
    # The pose states the orientation of a full panorama, for which viewers ignore EXIF's tag.
    passed_over = columns == 2 * rows and source.format_name() != "hdr"
    rotation = 1 if passed_over else orientation
    frame = Frame(
        path=file,
        shape=(columns, rows) if rotation >= 5 else (rows, columns),
        kind=_KINDS[str(spec.format)],
        exposure=_exposure(shutter, iso, aperture),
        camera=_text(spec, "Model"),
        pose=_pose(spec),
        area_deg=_area(spec),
        zenith_corrected=None if note is None else note.zenith_corrected,
        lenses=() if note is None else _lenses(note, shutter),
        tone_mapped=note is not None and note.tone_mapped,
        fisheye=note is not None and note.equirectangular is False,
        orientation=rotation,
        primaries=_primaries(source, file),
        focal_mm=_number(spec, "Exif:FocalLengthIn35mmFilm", _FOCAL_MM),
    )
    return Header(
        frame,
        shutter,
        iso,
        aperture,
        orientation,
        note,
        (*_apex_doubts(spec, file.name, shutter, aperture), *_phone_doubts(spec, file.name)),
        _is_part(spec),
    )


def _primaries(source: ImageInput, file: Path) -> tuple[float, ...]:
    """Read the primaries of OpenEXR, the only format here whose colours may not be sRGB's."""
    try:
        return stated_primaries(source.spec()) if source.format_name() == "openexr" else ()
    except ValueError:
        raise _damaged(file) from None


def _check_format(name: str, spec: ImageSpec, file: Path) -> None:
    if name not in _FORMATS:
        raise _unread(file)
    if str(spec.format) not in _KINDS:
        raise ProbeError(
            tr(
                "{name} uses a pixel format that Turnlight cannot read ({format}).",
                name=file.name,
                format=spec.format,
            ),
            tr("Export it with 8 or 16 bits, or as floating point."),
        )
    if spec.tile_height * spec.width > _MOST_TILED or is_unwieldy(spec):
        raise ProbeError(
            tr(
                "{name} is stored in blocks or channels that are too large to read.", name=file.name
            ),
            tr("Export it in rows, or in tiles of 64 x 64."),
        )
    window = (spec.x, spec.y, spec.width, spec.height)
    whole = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if name == "openexr" and window != whole:
        raise ProbeError(
            tr(
                "{name} contains only part of its picture (its data window is cropped).",
                name=file.name,
            ),
            tr("Export the whole picture."),
        )


def _check_size(spec: ImageSpec, file: Path) -> None:
    width, height = int(spec.width), int(spec.height)
    size = f"{width} x {height}"
    if max(width, height) > MAX_SIDE or width * height > MAX_SIDE * MAX_SIDE // 2:
        raise ProbeError(
            tr(
                "{name} is {size} pixels. The largest supported size is {max_side} x {max_side}.",
                name=file.name,
                size=size,
                max_side=MAX_SIDE,
            ),
            tr("Scale all frames down by the same factor."),
        )
    if width < MIN_WIDTH or height < MIN_WIDTH // 2:
        raise ProbeError(
            tr(
                "{name} is only {size} pixels: too small to show where the light comes from.",
                name=file.name,
                size=size,
            ),
            tr("Use the original pictures, not their thumbnails."),
        )


def _exposure(shutter: float | None, iso: float | None, aperture: float | None) -> Exposure | None:
    if shutter is None:
        return None
    absolute = iso is not None and aperture is not None
    return Exposure(shutter, 100.0 if iso is None else iso, aperture or 1.0, absolute)


def _shutter(spec: ImageSpec) -> float | None:
    plain = _number(spec, "ExposureTime", SHUTTER_LIMITS_S)
    if plain is not None:
        whole = 1.0 / max(round(1.0 / plain), 1)
        # Return 1/60 s, not the shortest fraction that is equal in 32 bits.
        return whole if np.float32(whole) == np.float32(plain) else plain
    apex = _number(spec, "Exif:ShutterSpeedValue", (-16.0, 23.0))
    return None if apex is None else 2.0**-apex


def _aperture(spec: ImageSpec) -> float | None:
    plain = _number(spec, "FNumber", APERTURE_LIMITS)
    if plain is not None:
        return plain
    # 0 would be f/1, but cameras write it for an unknown lens.
    apex = _number(spec, "Exif:ApertureValue", (0.01, 19.0))
    return None if apex is None else round(2.0 ** (apex / 2.0), 2)


def _iso(spec: ImageSpec) -> float | None:
    first = None
    for name in _ISO_TAGS:
        first = first or _number(spec, name, ISO_LIMITS)
    if first is not None and first < _ISO_OVERFLOW:
        return first
    for name in _LARGE_ISO_TAGS:
        larger = _number(spec, name, ISO_LIMITS)
        if larger is not None:
            return larger
    return first


def _apex_doubts(
    spec: ImageSpec, name: str, shutter: float | None, aperture: float | None
) -> tuple[Remark, ...]:
    """Compare the plain values in EXIF with the logarithmic values stored next to them."""
    doubts: list[Remark] = []
    apex = _number(spec, "Exif:ShutterSpeedValue", (-16.0, 23.0))
    if shutter and apex and abs(math.log2(shutter) + apex) > _APEX_TOLERANCE:
        doubts.append(TwoTimes(name, shutter, 2.0**-apex))
    apex = _number(spec, "Exif:ApertureValue", (0.01, 19.0))
    if aperture and apex and abs(2.0 * math.log2(aperture) - apex) > _APEX_TOLERANCE:
        doubts.append(TwoApertures(name, aperture, 2.0 ** (apex / 2)))
    return tuple(doubts)


def _phone_doubts(spec: ImageSpec, name: str) -> tuple[Remark, ...]:
    """Detect HDR rendering by a phone (EXIF CustomRendered, with Apple's values)."""
    rendered = _number(spec, "Exif:CustomRendered", (0.0, 99.0)) in _PHONE_HDR
    return (PhoneRendered(name),) if rendered else ()


def _is_part(spec: ImageSpec) -> bool:
    """Return whether the picture is a crop of a full panorama according to GPano."""
    for side in ("Width", "Height"):
        size_px = _number(spec, f"GPano:CroppedAreaImage{side}Pixels", (1.0, 1e6))
        whole = _number(spec, f"GPano:FullPano{side}Pixels", (1.0, 1e6))
        if size_px is not None and whole is not None and size_px < _WHOLE * whole:
            return True
    return False


def _pose(spec: ImageSpec) -> XmpPose | None:
    """Return the GPano pose (Photo Sphere XMP), with 0 for missing angles, as in its schema."""
    pitch = _number(spec, "GPano:PosePitchDegrees", (-90.0, 90.0))
    roll = _number(spec, "GPano:PoseRollDegrees", (-180.0, 180.0))
    if pitch is None and roll is None:
        return None
    heading = _number(spec, "GPano:PoseHeadingDegrees", (-360.0, 360.0))
    return XmpPose(pitch or 0.0, roll or 0.0, heading)


def _area(spec: ImageSpec) -> tuple[float, float, float, float] | None:
    """Return the part of the sphere given by GPano, whose sizes refer to the original picture."""
    sides = ("ImageWidthPixels", "ImageHeightPixels", "LeftPixels", "TopPixels")
    names = (
        *(f"CroppedArea{side}" for side in sides),
        "FullPanoWidthPixels",
        "FullPanoHeightPixels",
    )
    read = [_number(spec, f"GPano:{name}", (0.0, 1e6)) for name in names]
    numbers = [number for number in read if number is not None]
    if len(numbers) < len(names) or min(numbers[0], numbers[1], numbers[4], numbers[5]) <= 0.0:
        return None
    wide, tall, left, top, full_wide, full_tall = numbers
    edges = [360.0 * at / full_wide - 180.0 for at in (left, left + wide)]
    rows = [90.0 - 180.0 * at / full_tall for at in (top, top + tall)]
    return (edges[0], edges[1], rows[0], rows[1]) if edges[1] < 181.0 and rows[1] > -91.0 else None


def _lenses(note: RicohNote, shutter: float | None) -> tuple[LensExposure, ...]:
    shutters = note.lens_shutters_s or ((shutter, shutter) if shutter else ())
    if not note.lens_isos or not shutters:
        return ()
    pairs = zip(shutters, note.lens_isos, strict=True)
    return tuple(LensExposure(float(seconds), iso) for seconds, iso in pairs)


def _number(spec: ImageSpec, name: str, limits: tuple[float, float]) -> float | None:
    """Return a tag as a number, or None if it is absent, not a number or implausible."""
    value = stated_value(spec, name)
    if isinstance(value, tuple) and value:
        value = value[0]
    if not isinstance(value, (str, int, float)):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    if not limits[0] <= number <= limits[1]:  # NaN fails this too.
        return None
    return _shortest(number)


def _shortest(value: float) -> float:
    """Undo the rounding of fractions to 32 bits, which turns 0.0020000000949949026 into 0.002."""
    single = np.float32(value)
    return float(str(single)) if float(single) == value else value


def _text(spec: ImageSpec, name: str) -> str:
    """Return a tag as text, without the spaces and null characters that cameras pad it with."""
    return " ".join(str(stated_value(spec, name) or "").replace("\0", " ").split())


_MOST_LISTED: Final = 500


def pictures_in(folder: Path) -> list[Path]:
    """List the pictures in a folder, sorted by name.

    Raises:
        ProbeError: If there are no pictures or too many, or the folder cannot be read.
    """
    sentence = tr("The folder {folder} cannot be read: {reason}.")
    with os_errors_as(ProbeError, sentence, folder=folder):
        files = [
            entry
            for entry in folder.iterdir()
            if entry.suffix.lower() in ENDINGS and not entry.name.startswith(".")
        ]
        files = [file for file in files if file.is_file()]
    if not files:
        raise ProbeError(
            tr("The folder {folder} contains no pictures.", folder=folder),
            tr("Turnlight reads files ending in {endings}.", endings=", ".join(ENDINGS)),
        )
    if len(files) > _MOST_LISTED:
        raise ProbeError(
            tr(
                "{folder} contains {count} pictures, too many for a bracket.",
                folder=folder,
                count=len(files),
            ),
            tr("Move the frames of one place to a separate folder."),
        )
    return sorted(files, key=lambda file: file.name)
