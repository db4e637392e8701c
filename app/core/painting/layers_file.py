"""Painted weights as OpenEXR: two channels, ``weights`` and ``ignore``, 32-bit, square."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import StyleError
from app.core.base.image_input import clear_error, open_image, read_start
from app.core.base.images import write_image
from app.core.painting.canvas import MAX_SIZE, MIN_SIZE

if TYPE_CHECKING:
    from pathlib import Path

    from OpenImageIO import ImageInput

Float32: TypeAlias = NDArray[np.float32]

MAX_BYTES: Final = 12_000_000
"""Largest file that is read; the largest canvas takes 8.4 MB unpacked."""

_CHANNELS: Final = ("weights", "ignore")
_EXR: Final = b"\x76\x2f\x31\x01"


def write_layers(path: Path, weights: Float32, ignore: Float32) -> None:
    """Write painted weights, without loss.

    Parameters
    ----------
    weights, ignore : (S, S) float32
        Canvas layers.

    Raises
    ------
    CoreError
        When the file cannot be written.
    """
    pixels = np.ascontiguousarray(np.stack([weights, ignore], axis=-1), np.float32)
    write_image(path, pixels, "float", {"compression": "zip"}, _CHANNELS)


def read_layers(path: Path) -> tuple[Float32, Float32]:
    """Read painted weights from a file that may be anything.

    Returns
    -------
    weights : (S, S) float32
        In [-1, 1].
    ignore : (S, S) float32
        In [0, 1]. Neither can be written to.

    Raises
    ------
    StyleError
        If it is missing, too large, damaged, or does not hold painted weights.
    """
    _check_file(path)
    source = open_image(path)
    if source is None:
        raise _damaged(path)
    try:
        layers = _layers(source, path)
    except (UnicodeError, MemoryError):
        raise _damaged(path) from None
    finally:
        source.close()
    return layers


def _check_file(path: Path) -> None:
    """Judge the file by its size and first bytes, before any decoder sees it."""
    try:
        if not path.is_file():
            raise StyleError(f"The weights {path.name} are missing.")
        if path.stat().st_size > MAX_BYTES:
            raise StyleError(f"{path.name} is too large for painted weights.")
        head = read_start(path, len(_EXR))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise StyleError(f"{path.name} cannot be read: {reason.lower()}.") from None
    if head != _EXR:
        raise _damaged(path)


def _layers(source: ImageInput, path: Path) -> tuple[Float32, Float32]:
    spec = source.spec()
    names = [str(name) for name in spec.channelnames]
    square = spec.width == spec.height and MIN_SIZE <= spec.width <= MAX_SIZE
    if sorted(names) != sorted(_CHANNELS) or not square or spec.deep or spec.depth != 1:
        raise StyleError(f"{path.name} does not hold painted weights.")
    size = int(spec.width)
    pixels = source.read_image(0, 0, 0, len(_CHANNELS), "float")
    if pixels is None:
        clear_error(source)
        raise _damaged(path)
    values = np.asarray(pixels, np.float32).reshape(size, size, len(_CHANNELS))
    weights, ignore = (np.ascontiguousarray(values[:, :, names.index(n)]) for n in _CHANNELS)
    if not (_within(weights, -1.0) and _within(ignore, 0.0)):
        raise StyleError(f"{path.name} holds numbers that are no painted weights.")
    weights.setflags(write=False)
    ignore.setflags(write=False)
    return weights, ignore


def _within(layer: Float32, low: float) -> bool:
    return bool(np.isfinite(layer).all() and layer.min() >= low and layer.max() <= 1.0)


def _damaged(path: Path) -> StyleError:
    return StyleError(f"{path.name} is damaged or incomplete.")
