"""Read linear panoramas with OpenImageIO and repair them.

Files come from anywhere. Every way in which one can be bad ends in an `EnvironmentFileError` with
one sentence and a next step, and nothing large is allocated before the header has been judged.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64
from app.core.base.colour import FloatImage, to_rec709
from app.core.base.errors import EnvironmentFileError
from app.core.base.imaging.image_input import (
    CLIPPED,
    COPY_AGAIN,
    ROUGH,
    UNSEEN,
    as_stored,
    clear_error,
    first_bytes,
    is_unwieldy,
    open_image,
    read_rows,
    read_start,
    rows_at_once,
    stated_orientation,
    stated_primaries,
    stated_value,
    upright,
)
from app.core.base.phrases import percent
from app.core.environment.layers import Layer, choose_layer, layers_of
from app.core.environment.remarks import Repaired
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

_Kind = TypeVar("_Kind", bound=np.generic)

MAX_WIDTH: Final = 16384
"""Widest panorama read, in texels: 1.6 GB as float. Wider ones say nothing more about light."""

MIN_WIDTH: Final = 16
"""Narrowest panorama read, in texels: 22.5 degrees each."""

HALF_MOST: Final = 65504.0
"""Largest half float; what was brighter became infinite, or this."""

INFINITE: Final = 3e5
"""What is infinite most likely is: suns beyond a half float are at 1e5 to 1e6 where sky is at 1."""

_MOST_REPAIRED: Final = 0.03  # of the sphere, or of the light
_LEAST_SEEN: Final = 0.1  # of the sphere
_HALF: Final = 0.5  # of a texel: less was not seen
_BAND_ROWS: Final = 64
_READ_ROWS: Final = 512
_EXR: Final = b"\x76\x2f\x31\x01"
_TIFF: Final = (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")
_OTHER_IMAGES: Final = (
    (b"\xff\xd8\xff", "JPEG"),
    (b"\x89PNG", "PNG"),
    *((magic, "TIFF or raw") for magic in _TIFF),
    (b"GIF8", "GIF"),
    (b"BM", "BMP"),
    (b"RIFF", "WebP"),
    (b"\x00\x00\x00\x0cjXL", "JPEG XL"),
    (b"\xff\x0a", "JPEG XL"),
)
_SAVE_AS: Final = tr("Save it as OpenEXR (.exr) or Radiance (.hdr).")


@dataclass(frozen=True, slots=True)
class Repairs:
    """How many texels of a panorama were repaired; `level` is what infinite ones became."""

    nan: int = 0
    infinite: int = 0
    negative: int = 0
    level: float = 0.0

    @property
    def total(self) -> int:
        """All counts together; a texel with two kinds of damage counts twice."""
        return self.nan + self.infinite + self.negative

    def remarks(self, name: str) -> tuple[Repaired, ...]:
        """Report what was repaired, if anything was."""
        if not self.total:
            return ()
        return (Repaired(name, self.nan, self.infinite, self.negative, self.level),)


def repair(radiance: FloatImage, name: str) -> tuple[Repairs, Bools | None]:
    """Make every value finite and not negative, in place.

    Infinite values become the largest of the rest, and at least `INFINITE`: a half float is
    infinite beyond `HALF_MOST`, and floats mostly are where they were halves before.

    Args:
        radiance: Float32, (H, W, 3). Linear radiance; changed in place, band by band,
            so that a large panorama needs no copy.

    Returns:
        Counts, and (H, W) bool where a texel was infinite; None where none was.

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
    clipped: Bools | None = None
    level = max(largest, INFINITE) if infinite else 0.0
    if infinite:
        clipped = np.asarray(np.isposinf(radiance).any(axis=-1))
        for band in bands:
            band[np.isposinf(band)] = level
    if below_zero:
        light = sum(
            float(a @ b.sum(axis=(1, 2), dtype=float)) for a, b in zip(areas, bands, strict=True)
        )
        if below_zero > _MOST_REPAIRED * light:
            raise EnvironmentFileError(
                tr("{name} is damaged: much of its light is negative.", name=name), COPY_AGAIN
            )
    return Repairs(nan, infinite, negative, level), clipped


def _areas(height: int, width: int) -> Float64:
    """Share of the sphere of one texel in each row, (H,)."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return (edges[:-1] - edges[1:]) / (2.0 * width)


@dataclass(frozen=True, slots=True)
class Panorama:
    """A panorama as stored, before repairs.

    Attributes:
        radiance: Float32, (H, 2 H, 3). Linear Rec. 709 radiance; grey is spread over three
            channels, 0 where nothing was seen.
        unseen: (H, 2 H) bool, transparent or outside the data window; None where all was seen.
        clipped: Float32, (H, 2 H). Share of each texel whose light its file states as a guess;
            None where it states none.
        layer, layers: The layer read and all that could be, where there are several.
        rough: Whether much of the light is a guess, by its file.
    """

    radiance: FloatImage = field(repr=False)
    name: str
    unseen: Bools | None = field(default=None, repr=False)
    clipped: Float32 | None = field(default=None, repr=False)
    layer: str = ""
    layers: tuple[str, ...] = ()
    rough: bool = False


def read_panorama(path: Path | str, layer: str = "", *, coverage: bool = True) -> Panorama:
    """Read the colours of a linear panorama: OpenEXR, Radiance, or TIFF of floating point.

    Args:
        layer: Of several layers the one to read; by default the beauty pass.
        coverage: Whether alpha says what was seen; otherwise colours stay as they are stored.

    Raises:
        LayerError: When that layer is not there, or one has to be chosen.
        EnvironmentFileError: When it cannot be read or is not a panorama.
    """
    file = Path(path)
    _check_signature(file)
    source = open_image(file, as_stored())
    if source is None:
        raise _damaged(file)
    try:
        return _read_layer(source, file, layer, coverage)
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


def is_linear(path: Path) -> bool:
    """Return whether a file holds linear light: OpenEXR, Radiance, or TIFF of floats."""
    source = None
    with contextlib.suppress(OSError):
        head = read_start(path, 16)
        if head.startswith((_EXR, b"#?")):
            return True
        source = open_image(path) if head.startswith(_TIFF) else None
    if source is None:
        return False
    with contextlib.closing(source):
        return str(source.spec().format) in ("half", "float", "double")


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
    if head.startswith((_EXR, b"#?")) or is_linear(file):
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


def _read_layer(source: ImageInput, file: Path, layer_name: str, coverage: bool) -> Panorama:
    """Find the layer, judge its size, and read it."""
    layers = layers_of(source)
    if not layers:
        raise EnvironmentFileError(
            tr("{name} has no red, green and blue channels.", name=file.name),
            tr("Export it as an RGB panorama."),
        )
    layer = choose_layer(layers, layer_name, file.name)
    source.seek_subimage(layer.part, 0)
    spec = source.spec()
    _check_size(spec, file)
    radiance = _read_channels(source, layer.part, layer.channels, file)
    full = np.asarray((radiance >= HALF_MOST).any(axis=-1)) if str(spec.format) == "half" else None
    _to_rec709(radiance, spec, file)
    unseen = _transparent(source, layer, file, radiance) if coverage else None
    radiance, unseen = _on_display_window(radiance, unseen, spec)
    orientation = stated_orientation(source)
    if unseen is not None:
        unseen = _upright(unseen[..., None], orientation)[..., 0] if unseen.any() else None
    _check_seen(unseen, file)
    clipped = _extra(source, CLIPPED, layer.part, file)
    if clipped is None and full is not None and full.any():
        clipped = _as_panorama(full, spec, orientation)
    return Panorama(
        radiance=_upright(radiance, orientation),
        name=file.stem,
        unseen=_or(unseen, _extra(source, UNSEEN, layer.part, file)),
        clipped=clipped,
        layer=layer.title if len(layers) > 1 else "",
        layers=tuple(each.title for each in layers) if len(layers) > 1 else (),
        rough=bool(stated_value(spec, ROUGH)),
    )


def _as_panorama(marks: Bools, spec: ImageSpec, orientation: int) -> Float32:
    """Marks of the data window as a share of each texel of the panorama."""
    plane, _ = _on_display_window(marks[..., None].astype(np.float32), None, spec)
    return _upright(plane, orientation)[..., 0]


def _or(unseen: Bools | None, filled: Float32 | None) -> Bools | None:
    """What is not in the file, and what its maker filled."""
    if filled is None:
        return unseen
    marks = filled > _HALF
    return marks if unseen is None else marks | unseen


def _extra(source: ImageInput, channel: str, part: int, file: Path) -> Float32 | None:
    """A channel that this program writes beside the colours, (H, 2 H); None where it is absent."""
    spec = source.spec()
    names = [str(name) for name in spec.channelnames]
    if channel not in names or (spec.width, spec.height) != _display_size(spec):
        return None
    index = names.index(channel)
    plane = _read_channels(source, part, (index,), file, 1)[..., 0]
    return np.clip(np.nan_to_num(plane, copy=False), 0.0, 1.0) if plane.any() else None


def _transparent(
    source: ImageInput, layer: Layer, file: Path, radiance: FloatImage
) -> Bools | None:
    """Mark what alpha says was not seen, (H, W); colours that alpha dims are brought back.

    OpenEXR's colours are premultiplied; those of other files as they state.
    """
    if layer.alpha is None:
        return None
    alpha = _read_channels(source, layer.part, (layer.alpha,), file, 1)[..., 0]
    if not alpha.max() > 0.0:
        return None  # A channel that nobody filled.
    unseen = ~(alpha >= _HALF)
    partial = ~unseen & (alpha < 1.0)
    if not source.spec().get_int_attribute("oiio:UnassociatedAlpha", 0) and partial.any():
        radiance[partial] /= alpha[partial][:, None]
    radiance[unseen] = 0.0
    return unseen if unseen.any() else None


def _check_seen(unseen: Bools | None, file: Path) -> None:
    """Refuse what shows too little to fill the rest from."""
    if unseen is None:
        return
    visible_share = 1.0 - float(_areas(*unseen.shape) @ unseen.sum(axis=1))
    if visible_share < _LEAST_SEEN:
        raise EnvironmentFileError(
            tr(
                "{name} shows only {share} of what is around.",
                name=file.name,
                share=percent(visible_share),
            ),
            tr("Choose a panorama that is not transparent over most of the sphere."),
        )


def _to_rec709(radiance: FloatImage, spec: ImageSpec, file: Path) -> None:
    """Bring colours of other primaries, such as ACES', to those that everything here has."""
    try:
        primaries = stated_primaries(spec)
    except ValueError:
        raise _damaged(file) from None
    if primaries:
        infinite = np.isposinf(radiance).any(axis=-1)
        to_rec709(radiance, primaries)
        radiance[infinite] = np.inf  # Where it would be infinite minus infinite.


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
    pixels = spec.width * spec.height
    pixel_count = (
        pixels if (spec.width, spec.height) == (width, height) else pixels + width * height
    )
    if width > MAX_WIDTH or pixel_count > MAX_WIDTH**2 // 2:
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
    source: ImageInput, part: int, channels: tuple[int, ...], file: Path, planes: int = 3
) -> FloatImage:
    """Read colours, or one channel so many times; in bands of rows, to hold nothing twice."""
    spec = source.spec()
    height = int(spec.height)
    values = np.empty((height, int(spec.width), planes), np.float32)
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


def _on_display_window(
    radiance: FloatImage, unseen: Bools | None, spec: ImageSpec
) -> tuple[FloatImage, Bools | None]:
    """Place a cropped data window on the panorama; what was cropped away was not seen."""
    width, height = _display_size(spec)
    if _lies_on_its_side(spec):
        return radiance, unseen
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    whole = (left, top, spec.width, spec.height) == (0, 0, width, height)
    if whole or (width, height) == (spec.width, spec.height) != (spec.full_width, spec.full_height):
        return radiance, unseen
    panorama = np.zeros((height, width, radiance.shape[2]), dtype=np.float32)
    outside = np.ones((height, width), dtype=np.bool_)
    rows = slice(max(top, 0), min(top + spec.height, height))
    columns = slice(max(left, 0), min(left + spec.width, width))
    if rows.start < rows.stop and columns.start < columns.stop:
        here = (
            slice(rows.start - top, rows.stop - top),
            slice(columns.start - left, columns.stop - left),
        )
        panorama[rows, columns] = radiance[here]
        outside[rows, columns] = False if unseen is None else unseen[here]
    return panorama, outside


def _upright(radiance: NDArray[_Kind], orientation: int) -> NDArray[_Kind]:
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
