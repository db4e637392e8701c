"""Draw manual masks from caps and boxes in degrees, and from mask pictures."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.atomic_files import os_errors_as
from app.core.base.colour import FloatImage
from app.core.base.errors import ProbeError
from app.core.base.imaging.image_input import (
    clear_error,
    is_unwieldy,
    open_image,
    read_rows,
    read_start,
    rows_at_once,
)
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput

MaskKind: TypeAlias = Literal["nadir", "zenith", "box", "picture", "suggested"]

_PICTURES: Final = (".png", ".tif", ".tiff", ".exr", ".jpg", ".jpeg")
_WIDEST: Final = 16384
_BAND_ROWS: Final = 256
_FORMS: Final = tr("Use nadir:-65, box:from,to,low,high, suggested, or a black-and-white picture.")


@dataclass(frozen=True, slots=True)
class MaskSpec:
    """The description of a mask.

    Attributes:
        numbers: Angles in degrees: the elevation of a cap, or the start and end azimuth (clockwise)
            and the lowest and highest elevation of a box.
        path: Path of a mask picture, if any.
    """

    kind: MaskKind
    numbers: tuple[float, ...] = ()
    path: Path | None = None


def parse_mask(text: str) -> MaskSpec:
    """Parse a mask option without opening a mask picture yet.

    >>> parse_mask("nadir:-65")
    MaskSpec(kind='nadir', numbers=(-65.0,), path=None)

    Args:
        text: ``nadir:-65`` or ``zenith:80`` (a cap below or above an elevation),
            ``box:-20,20,-90,-40`` (start and end azimuth, clockwise, and lowest and highest
            elevation), ``suggested``, or the name of a picture. All angles are in degrees.

    Raises:
        ProbeError: If the text is none of these, or a number is out of range.
    """
    spec_text = text.strip()
    word, colon, rest = spec_text.partition(":")
    if spec_text == "suggested":
        return MaskSpec("suggested")
    if colon and word in ("nadir", "zenith", "box"):
        numbers = _numbers(rest.split(","), spec_text)
        kind: MaskKind = "box" if word == "box" else "nadir" if word == "nadir" else "zenith"
        return _cap_or_box(kind, numbers, spec_text)
    if Path(spec_text).suffix.lower() in _PICTURES:
        return MaskSpec("picture", path=Path(spec_text))
    raise ProbeError(tr("The mask “{mask}” is not valid.", mask=spec_text), _FORMS)


def draw_mask(spec: MaskSpec, shape: tuple[int, int]) -> FloatImage:
    """Draw a mask at a panorama's size, (H, W) float32. It is 1 where light is removed.

    Raises:
        ProbeError: If a picture cannot be read, or if the kind is ``suggested``.
    """
    if spec.kind == "nadir":
        return cap_mask(spec.numbers[0], shape)
    if spec.kind == "zenith":
        return np.ascontiguousarray(cap_mask(-spec.numbers[0], shape)[::-1])
    if spec.kind == "box":
        start, stop, low, high = spec.numbers
        return box_mask(start, stop, low, high, shape)
    if spec.path is not None:
        return picture_mask(spec.path, shape)
    raise ProbeError(tr("Suggested masks need a panorama."))


def cap_mask(elevation_deg: float, shape: tuple[int, int]) -> FloatImage:
    """Return the fraction of each texel's height, (H, W), that lies below an elevation."""
    return box_mask(-180.0, 180.0, -90.0, elevation_deg, shape)


def box_mask(
    from_deg: float, to_deg: float, low_deg: float, high_deg: float, shape: tuple[int, int]
) -> FloatImage:
    """Return the fraction of each texel, (H, W) float32, in a box of azimuth and elevation.

    The box extends clockwise from the first azimuth, that is, to the right in the picture, and
    across the seam if necessary. -180 and 180 mean the full circle.
    """
    height, width = shape
    rows = _overlap((90.0 - high_deg) / 180.0 * height, (90.0 - low_deg) / 180.0 * height, height)
    span = 360.0 if to_deg - from_deg >= 360.0 else (to_deg - from_deg) % 360.0
    start = (from_deg / 360.0 + 0.5) % 1.0 * width
    twice = _overlap(start, start + span / 360.0 * width, 2 * width)
    columns = twice[:width] + twice[width:]
    return np.outer(rows, np.minimum(columns, 1.0)).astype(np.float32)


def picture_mask(path: Path, shape: tuple[int, int]) -> FloatImage:
    """Read a mask, (H, W) float32, 0 to 1, from a picture of any size. White areas are masked.

    The brightest colour channel counts, and transparency is ignored.

    Raises:
        ProbeError: If the picture is missing, damaged, wider than 16,384 pixels, or not twice as
            wide as it is high.
    """
    with contextlib.closing(_open(path)) as source:
        spec = source.spec()
        height, width = int(spec.height), int(spec.width)
        channels = min(spec.nchannels, 3 if spec.nchannels > 2 else 1)
        values = np.empty((height, width), np.float32)
        step = rows_at_once(spec, _BAND_ROWS)
        for start in range(0, height, step):
            stop = min(start + step, height)
            band = read_rows(source, (start, stop), (0, channels), "half")
            if band is None:
                clear_error(source)
                raise ProbeError(
                    tr("The mask {name} is damaged.", name=path.name), tr("Save it again.")
                )
            values[start:stop] = band.max(axis=2)
    values = np.clip(np.nan_to_num(values, copy=False, nan=0.0), 0.0, 1.0, out=values)
    larger = shape[1] > width
    method = cv2.INTER_LINEAR if larger else cv2.INTER_AREA
    small = cv2.resize(values, (shape[1], shape[0]), interpolation=method)
    return np.asarray(small, np.float32)


def check_picture_mask(path: Path) -> None:
    """Check the header of a mask picture early, raising the same errors as `picture_mask`."""
    _open(path).close()


def _open(path: Path) -> ImageInput:
    sentence = tr("The mask {name} cannot be read: {reason}.")
    with os_errors_as(ProbeError, sentence, _FORMS, name=path.name):
        try:
            read_start(path, 1)
        except FileNotFoundError:
            raise ProbeError(tr("The mask {name} was not found.", name=path.name), _FORMS) from None
    source = open_image(path)
    if source is None:
        raise ProbeError(
            tr("The mask {name} is not a readable picture.", name=path.name),
            tr("Save it as a PNG, white where the panorama should be filled."),
        )
    spec = source.spec()
    if spec.deep or spec.width != 2 * spec.height or not 2 <= spec.width <= _WIDEST:
        source.close()
        raise ProbeError(
            tr(
                "The mask {name} is {width} x {height} pixels.",
                name=path.name,
                width=spec.width,
                height=spec.height,
            ),
            tr(
                "It must be twice as wide as it is high, and at most {widest} wide.", widest=_WIDEST
            ),
        )
    if is_unwieldy(spec):
        source.close()
        raise ProbeError(
            tr(
                "The mask {name} is stored in blocks or channels that are too large to read.",
                name=path.name,
            ),
            tr("Save it as a PNG."),
        )
    return source


def _cap_or_box(kind: MaskKind, numbers: tuple[float, ...], spec_text: str) -> MaskSpec:
    count = 4 if kind == "box" else 1
    if len(numbers) != count:
        raise ProbeError(
            tr(
                "The mask “{mask}” needs {count} numbers after the colon.",
                mask=spec_text,
                count=count,
            ),
            _FORMS,
        )
    _check_elevations(numbers[2:] if kind == "box" else numbers, spec_text)
    if kind == "box" and numbers[2] >= numbers[3]:
        raise ProbeError(
            tr("The top of the mask “{mask}” is not above its bottom.", mask=spec_text), _FORMS
        )
    return MaskSpec(kind, numbers)


def _check_elevations(values: Sequence[float], spec_text: str) -> None:
    if any(abs(value) > 90.0 for value in values):
        raise ProbeError(
            tr("The mask “{mask}” has an elevation outside -90 to 90 degrees.", mask=spec_text)
        )


def _numbers(words: Sequence[str], spec_text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(word.replace("−", "-")) for word in words)
    except ValueError:
        raise ProbeError(tr("The mask “{mask}” is not valid.", mask=spec_text), _FORMS) from None
    if not all(abs(value) <= 360.0 for value in numbers):
        raise ProbeError(
            tr("The mask “{mask}” has an angle outside -360 to 360 degrees.", mask=spec_text)
        )
    return numbers


def _overlap(start: float, stop: float, count: int) -> FloatImage:
    """Return the fraction of each unit cell from 0 to `count` that lies between two positions."""
    edges = np.arange(count)
    shared = np.minimum(edges + 1.0, stop) - np.maximum(edges, start)
    return np.asarray(np.clip(shared, 0.0, 1.0), np.float32)
