"""Views of a turned head.

Yaw is the turn of the face from the camera towards the sitter's own left. The light on the skin
does not depend on the camera, so all views of a head are transports over the same texel functions,
in light at the turn of the *nose*. Views of a symmetrical head are baked on one side only. The
views from the other side are their mirror images.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.archive import CONTRADICTIONS, read_sealed, write_sealed
from app.core.base.arrays import Float32, Indices
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.solver.head_shape import HeadShape, load_shape, shape_path
from app.core.solver.transport import (
    Transport,
    TransportHeader,
    parity_of,
    parse_transport_header,
)
from app.core.styles.lamps import mirror_rows
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack
from app.core.text import tr

YAWS: Final = (15.0, 30.0, 45.0)
"""Yaws at which views are baked, in degrees."""
MOST_YAW_DEG: Final = YAWS[-1]

VIEWS_VERSION: Final = 1
_ENDING: Final = ".views.npz"
_AGAIN: Final = tr("Reinstall Turnlight, or bake the head again with 'turnlight bake'.")
_MOST_BYTES: Final = 1 << 27
_STEP: Final = 0.009  # of the typical size of a pixel's coefficients
_BLOCK: Final = 5  # pixels, side of the squares that are stored as cosines
_ROUNDED_UP: Final = 0.42  # added before rounding down: less than a half, since zeros take no space
_TEXEL_STEPS: Final = 500
_TARGET_STEPS: Final = 127
_PLACE_M: Final = 2e-4  # step of stored positions, in metres


@dataclass(frozen=True, slots=True, eq=False)
class HeadView:
    """A view of a turned head.

    Attributes:
        transport: Transport of the view, for light at the turn of the nose.
        shape: Skin positions behind the view's pixels.
        targets: (S, P) float32. Luminance of the styles under their own lamps, scaled to a maximum
            of 1.
    """

    yaw_deg: float
    transport: Transport = field(repr=False)
    shape: HeadShape = field(repr=False)
    targets: Float32 = field(repr=False)

    def mirrored(self, styles: Sequence[Style]) -> HeadView:
        """Return the mirror image of a view of a symmetrical head."""
        here, size = self.transport, self.transport.size
        flipped = here.pixels // size * size + size - 1 - here.pixels % size
        order = np.argsort(flipped)
        parity = parity_of(here)
        if parity is None:
            raise ValueError("this head is not symmetric")
        there = replace(
            here,
            pixels=flipped[order],
            coverage=here.coverage[order],
            pixel_basis=here.pixel_basis[:, order] * parity.astype(np.float32),
        )
        places = self.shape.positions[order] * np.array([-1, 1, 1], np.float32)
        shape = replace(self.shape, pixels=there.pixels, positions=places)
        return HeadView(-self.yaw_deg, there, shape, self.targets[mirror_rows(styles)][:, order])


@dataclass(frozen=True, slots=True, eq=False)
class HeadViews:
    """All views of a head, stored in packed form and unpacked on demand.

    Attributes:
        shape: Shape of the head, as seen from the front.
        texel_basis: (R, H * W) float32. As in a transport.
        parts: Arrays as returned by `pack_view`, keyed by yaw in degrees.
    """

    header: TransportHeader
    shape: HeadShape = field(repr=False)
    texel_basis: Float32 = field(repr=False)
    parts: Mapping[float, Mapping[str, NDArray[Any]]] = field(repr=False)

    @property
    def yaws(self) -> tuple[float, ...]:
        """The yaws of all views, in degrees, from right to left, including 0."""
        both = {*self.parts, 0.0}
        if self.header.symmetric:
            both |= {-yaw for yaw in self.parts}
        return tuple(sorted(both))

    def nearest(self, yaw_deg: float) -> float:
        """Return the nearest baked yaw, in degrees."""
        return min(self.yaws, key=lambda yaw: (abs(wrap(yaw - yaw_deg)), abs(yaw)))

    def at(self, yaw_deg: float, styles: Sequence[Style]) -> HeadView:
        """Return the view at one of `yaws` other than 0.

        Args:
            styles: Styles in the head's pack, in the order of the pack.
        """
        if yaw_deg in self.parts:
            return self._view(yaw_deg, **self.parts[yaw_deg])
        return self._view(-yaw_deg, **self.parts[-yaw_deg]).mirrored(styles)

    def _view(self, yaw_deg: float, **parts: NDArray[Any]) -> HeadView:
        step = np.float32(parts["step"])
        pixels, size = parts["pixels"], self.header.picture
        grey = _from_cosines(parts["grey"], pixels, size) * step
        weights = np.asarray(self.header.luminance_weights, np.float32)
        basis = np.tile(grey, (3, 1, 1))
        tints = _from_cosines(parts["tints"], pixels, size) * step
        some = tints.shape[2]
        basis[0, :, :some] += tints[0]
        basis[1, :, :some] -= (weights[0] * tints[0] + weights[2] * tints[1]) / weights[1]
        basis[2, :, :some] += tints[1]
        turned = Transport(
            header=replace(self.header, symmetric=False, rank=len(self.texel_basis)),
            pixels=parts["pixels"],
            coverage=parts["coverage"].astype(np.float32) / np.float32(255),
            pixel_basis=basis,
            texel_basis=self.texel_basis,
        )
        places = parts["positions"].astype(np.float32) * np.float32(_PLACE_M)
        shape = replace(self.shape, pixels=turned.pixels, positions=places)
        targets = np.square(parts["targets"].astype(np.float32) / np.float32(_TARGET_STEPS))
        return HeadView(yaw_deg, turned, shape, targets)


def pack_view(
    grey: Float32,
    tints: Float32,
    pixels: NDArray[np.int32],
    coverage: Float32,
    positions: Float32,
    targets: Float32,
    size: int,
) -> dict[str, NDArray[Any]]:
    """Quantise a view for storage.

    Apart from noise, coefficients vary smoothly over the picture. Squares of the picture are
    therefore stored as rounded cosine coefficients, which take half as much space as pixels for the
    same error.

    Args:
        grey: (P, R) float32. Luminance of each pixel for each texel function.
        tints: (2, P, K) float32. Red and blue minus that luminance, for the first K of these
            functions.
        pixels: (P,) int32. Flat pixel indices.
        coverage: (P,) float32. Fraction of each pixel that the head covers.
        positions: (P, 3) float32. As in `HeadShape`.
        targets: (S, P) float32. Luminance, at any scale.
        size: Side of the picture, in pixels.
    """
    step = np.float32(_STEP * np.sqrt(np.square(grey).sum(axis=1).mean()))
    targets = np.maximum(targets, 0) / targets.max(axis=1, keepdims=True)
    return {
        "pixels": pixels.astype(np.int32),
        "coverage": np.round(255 * coverage).astype(np.uint8),
        "positions": np.round(positions / _PLACE_M).astype(np.int16),
        "step": np.asarray(step),
        "grey": _to_cosines(grey / step, pixels, size),
        "tints": _to_cosines(tints / step, pixels, size),
        "targets": np.round(_TARGET_STEPS * np.sqrt(targets)).astype(np.uint8),
    }


def _to_cosines(values: Float32, pixels: NDArray[np.int32], size: int) -> NDArray[np.int16]:
    """Return the integer coefficients, (..., 25, B, n), of squares of values, (..., P, n)."""
    square, _ = _squares_of(pixels, size)
    # Beyond the outline the nearest pixel is repeated, so that there is no edge.
    side = -(-size // _BLOCK) * _BLOCK
    beyond = np.ones((side, side), np.uint8)
    beyond[pixels // size, pixels % size] = 0
    label = cv2.distanceTransformWithLabels(
        beyond, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )[1]
    own = np.zeros(int(label.max()) + 1, np.intp)
    own[label[pixels // size, pixels % size]] = np.arange(len(pixels))
    corner = np.zeros((2, int(square.max()) + 1), np.intp)
    corner[:, square] = pixels // size // _BLOCK * _BLOCK, pixels % size // _BLOCK * _BLOCK
    down, right = (each.reshape(-1, 1) for each in np.mgrid[:_BLOCK, :_BLOCK])
    nearest = own[label[corner[0] + down, corner[1] + right]]
    result = np.moveaxis(np.tensordot(_COSINES, values[..., nearest, :], (1, -3)), 0, -3)
    return np.asarray(np.copysign(np.floor(np.abs(result) + _ROUNDED_UP), result), np.int16)


def _from_cosines(values: NDArray[np.int16], pixels: NDArray[np.int32], size: int) -> Float32:
    """Invert `_to_cosines`."""
    square, place = _squares_of(pixels, size)
    whole = np.tensordot(_COSINES, values.astype(np.float32), (0, -3))
    return np.ascontiguousarray(np.moveaxis(whole, 0, -3)[..., place, square, :])


def _squares_of(pixels: NDArray[np.int32], size: int) -> tuple[Indices, Indices]:
    """Return the number of each pixel's square, row by row, and the pixel's position within it."""
    (rows, down), (columns, right) = (np.divmod(each, _BLOCK) for each in np.divmod(pixels, size))
    square = np.unique(rows * (size // _BLOCK + 1) + columns, return_inverse=True)[1]
    return square, down * _BLOCK + right


def _cosines() -> Float32:
    """Return the orthonormal discrete cosine transform of a square, (25, 25).

    Rows are waves and columns are positions.
    """
    order, place = np.mgrid[:_BLOCK, :_BLOCK]
    waves = np.cos(np.pi * (place + 0.5) * order / _BLOCK) * np.sqrt(2 / _BLOCK)
    waves[0] *= np.sqrt(0.5)
    return np.asarray(np.kron(waves, waves), np.float32)


_COSINES: Final = _cosines()


def views_path(transport: Path) -> Path:
    """Return the path of the view file that belongs to a transport file."""
    name = transport.name.removesuffix(".npz").removesuffix(".styles")
    return transport.with_name(name + _ENDING)


def save_views(
    path: Path,
    front: Transport,
    texel_basis: Float32,
    parts: Mapping[float, Mapping[str, NDArray[Any]]],
) -> str:
    """Save the views of a head atomically and return the SHA-256 of the file.

    Args:
        front: The head's own transport.
        texel_basis: (R, H * W) float32. The texel functions, each even or odd.
        parts: Views as returned by `pack_view`, keyed by yaw in degrees.
    """
    largest = np.abs(texel_basis).max(axis=1)
    rows = np.round(texel_basis * (_TEXEL_STEPS / largest)[:, None]).astype(np.int16)
    height, width = front.environment_shape
    grid = rows.reshape(-1, height, width)
    even = (grid[:, :, : width // 2] == grid[:, :, : width // 2 - 1 : -1]).all(axis=(1, 2))
    arrays: dict[str, NDArray[Any]] = {
        "largest": largest.astype(np.float32),
        "even": even,
        "functions": np.ascontiguousarray(grid[:, :, : width // 2].reshape(len(rows), -1)),
    }
    for number, part in enumerate(parts.values()):
        arrays |= {f"{name}_{number}": values for name, values in part.items()}
    header = {
        **asdict(front.header),
        "format_version": VIEWS_VERSION,
        "yaws": list(parts),
        "transport_sha256": front.digest,
    }
    return write_sealed(path, arrays, header, packing=zipfile.ZIP_LZMA, store=_store)


def load_views(path: Path, digest: str, shape: HeadShape) -> HeadViews:
    """Load the views of a head.

    Args:
        digest, shape: Digest and shape of the transport of the same head.

    Raises:
        TransportError: If the file is missing, damaged, made by a newer version, or made for a
            different head.
    """
    facts, arrays = read_sealed(
        path, tr("head-view file"), _AGAIN, VIEWS_VERSION, most=_MOST_BYTES, restore=_restore
    )
    if facts.get("transport_sha256") != digest:
        raise TransportError(tr("{name} was made for a different head.", name=path.name), _AGAIN)
    try:
        parts = {float(yaw): _part(arrays, number) for number, yaw in enumerate(facts["yaws"])}
        header = parse_transport_header(facts)
        height, width = header.environment
        half = arrays["functions"].astype(np.float32).reshape(-1, height, width // 2)
        sign = np.where(arrays["even"], 1, -1).astype(np.float32)[:, None, None]
        whole = np.concatenate([half, half[:, :, ::-1] * sign], axis=2)
        whole *= (arrays["largest"] / np.float32(_TEXEL_STEPS))[:, None, None]
        views = HeadViews(header, shape, whole.reshape(len(whole), -1), parts)
        if not all(_fits(views, *each) for each in parts.items()):
            raise ValueError("sizes")
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} is inconsistent.", name=path.name), _AGAIN) from error
    return views


def has_views(name: str) -> bool:
    """Return whether a shipped head, or the head of a transport file, has a file with views."""
    return views_path(_beside(name)).is_file()


def _beside(name: str) -> Path:
    return Path(name) if name.endswith(".npz") else resources() / "transport" / name


def load_views_of(pack: StylePack, name: str) -> HeadViews:
    """Load the views of a shipped head by name, or those beside a transport (see `load_views`)."""
    shape = _beside(name if name.endswith(".npz") else pack.header.head)
    digest = pack.header.transport_sha256
    return load_views(views_path(_beside(name)), digest, load_shape(shape_path(shape)))


def _part(arrays: Mapping[str, NDArray[Any]], number: int) -> dict[str, NDArray[Any]]:
    end = f"_{number}"
    return {name.removesuffix(end): each for name, each in arrays.items() if name.endswith(end)}


def _fits(views: HeadViews, yaw_deg: float, parts: Mapping[str, NDArray[Any]]) -> bool:
    pixels, side, rank = parts["pixels"], views.header.picture, len(views.texel_basis)
    return (
        0 < abs(yaw_deg) <= MOST_YAW_DEG
        and pixels.ndim == 1
        and 0 < len(pixels) <= side**2
        and 0 <= int(pixels.min()) <= int(pixels.max()) < side**2
        and parts["positions"].shape == (len(pixels), 3)
        and parts["coverage"].shape == (len(pixels),)
        and parts["grey"].shape == (_BLOCK**2, int(_squares_of(pixels, side)[0].max()) + 1, rank)
        and parts["tints"].shape[:3] == (2, *parts["grey"].shape[:2])
        and 0 < parts["tints"].shape[3] <= rank
        and parts["targets"].shape[1:] == (len(pixels),)
        and bool(np.isfinite(parts["step"]) and np.isfinite(views.texel_basis).all())
    )


_STEP_KEYS: Final = ("targets", "positions", "pixels", "functions")
_IN_TWO_BYTES: Final = ("grey", "tints", "positions", "functions")


def _store(arrays: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Store differences between neighbours, placing bytes of equal significance side by side."""
    contents = dict(arrays)
    for name, values in arrays.items():
        if name.startswith(_STEP_KEYS):
            axis = 0 if name.startswith("positions") else -1
            values = np.diff(values, axis=axis, prepend=values.dtype.type(0))
        if values.dtype == np.int16:  # small signed numbers, in two bytes
            folded = ((values << 1) ^ (values >> 15)).view(np.uint16)
            values = np.stack([folded & 255, folded >> 8]).astype(np.uint8)
        contents[name] = values
    return contents


def _restore(_facts: dict[str, Any], contents: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Invert `_store`."""
    arrays = dict(contents)
    for name, values in contents.items():
        if name.startswith(_IN_TWO_BYTES):
            low, high = values.astype(np.uint16)
            bits = low | high << 8
            values = ((bits >> 1) ^ (0 - (bits & 1))).view(np.int16)
        if name.startswith(_STEP_KEYS):
            axis = 0 if name.startswith("positions") else -1
            values = np.cumsum(values, axis=axis, dtype=values.dtype)
        arrays[name] = values
    return arrays
