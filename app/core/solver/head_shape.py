"""The shape of a head: the skin position behind each pixel, outlines, and distances to the skin.

A transport contains only directions. Anything near the head, above all a second light, requires the
positions on the head behind the pixels. Positions are given in metres from the centre of the head,
which is midway between the ears, where the probe was. +Y points up, +Z points out of the face, and
+X points to the sitter's left.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import read_sealed, write_sealed
from app.core.base.arrays import Float32, Floats
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.solver.transport import Transport
from app.core.text import tr

SHAPE_VERSION: Final = 1
_ENDING: Final = ".shape.npz"
_AGAIN: Final = tr("Reinstall Turnlight, or bake the head again with 'turnlight bake'.")
_MOST_BYTES: Final = 1 << 24
_LARGEST_M: Final = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class HeadShape:
    """Positions on a head's skin, in metres from the centre of the head.

    Attributes:
        pixels: (P,) int32. The pixels of the transport.
        positions: (P, 3) float32. Mean position on the head behind each pixel.
        skin: (M, 3) float32. Points spread over all the skin, about 6 mm apart.
        above: (N, 2) float32. Closed outline as seen from above: x towards the sitter's left, z
            towards the front.
        side: (K, 2) float32. Closed outline as seen from the sitter's left: z towards the front, y
            up.
        eye_point: (3,) float32. Point midway between the eyes.
    """

    head: str
    pixels: NDArray[np.int32] = field(repr=False)
    positions: Float32 = field(repr=False)
    skin: Float32 = field(repr=False)
    above: Float32 = field(repr=False)
    side: Float32 = field(repr=False)
    eye_point: Float32 = field(repr=False)

    def distance_to_skin(self, place: Floats) -> float:
        """Return the distance from a point to the skin, in metres.

        Args:
            place: (3,) float. The point, in metres from the centre of the head. It may be inside
                the head.
        """
        away = self.skin - np.asarray(place, np.float32)
        return float(np.sqrt(np.square(away).sum(axis=1).min()))


def shape_path(transport: Path) -> Path:
    """Return the path of the shape file that belongs to a transport file.

    Examples:
        >>> shape_path(Path("heads/anna.npz")).name
        'anna.shape.npz'
    """
    name = transport.name.removesuffix(".npz").removesuffix(".styles")
    return transport.with_name(name + _ENDING)


def save_shape(path: Path, shape: HeadShape) -> str:
    """Save a shape atomically and return the SHA-256 of the file."""
    arrays: dict[str, NDArray[Any]] = {
        name: np.ascontiguousarray(getattr(shape, name), kind) for name, kind in _KINDS
    }
    header = {"format_version": SHAPE_VERSION, "head": shape.head}
    return write_sealed(path, arrays, header, packing=zipfile.ZIP_STORED)


def load_shape(path: Path) -> HeadShape:
    """Load a head's shape.

    Raises:
        TransportError: If the file is missing, damaged, made by a newer version, or not a
            head-shape file.
    """
    names = [name for name, _ in _KINDS]
    header, arrays = read_sealed(
        path, tr("head-shape file"), _AGAIN, SHAPE_VERSION, names=names, most=_MOST_BYTES
    )
    if "head" not in header:
        raise TransportError(tr("{name} is not a head-shape file.", name=path.name), _AGAIN)
    if not _fits(arrays):
        raise TransportError(tr("{name} is inconsistent.", name=path.name), _AGAIN)
    return HeadShape(head=str(header["head"]), **arrays)


def load_shape_of(transport: Transport, name: str) -> HeadShape:
    """Load the shape of a transport's head.

    Raises:
        TransportError: If the file is missing, cannot be read, or was made for a different head.
    """
    if name.endswith(".npz"):
        path = shape_path(Path(name))
    else:
        path = resources() / "transport" / f"{transport.header.head}{_ENDING}"
    shape = load_shape(path)
    if not np.array_equal(shape.pixels, transport.pixels):
        raise TransportError(tr("{name} was made for a different head.", name=path.name), _AGAIN)
    return shape


_KINDS: Final = (
    ("pixels", np.int32),
    ("positions", np.float32),
    ("skin", np.float32),
    ("above", np.float32),
    ("side", np.float32),
    ("eye_point", np.float32),
)


def _fits(arrays: Mapping[str, NDArray[Any]]) -> bool:
    """Return whether the arrays have valid types, shapes and sizes for a head."""
    fits = all(arrays[name].dtype == kind for name, kind in _KINDS)
    places = [arrays[name] for name, _ in _KINDS[1:]]
    fits = fits and arrays["pixels"].ndim == 1
    fits = fits and arrays["positions"].shape == (len(arrays["pixels"]), 3)
    fits = fits and arrays["eye_point"].shape == (3,)
    fits = fits and all(
        a.ndim == 2 and a.shape[1] == size and len(a) >= 3
        for a, size in zip(places[1:4], (3, 2, 2), strict=True)
    )
    # A comparison with NaN is false.
    return fits and all(bool((np.abs(a) < _LARGEST_M).all()) for a in places)
