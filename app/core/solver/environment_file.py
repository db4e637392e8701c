"""Reading OpenEXR and Radiance panoramas with OpenImageIO, and repairing what they carry.

Files come from anywhere. Every way in which one can be bad ends in an `EnvironmentFileError` with
one sentence and a next step, and nothing large is allocated before the header has been judged.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.arrays import Float64
from app.core.base.colour import FloatImage, to_rec709
from app.core.base.errors import EnvironmentFileError
from app.core.base.image_input import (
    COPY_AGAIN,
    clear_error,
    first_bytes,
    is_unwieldy,
    open_image,
    read_rows,
    rows_at_once,
    stated_orientation,
    stated_primaries,
    upright,
)
from app.core.text import tr, tr_plural

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

MAX_WIDTH: Final = 16384
"""Widest panorama read, in texels: 1.6 GB as float. Wider ones say nothing more about light."""

MIN_WIDTH: Final = 16
"""Narrowest panorama read, in texels: 22.5 degrees each."""

_MOST_REPAIRED: Final = 0.03  # of the sphere, or of the light
_MAX_PARTS: Final = 16
_BAND_ROWS: Final = 64
_READ_ROWS: Final = 512
_EXR: Final = b"\x76\x2f\x31\x01"
_OTHER_IMAGES: Final = (
    (b"\xff\xd8\xff", "JPEG"),
    (b"\x89PNG", "PNG"),
    (b"II*\x00", tr("TIFF or raw")),
    (b"MM\x00*", tr("TIFF or raw")),
    (b"GIF8", "GIF"),
    (b"BM", "BMP"),
    (b"RIFF", "WebP"),
    (b"\x00\x00\x00\x0cjXL", "JPEG XL"),
    (b"\xff\x0a", "JPEG XL"),
)
_SAVE_AS: Final = tr("Save it as OpenEXR (.exr) or Radiance (.hdr).")


@dataclass(frozen=True, slots=True)
class Repairs:
    """How many texels of a panorama were repaired."""

    nan: int = 0
    infinite: int = 0
    negative: int = 0

    @property
    def total(self) -> int:
        """All counts together; a texel with two kinds of damage counts twice."""
        return self.nan + self.infinite + self.negative

    def warnings(self, name: str) -> tuple[str, ...]:
        """Say in words what was repaired.

        Examples:
            >>> Repairs(nan=2, negative=1).warnings("hall")
            ('hall: repaired 2 NaN texels (set to 0), 1 negative texel (set to 0).',)
        """
        parts = []
        if self.nan:
            parts.append(
                tr_plural("{count} NaN texel (set to 0)", "{count} NaN texels (set to 0)", self.nan)
            )
        if self.infinite:
            parts.append(
                tr_plural(
                    "{count} infinite texel (set to the largest finite value)",
                    "{count} infinite texels (set to the largest finite value)",
                    self.infinite,
                )
            )
        if self.negative:
            parts.append(
                tr_plural(
                    "{count} negative texel (set to 0)",
                    "{count} negative texels (set to 0)",
                    self.negative,
                )
            )
        return (tr("{name}: repaired {what}.", name=name, what=", ".join(parts)),) if parts else ()


def repair(radiance: FloatImage, name: str) -> Repairs:
    """Make every value finite and not negative, in place.

    Args:
        radiance: Float32, (H, W, 3). Linear radiance; changed in place, band by band,
            so that a large panorama needs no copy.

    Raises:
        EnvironmentFileError: When nothing but black is left, or more than 3 % of the sphere or of
            the light would have to be made up.
    """
    bands = [radiance[row : row + _BAND_ROWS] for row in range(0, len(radiance), _BAND_ROWS)]
    areas = np.split(_areas(*radiance.shape[:2]), range(_BAND_ROWS, len(radiance), _BAND_ROWS))
    nan = infinite = negative = 0
    largest = unknown = below_zero = 0.0
    for band, area in zip(bands, areas, strict=True):
        finite = np.isfinite(band)
        top = float(np.max(band, where=finite, initial=0.0))
        largest = max(largest, top)
        if finite.all() and float(band.min()) >= 0.0:
            continue
        holes, below = np.isnan(band), band < 0.0
        nan += _texels(holes)
        negative += _texels(below)
        infinite += _texels(np.isposinf(band))
        unknown += float(area @ (~finite).any(axis=-1).sum(axis=1))
        below_zero -= float(area @ np.sum(band, axis=(1, 2), where=below & finite, dtype=float))
        band[holes | below] = 0.0
    if largest <= 0.0:
        raise EnvironmentFileError(
            tr("{name} is black: no texel has any light.", name=name),
            tr("Choose another panorama."),
        )
    if unknown > _MOST_REPAIRED:
        raise EnvironmentFileError(
            tr(
                "{name} is damaged: {unknown:.0f} % of the sphere is NaN or infinite.",
                name=name,
                unknown=100.0 * unknown,
            ),
            COPY_AGAIN,
        )
    if infinite:
        for band in bands:
            band[np.isposinf(band)] = largest
    if below_zero:
        light = sum(
            float(a @ b.sum(axis=(1, 2), dtype=float)) for a, b in zip(areas, bands, strict=True)
        )
        if below_zero > _MOST_REPAIRED * light:
            raise EnvironmentFileError(
                tr("{name} is damaged: much of its light is negative.", name=name), COPY_AGAIN
            )
    return Repairs(nan, infinite, negative)


def _areas(height: int, width: int) -> Float64:
    """Share of the sphere of one texel in each row, (H,)."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return (edges[:-1] - edges[1:]) / (2.0 * width)


def read_panorama(path: Path | str) -> tuple[FloatImage, str]:
    """Read the colours of an OpenEXR or Radiance panorama as they are stored.

    Returns:
        radiance: Float32, (H, 2 H, 3). Linear radiance, not yet repaired; grey files
            are spread over three channels, other channels (alpha, depth) are left out.

    Raises:
        EnvironmentFileError: When it cannot be read or is not a panorama.
    """
    file = Path(path)
    _check_signature(file)
    source = open_image(file)
    if source is None:
        raise _damaged(file)
    try:
        radiance = _read_part(source, file)
    except MemoryError:
        raise EnvironmentFileError(
            tr("{name} is too large for this machine's memory.", name=file.name),
            tr("Scale it down to 4096 x 2048 texels."),
        ) from None
    except UnicodeError:
        # Names of channels in a damaged header.
        raise _damaged(file) from None
    finally:
        source.close()
    return radiance, file.stem


def _texels(bad: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> int:
    return int(np.count_nonzero(bad.any(axis=-1)))


def _damaged(file: Path) -> EnvironmentFileError:
    return EnvironmentFileError(tr("{name} is damaged or incomplete.", name=file.name), COPY_AGAIN)


def _check_signature(file: Path) -> None:
    """Judge the file by its first bytes, before any decoder sees it."""
    head = first_bytes(
        file,
        EnvironmentFileError,
        tr("{file} is a folder, not a panorama.", file=file),
        tr("Name one .exr or .hdr file."),
    )
    if head.startswith((_EXR, b"#?")):
        return
    for magic, kind in _OTHER_IMAGES:
        if head.startswith(magic):
            raise EnvironmentFileError(
                tr(
                    "{name} is a {kind} image, which does not hold the light's full range: "
                    "an HDR panorama is needed.",
                    name=file.name,
                    kind=kind,
                ),
                tr(
                    "Merge a bracket of exposures to an OpenEXR file first, or this picture alone "
                    "for a rough one."
                ),
            )
    raise EnvironmentFileError(tr("{name} is not an HDR panorama.", name=file.name), _SAVE_AS)


def _read_part(source: ImageInput, file: Path) -> FloatImage:
    """Find the part with colours, judge its size, and read it."""
    for part in range(_MAX_PARTS):
        if not source.seek_subimage(part, 0):
            break
        spec = source.spec()
        channels = _colour_channels(spec)
        if channels is None:
            continue
        _check_size(spec, file)
        radiance = _on_display_window(_read_channels(source, part, channels, file), spec)
        _to_rec709(radiance, spec, file)
        return _upright(radiance, stated_orientation(source))
    raise EnvironmentFileError(
        tr("{name} has no red, green and blue channels.", name=file.name),
        tr("Export it as an RGB panorama."),
    )


def _to_rec709(radiance: FloatImage, spec: ImageSpec, file: Path) -> None:
    """Bring colours of other primaries, such as ACES', to those that everything here has."""
    try:
        primaries = stated_primaries(spec)
    except ValueError:
        raise _damaged(file) from None
    if primaries:
        to_rec709(radiance, primaries)


def _colour_channels(spec: ImageSpec) -> tuple[int, ...] | None:
    """Find red, green, blue by name (with or without a layer's prefix), else one grey channel."""
    names = [str(name).lower() for name in spec.channelnames]
    where = {name: index for index, name in reversed(list(enumerate(names)))}
    prefixes = [""] + [name[: name.rindex(".") + 1] for name in names if "." in name]
    for prefix in prefixes:
        for wanted in (("r", "g", "b"), ("red", "green", "blue")):
            found = [where.get(prefix + name) for name in wanted]
            if None not in found:
                return tuple(index for index in found if index is not None)
    # Luminance with chroma (Y, RY, BY) is another colour space, not grey.
    if "ry" in where or "by" in where:
        return None
    grey = [where[name] for name in ("y", "l", "i", "grey", "gray") if name in where]
    colours = [index for index, name in enumerate(names) if name not in ("a", "alpha", "z")]
    if grey:
        return (grey[0],)
    return (colours[0],) if len(colours) == 1 else None


def _check_size(spec: ImageSpec, file: Path) -> None:
    width, height = _display_size(spec)
    size = f"{width} x {height}"
    if width != 2 * height:
        raise EnvironmentFileError(
            tr(
                "{name} is {size}, but a full panorama is twice as wide as high.",
                name=file.name,
                size=size,
            ),
            tr("Export it as a 360 x 180 degree equirectangular (lat-long) image."),
        )
    # A cropped picture is held beside the panorama that it is laid on.
    stored = spec.width * spec.height
    held = stored if (spec.width, spec.height) == (width, height) else stored + width * height
    if width > MAX_WIDTH or held > MAX_WIDTH**2 // 2:
        raise EnvironmentFileError(
            tr(
                "{name} is {size}; at most {max_width} x {max_width} is read.",
                name=file.name,
                size=size,
                max_width=MAX_WIDTH,
            ),
            tr("Scale it down; 2048 x 1024 holds all that is needed."),
        )
    if is_unwieldy(spec):
        raise EnvironmentFileError(
            tr("{name} is stored in blocks or channels too large to read.", name=file.name),
            tr("Export it in rows, with red, green and blue alone."),
        )
    if width < MIN_WIDTH:
        raise EnvironmentFileError(
            tr(
                "{name} is only {size}: too few texels to tell where the light comes from.",
                name=file.name,
                size=size,
            ),
            tr("Use at least {min_width} x {min_width}, better 1024 x 512.", min_width=MIN_WIDTH),
        )


def _lies_on_its_side(spec: ImageSpec) -> bool:
    """Whether the rows of the file are the columns of the picture (EXIF orientations 5 to 8)."""
    return 5 <= spec.get_int_attribute("Orientation", 1) <= 8


def _display_size(spec: ImageSpec) -> tuple[int, int]:
    """Size of the whole picture; a cropped panorama counts as the panorama it was cropped from."""
    if _lies_on_its_side(spec):
        return int(spec.height), int(spec.width)
    if spec.full_width == 2 * spec.full_height:
        return int(spec.full_width), int(spec.full_height)
    return int(spec.width), int(spec.height)


def _read_channels(
    source: ImageInput, part: int, channels: tuple[int, ...], file: Path
) -> FloatImage:
    """Read colours, or grey three times; in bands of rows, so that nothing is held twice."""
    spec = source.spec()
    height = int(spec.height)
    values = np.empty((height, int(spec.width), 3), np.float32)
    first = channels[0]
    # Neighbours, as nearly always, in one pass.
    together = channels == (first, first + 1, first + 2)
    groups = [(first, first + 3)] if together else [(channel, channel + 1) for channel in channels]
    step = rows_at_once(spec, _READ_ROWS)
    for row in range(0, height, step):
        stop = min(row + step, height)
        for place, group in enumerate(groups):
            band = read_rows(source, (row, stop), group, "float", part)
            if band is None:
                clear_error(source)
                raise _damaged(file)
            where = slice(None) if len(groups) == 1 else slice(place, place + 1)
            values[row:stop, :, where] = band
    return values


def _on_display_window(radiance: FloatImage, spec: ImageSpec) -> FloatImage:
    """Place a cropped data window on the panorama; what was cropped away is black."""
    width, height = _display_size(spec)
    if _lies_on_its_side(spec):
        return radiance
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    whole = (left, top, spec.width, spec.height) == (0, 0, width, height)
    if whole or (width, height) == (spec.width, spec.height) != (spec.full_width, spec.full_height):
        return radiance
    panorama = np.zeros((height, width, 3), dtype=np.float32)
    rows = slice(max(top, 0), min(top + spec.height, height))
    columns = slice(max(left, 0), min(left + spec.width, width))
    if rows.start < rows.stop and columns.start < columns.stop:
        panorama[rows, columns] = radiance[
            rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
        ]
    return panorama


def _upright(radiance: FloatImage, orientation: int) -> FloatImage:
    """Undo the mirrorings and turns that a header can state (EXIF 2.32); mirrorings in place."""
    if orientation > 4:
        return upright(radiance, orientation)
    height = len(radiance)
    if orientation in (2, 3):
        for row in range(0, height, _BAND_ROWS):
            radiance[row : row + _BAND_ROWS] = radiance[row : row + _BAND_ROWS, ::-1].copy()
    if orientation in (3, 4):
        for row in range(height // 2):
            radiance[[row, -1 - row]] = radiance[[-1 - row, row]]
    return radiance
