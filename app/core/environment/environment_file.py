"""Read linear panoramas with OpenImageIO.

Files may come from anywhere. Every bad file therefore raises an `EnvironmentFileError` with one
sentence and a hint, and the header is checked before anything large is allocated.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32
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
from app.core.environment.repair import BAND_ROWS, HALF_MOST, row_areas
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

_Kind = TypeVar("_Kind", bound=np.generic)

MAX_WIDTH: Final = 16384
"""Maximum width of a panorama, in texels. A panorama this wide takes 1.6 GB as float32.

More texels would add nothing to the light.
"""

MIN_WIDTH: Final = 16
"""Minimum width of a panorama, in texels, at which each texel is 22.5 degrees wide."""
_LEAST_SEEN: Final = 0.1  # minimum visible fraction of the sphere
_HALF: Final = 0.5  # visible fraction of a texel below which it counts as unseen
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
class Panorama:
    """A panorama as stored, before it is repaired (`app.core.environment.repair`).

    Attributes:
        radiance: Float32, (H, 2 H, 3). Linear Rec. 709 radiance. A single grey channel is repeated
            in all three channels, and gaps are 0.
        unseen: (H, 2 H) bool. Gaps, which are texels that are transparent or outside the data
            window, or None if there are no gaps.
        clipped: (H, 2 H) float32. Fraction of each texel that was clipped, as stated in the file,
            or None if nothing was clipped.
        layer, layers: The layer that was read, and the names of all layers. Both are empty if the
            file has only one layer.
        rough: Whether the file states that much of the light is estimated.
    """

    radiance: FloatImage = field(repr=False)
    name: str
    unseen: Bools | None = field(default=None, repr=False)
    clipped: Float32 | None = field(default=None, repr=False)
    layer: str = ""
    layers: tuple[str, ...] = ()
    rough: bool = False


def read_panorama(path: Path | str, layer: str = "", *, coverage: bool = True) -> Panorama:
    """Read the colours of a linear panorama in OpenEXR, Radiance or floating-point TIFF format.

    Args:
        layer: Name of the layer to read, or "" for the default layer (see `choose_layer`).
        coverage: Whether alpha marks gaps. If it does not, the colours are returned as stored.

    Raises:
        LayerError: If there is no such layer, or if the file has several layers and no default.
        EnvironmentFileError: If the file cannot be read or is not a panorama.
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
            tr("{name} is too large for this computer’s memory.", name=file.name),
            tr("Scale it down to 4096 x 2048 pixels."),
        ) from None
    except UnicodeError:
        # The header contains damaged channel names.
        raise _damaged(file) from None
    finally:
        source.close()


def is_linear(path: Path) -> bool:
    """Return whether a file contains linear light as OpenEXR, Radiance or floating-point TIFF."""
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


def _damaged(file: Path) -> EnvironmentFileError:
    return EnvironmentFileError(tr("{name} is damaged or incomplete.", name=file.name), COPY_AGAIN)


def _check_signature(file: Path) -> None:
    """Check the first bytes of a file before any decoder reads it."""
    head = first_bytes(
        file,
        EnvironmentFileError,
        tr("{file} is a folder, not a panorama.", file=file),
        tr("Choose an .exr or .hdr file."),
    )
    if head.startswith((_EXR, b"#?")) or is_linear(file):
        return
    for magic, kind in _OTHER_IMAGES:
        if head.startswith(magic):
            raise EnvironmentFileError(
                tr(
                    "{name} is a {kind} image, which cannot hold the full range of "
                    "light. Turnlight needs an HDR panorama.",
                    name=file.name,
                    kind=kind,
                ),
                tr(
                    "Merge a bracket of exposures first, or merge this picture alone for "
                    "a rough result."
                ),
            )
    raise EnvironmentFileError(tr("{name} is not an HDR panorama.", name=file.name), _SAVE_AS)


def _read_layer(source: ImageInput, file: Path, layer_name: str, coverage: bool) -> Panorama:
    """Find the layer, check its size and read it."""
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
    """Convert marks in the data window to the marked fraction of each texel in the panorama."""
    plane, _ = _on_display_window(marks[..., None].astype(np.float32), None, spec)
    return _upright(plane, orientation)[..., 0]


def _or(unseen: Bools | None, filled: Float32 | None) -> Bools | None:
    """Combine the gaps in the file with those that were filled before the file was saved."""
    if filled is None:
        return unseen
    marks = filled > _HALF
    return marks if unseen is None else marks | unseen


def _extra(source: ImageInput, channel: str, part: int, file: Path) -> Float32 | None:
    """Read one of this program's extra channels, (H, 2 H), or return None if it is absent."""
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
    """Return the gaps in alpha, (H, W), and undo the premultiplication of `radiance` in place.

    Colours in OpenEXR files are premultiplied. Other files state whether their colours are.
    """
    if layer.alpha is None:
        return None
    alpha = _read_channels(source, layer.part, (layer.alpha,), file, 1)[..., 0]
    if not alpha.max() > 0.0:
        return None  # The alpha channel was never filled in.
    unseen = ~(alpha >= _HALF)
    partial = ~unseen & (alpha < 1.0)
    if not source.spec().get_int_attribute("oiio:UnassociatedAlpha", 0) and partial.any():
        radiance[partial] /= alpha[partial][:, None]
    radiance[unseen] = 0.0
    return unseen if unseen.any() else None


def _check_seen(unseen: Bools | None, file: Path) -> None:
    """Reject a panorama that shows too little of the sphere to fill its gaps."""
    if unseen is None:
        return
    visible_share = 1.0 - float(row_areas(*unseen.shape) @ unseen.sum(axis=1))
    if visible_share < _LEAST_SEEN:
        raise EnvironmentFileError(
            tr(
                "{name} covers only {share} of the sphere.",
                name=file.name,
                share=percent(visible_share),
            ),
            tr("Choose a panorama without large transparent areas."),
        )


def _to_rec709(radiance: FloatImage, spec: ImageSpec, file: Path) -> None:
    """Convert colours with other primaries, such as those of ACES, to Rec. 709."""
    try:
        primaries = stated_primaries(spec)
    except ValueError:
        raise _damaged(file) from None
    if primaries:
        infinite = np.isposinf(radiance).any(axis=-1)
        to_rec709(radiance, primaries)
        radiance[infinite] = np.inf  # The conversion gave infinity minus infinity.


def _check_size(spec: ImageSpec, file: Path) -> None:
    width, height = _display_size(spec)
    size = f"{width} x {height}"
    if width != 2 * height:
        raise EnvironmentFileError(
            tr(
                "{name} is {size}, but a full panorama is twice as wide as it is high.",
                name=file.name,
                size=size,
            ),
            tr("Export it as a 360 x 180 degree equirectangular (lat-long) image."),
        )
    # A cropped picture needs memory in addition to that of the whole panorama.
    pixels = spec.width * spec.height
    pixel_count = (
        pixels if (spec.width, spec.height) == (width, height) else pixels + width * height
    )
    if width > MAX_WIDTH or pixel_count > MAX_WIDTH**2 // 2:
        raise EnvironmentFileError(
            tr(
                "{name} is {size}. The largest supported size is {max_width} x {max_width}.",
                name=file.name,
                size=size,
                max_width=MAX_WIDTH,
            ),
            tr("Scale it down; 2048 x 1024 is enough."),
        )
    if is_unwieldy(spec):
        raise EnvironmentFileError(
            tr(
                "{name} is stored in blocks or channels that are too large to read.", name=file.name
            ),
            tr("Export it in rows, with only red, green and blue."),
        )
    if width < MIN_WIDTH:
        raise EnvironmentFileError(
            tr(
                "{name} is only {size}: too small to show where the light comes from.",
                name=file.name,
                size=size,
            ),
            tr(
                "Use at least {min_width} x {min_width}; 1024 x 512 is better.", min_width=MIN_WIDTH
            ),
        )


def _lies_on_its_side(spec: ImageSpec) -> bool:
    """Return whether rows in the file are columns of the picture (EXIF orientations 5 to 8)."""
    return 5 <= spec.get_int_attribute("Orientation", 1) <= 8


def _display_size(spec: ImageSpec) -> tuple[int, int]:
    """Return the width and height of the whole picture, before any cropping."""
    if _lies_on_its_side(spec):
        return int(spec.height), int(spec.width)
    if spec.full_width == 2 * spec.full_height:
        return int(spec.full_width), int(spec.full_height)
    return int(spec.width), int(spec.height)


def _read_channels(
    source: ImageInput, part: int, channels: tuple[int, ...], file: Path, planes: int = 3
) -> FloatImage:
    """Read three channels, or repeat one in all `planes`, using bands of rows to save memory."""
    spec = source.spec()
    height = int(spec.height)
    values = np.empty((height, int(spec.width), planes), np.float32)
    first = channels[0]
    # Adjacent channels, as in most files, are read in one pass.
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
    """Place a cropped data window in the panorama, leaving gaps where parts were cropped off."""
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
    """Undo the orientation that a header states (EXIF 2.32), mirroring in place."""
    if orientation > 4:
        return upright(radiance, orientation)
    height = len(radiance)
    if orientation in (2, 3):
        for row in range(0, height, BAND_ROWS):
            radiance[row : row + BAND_ROWS] = radiance[row : row + BAND_ROWS, ::-1].copy()
    if orientation in (3, 4):
        for row in range(height // 2):
            radiance[[row, -1 - row]] = radiance[[-1 - row, row]]
    return radiance
