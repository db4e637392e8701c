"""The light transport T of a head, in low-rank form.

T maps an environment to a picture of the head (eq. 1 of the paper, B = T L). Its 2,048 columns are
so similar that a few hundred basis pictures represent them all. In this form, T is small enough to
ship, loads in milliseconds and multiplies faster than the full matrix.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import CONTRADICTIONS, read_sealed, write_sealed
from app.core.base.arrays import Bools, Float32, Float64, Floats, Indices
from app.core.base.colour import LUMINANCE_WEIGHTS
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.text import tr

FORMAT_VERSION = 2  # 1: both halves of a head in full
FACE_COVERAGE = 0.5
_MAX_PICTURE = 1024
_MAX_TEXELS = 512 * 256
_MAX_RANK = 4096
_MAX_BYTES = 1 << 30
_PURE = 1e-4
_EVEN, _ODD = np.uint16(0), np.uint16(1 << 15)  # XOR masks for the sign of a half float


@dataclass(frozen=True, slots=True)
class TransportHeader:
    """The origin and accuracy of a transport.

    Attributes:
        environment: Number of rows and columns of the environment, (H, W), where W = 2 H.
        picture: Side of the square picture, N, in pixels.
        luminance_weights: Weights that convert linear RGB to luminance.
        noise, truncation: Relative errors due to sampling and to the low rank.
    """

    head: str
    skin: str
    environment: tuple[int, int]
    picture: int
    rank: int
    fov_deg: float
    distance_m: float
    luminance_weights: tuple[float, float, float] = LUMINANCE_WEIGHTS
    paths_per_pixel: int = 0
    seed: int = 0
    noise: float = float("nan")
    truncation: float = float("nan")
    symmetric: bool = True
    format_version: int = FORMAT_VERSION


@dataclass(frozen=True)
class Transport:
    """The low-rank light transport of one head, T_c = pixel_basis[c] @ texel_basis.

    Attributes:
        pixels: (P,) int32. Flat row-major indices, into the N x N picture, of the pixels that the
            head covers.
        coverage: (P,) float32. Fraction of each pixel's area that the head covers, in (0, 1].
        pixel_basis: (3, P, R) float32. Pixel basis of the linear Rec. 709 RGB channels. Its product
            with `texel_basis` includes the texels' solid angles.
        texel_basis: (R, H * W) float32. Texels in row-major order, in panorama coordinates at turn
            0.
    """

    header: TransportHeader
    pixels: NDArray[np.int32]
    coverage: Float32
    pixel_basis: Float32
    texel_basis: Float32
    digest: str = ""

    @cached_property
    def size(self) -> int:
        """Side of the picture, in pixels."""
        return self.header.picture

    @cached_property
    def environment_shape(self) -> tuple[int, int]:
        """Number of rows and columns of the environment, (H, W)."""
        return self.header.environment

    @cached_property
    def face(self) -> Bools:
        """Mask of the face pixels, (P,) bool, which are those at least half covered by the head."""
        return self.coverage >= FACE_COVERAGE

    @cached_property
    def mirror_pixels(self) -> Indices | None:
        """Index of each pixel's mirror image, (P,), or None if any pixel lacks one."""
        place = np.full(self.size * self.size, -1)
        place[self.pixels] = np.arange(len(self.pixels))
        there = place.reshape(self.size, self.size)[:, ::-1].ravel()[self.pixels]
        return None if (there < 0).any() else there

    @cached_property
    def luminance_basis(self) -> Float32:
        """The pixel basis, converted to luminance, (P, R) float32."""
        weights = np.asarray(self.header.luminance_weights, np.float32)
        basis: Float32 = np.tensordot(weights, self.pixel_basis, axes=1)
        return np.ascontiguousarray(basis)


def render(transport: Transport, radiance: Floats) -> Float32:
    """Render the head in an environment, B = T L (eq. 1).

    Args:
        radiance: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance, or luminance, at turn 0.

    Returns:
        (P, 3) or (P,) float32. Linear picture on the head's pixels, in the same unit as `radiance`.

    Raises:
        TransportError: If the environment does not have the transport's size.
    """
    height, width = transport.environment_shape
    if radiance.shape[:2] != (height, width):
        raise TransportError(
            tr(
                "The environment is {columns} x {rows} texels, but this transport needs "
                "{width} x {height}.",
                columns=radiance.shape[1],
                rows=radiance.shape[0],
                width=width,
                height=height,
            )
        )
    light = np.ascontiguousarray(radiance, np.float32).reshape(height * width, -1)
    coefficients = transport.texel_basis @ light
    if radiance.ndim == 2:
        return np.asarray(transport.luminance_basis @ coefficients[:, 0])
    channels = [transport.pixel_basis[c] @ coefficients[:, c] for c in range(3)]
    return np.asarray(np.stack(channels, axis=-1))


def render_all(transport: Transport, lights: Sequence[Floats]) -> Float32:
    """Render the head in several environments, each (H, W, 3), in one product (see `render`).

    Returns:
        (n, P, 3) float32.
    """
    if not lights:
        return np.zeros((0, len(transport.pixels), 3), np.float32)
    columns = np.stack(lights, axis=2).astype(np.float32, copy=False)
    # (texels, n * 3) -> (rank, n, 3): the basis is read once for all environments.
    flat = np.ascontiguousarray(columns.reshape(columns.shape[0] * columns.shape[1], -1))
    basis = (transport.texel_basis @ flat).reshape(-1, len(lights), 3)
    pictures = np.empty((len(lights), len(transport.pixels), 3), np.float32)
    for channel in range(3):
        values = transport.pixel_basis[channel] @ np.ascontiguousarray(basis[:, :, channel])
        pictures[:, :, channel] = values.T
    return pictures


def parity_of(transport: Transport) -> Float64 | None:
    """Return +1 for even texel functions and -1 for odd ones, (R,), or None if some are neither."""
    height, width = transport.environment_shape
    rows = transport.texel_basis.reshape(-1, height, width)
    flipped = np.einsum("rhw,rhw->r", rows, rows[:, :, ::-1])
    norms = np.einsum("rhw,rhw->r", rows, rows) + 1e-30
    parity = np.sign(flipped)
    pure = bool((np.abs(np.abs(flipped) / norms - 1) < _PURE).all())
    return parity.astype(np.float64) if pure else None


def to_image(transport: Transport, values: Floats, background: float = 0.0) -> Float32:
    """Place values of the head's pixels, (P, ...), in an (N, N, ...) float32 picture."""
    size = transport.size
    picture = np.full((size * size, *values.shape[1:]), background, np.float32)
    picture[transport.pixels] = values
    return picture.reshape(size, size, *values.shape[1:])


def transport_path(name: str) -> Path:
    """Return the path of a shipped transport, such as ``generic`` or ``generic-dark``.

    Raises:
        TransportError: If no such head is shipped.
    """
    if name not in transport_names():
        names = ", ".join(transport_names())
        raise TransportError(
            tr("There is no head “{name}”.", name=name),
            tr("Available heads: {names}.", names=names)
            if names
            else tr("No heads are installed. Reinstall Turnlight."),
        )
    return resources() / "transport" / f"{name}.npz"


def transport_names() -> tuple[str, ...]:
    """Return the names of the shipped heads."""
    files = (resources() / "transport").glob("*.npz")
    return tuple(
        sorted(f.stem for f in files if not f.stem.endswith((".styles", ".shape", ".views")))
    )


def load_named(name: str) -> Transport:
    """Load a transport by its shipped name or its path. Raises the errors of `load_transport`."""
    return load_transport(Path(name) if name.endswith(".npz") else transport_path(name))


def save_transport(path: Path, transport: Transport) -> str:
    """Save a transport atomically and return the SHA-256 of the file.

    The bases are stored as half-precision floats. Column norms are first moved to the pixel side to
    keep the values well above the smallest half-precision floats.
    """
    header = {**asdict(transport.header), "format_version": FORMAT_VERSION}
    return write_sealed(
        path,
        _half_floats(transport),
        header,
        store=lambda arrays: _pack(arrays, transport.header),
    )


def load_transport(path: Path) -> Transport:
    """Load a transport from an ``.npz`` file.

    Raises:
        TransportError: If the file is missing, damaged, made by a newer version, or not a
            transport.
    """
    header, arrays = read_sealed(
        path, tr("transport"), _AGAIN, FORMAT_VERSION, most=_MAX_BYTES, restore=_restore
    )
    try:
        transport = Transport(
            header=parse_transport_header(header),
            pixels=np.asarray(arrays["pixels"], np.int32),
            coverage=np.asarray(arrays["coverage"], np.float32),
            pixel_basis=_scaled(arrays["pixel_basis"], arrays["scale"]),
            texel_basis=np.asarray(arrays["texel_basis"], np.float32),
            digest=header["sha256"],
        )
        _check_shapes(transport, path)
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} contains no transport.", name=path.name), _AGAIN) from error
    return transport


_AGAIN = tr("Reinstall Turnlight, or bake the head again with `turnlight bake`.")
_PLAIN: Final = {
    **dict.fromkeys(("head", "skin"), str),
    **dict.fromkeys(("picture", "rank", "paths_per_pixel", "seed", "format_version"), int),
    **dict.fromkeys(("fov_deg", "distance_m", "noise", "truncation"), float),
}
"""Types of the plain values in the header, which are checked whatever the JSON contains."""


def _half_floats(transport: Transport) -> dict[str, NDArray[Any]]:
    scale = np.abs(transport.pixel_basis).max(axis=(0, 1)) + np.float32(1e-30)
    return {
        "pixels": transport.pixels.astype(np.int32),
        "coverage": transport.coverage.astype(np.float32),
        "scale": scale.astype(np.float32),
        "pixel_basis": (transport.pixel_basis / scale).astype(np.float16),
        "texel_basis": transport.texel_basis.astype(np.float16),
    }


def _pack(arrays: dict[str, NDArray[Any]], header: TransportHeader) -> dict[str, NDArray[Any]]:
    """Pack both bases without loss, to less than half the size of an ordinary zip file.

    Each basis picture is even or odd about the centre line of the head, except for the last bit, so
    one half is stored together with the differences of the other half from it. The colours are
    similar, so their differences are stored. Bytes of equal significance are stored side by side,
    because signs and exponents repeat more often than fractions.
    """
    pixel, texel = _partners(arrays["pixels"], header)
    bits = arrays["pixel_basis"].view(np.uint16)
    even, odd = ((bits == bits[:, pixel] ^ sign).sum((0, 1)) for sign in (_EVEN, _ODD))
    sign = np.where(odd > even, _ODD, _EVEN)
    contents = {name: arrays[name] for name in ("pixels", "coverage", "scale")}
    for name, values, partner in (
        ("pixel", bits, pixel),
        ("texel", arrays["texel_basis"].view(np.uint16).T[None], texel),
    ):
        half = np.arange(len(partner)) <= partner
        deltas = np.diff(values[:, half], axis=0, prepend=_EVEN)
        rest = values[:, ~half] - (values[:, partner[~half]] ^ sign)
        for part, content in (("kept", deltas), ("rest", rest)):
            contents[f"{name}_{part}"] = np.stack([content & 255, content >> 8]).astype(np.uint8)
    return {**contents, "sign": sign}


def _restore(facts: dict[str, Any], contents: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Unpack the contents of a file, or return them unchanged if they have the unpacked format."""
    return (
        _unpacked(contents, parse_transport_header(facts))
        if facts["format_version"] > 1
        else contents
    )


def _unpacked(
    contents: dict[str, NDArray[Any]], header: TransportHeader
) -> dict[str, NDArray[Any]]:
    """Invert `_pack`."""
    arrays = {name: contents[name] for name in ("pixels", "coverage", "scale")}
    basis = []
    for name, partner in zip(("pixel", "texel"), _partners(arrays["pixels"], header), strict=True):
        half = np.arange(len(partner)) <= partner
        deltas, rest = (
            low | high << 8
            for part in ("kept", "rest")
            for low, high in [contents[f"{name}_{part}"].astype(np.uint16)]
        )
        if deltas.shape[1] != np.count_nonzero(half):
            raise ValueError("another number of pixels")
        values = np.empty((len(deltas), len(partner), deltas.shape[2]), np.uint16)
        values[:, half] = np.cumsum(deltas, axis=0, dtype=np.uint16)
        values[:, ~half] = rest + (values[:, partner[~half]] ^ contents["sign"])
        basis.append(values.view(np.float16))
    return {**arrays, "pixel_basis": basis[0], "texel_basis": np.ascontiguousarray(basis[1][0].T)}


def _partners(pixels: NDArray[Any], header: TransportHeader) -> tuple[Indices, Indices]:
    """Return the indices of each pixel's and each texel's mirror image, (P,) and (H * W,).

    A pixel whose mirror image is not in the picture is treated as its own mirror image.
    """
    side, (height, width) = header.picture, header.environment
    if not (0 < side <= _MAX_PICTURE and 0 < height * width <= _MAX_TEXELS):
        raise ValueError("no such picture or environment")
    own = np.arange(len(pixels))
    place = np.full((side, side), -1)
    place.flat[pixels] = own
    mirrored = place[:, ::-1].flat[pixels]
    texels = np.arange(height * width).reshape(height, width)[:, ::-1].ravel()
    return np.where(mirrored < 0, own, mirrored), texels


def _scaled(basis: NDArray[Any], scale: NDArray[Any]) -> Float32:
    full = basis.astype(np.float32)
    full *= scale.astype(np.float32)
    return full


def parse_transport_header(facts: Mapping[str, Any]) -> TransportHeader:
    """Parse the header of a file, raising one of `CONTRADICTIONS` if the header is invalid."""
    field_names = {f.name for f in fields(TransportHeader)}
    values = {name: value for name, value in facts.items() if name in field_names}
    values["environment"] = (int(values["environment"][0]), int(values["environment"][1]))
    red, green, blue = (float(weight) for weight in values["luminance_weights"])
    values["luminance_weights"] = red, green, blue
    for name, kind in _PLAIN.items():
        if name in values:
            values[name] = kind(values[name])
    return TransportHeader(**values)


def _check_shapes(transport: Transport, path: Path) -> None:
    header = transport.header
    (height, width), count, rank = header.environment, len(transport.pixels), header.rank
    fits = (
        0 < header.picture <= _MAX_PICTURE
        and 0 < height * width <= _MAX_TEXELS
        and width == 2 * height
        and 0 < rank <= _MAX_RANK
        and transport.coverage.shape == (count,)
        and transport.pixel_basis.shape == (3, count, rank)
        and transport.texel_basis.shape == (rank, height * width)
        and count > 0
        and int(transport.pixels.min()) >= 0
        and int(transport.pixels.max()) < header.picture**2
    )
    if not fits:
        raise TransportError(tr("{name} is inconsistent.", name=path.name), hint=_AGAIN)
