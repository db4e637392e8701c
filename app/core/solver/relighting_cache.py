"""The light of a place on a head at every turn, prepared for fast results while painting.

The pictures at the 64 turns do not depend on the paint. Once they are computed, each stroke costs
only the product of its coefficients with 64 columns, without the full transport.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from app.core.base import colour
from app.core.base.angles import TURNS, wrap
from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.errors import EnvironmentFileError
from app.core.solver.light_map import LightMap
from app.core.solver.search import luminance_of
from app.core.solver.transport import Transport
from app.core.solver.weights import PaintedWeights
from app.core.text import tr


@dataclass(frozen=True, slots=True, eq=False)
class LightTable:
    """The appearance of a head in the light of a place at every turn. Do not modify the arrays.

    Attributes:
        moments: (F, 128) float64. Luminance of the F face pixels at the 64 turns, minus its mean
            over the face at each turn, followed by the squares of these values. The values do not
            depend on the exposure.
        brightness: (64,) float64. Mean over the face at each turn.
        pictures: (64, N, N, 3) float32. Linear Rec. 709 pictures at the 64 turns, in the same unit
            as the environment and black around the head, or None if the table has no pictures.
    """

    transport: Transport = field(repr=False)
    light: LightMap = field(repr=False)
    scale: float
    moments: Float64 = field(repr=False)
    brightness: Float64 = field(repr=False)
    pictures: Float32 | None = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class PaintedCurves:
    """Curves of painted weights in the light of a place, independent of exposure.

    Attributes:
        quality, mean, contrast: (64,) float64. C of eq. 5, the mean luminance, and the norm of the
            picture minus its mean, at turn 5.625 k degrees, over the active pixels.
        norm: Norm of the weights.
        studio: Quality divided by the mean, both for the environment max(F, 0), or 0 if that
            environment is black.
    """

    quality: Float64
    mean: Float64
    contrast: Float64
    norm: float
    studio: float


@dataclass(frozen=True, slots=True, eq=False)
class CountedLight:
    """The light on the active pixels, independent of weights and exposure.

    Attributes:
        mean, contrast: (64,) float64. Mean luminance of the active pixels, and the norm of their
            luminance minus that mean, at turn 5.625 k degrees.
    """

    mean: Float64
    contrast: Float64


def normalised(light: Floats, shape: tuple[int, int]) -> tuple[Float64, float]:
    """Divide an environment by its mean luminance to remove its exposure.

    Args:
        light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance, or luminance, at any exposure.
        shape: Rows and columns that the head requires.

    Returns:
        (H, W, 3) or (H, W) float64. The environment with mean luminance 1.

    Raises:
        EnvironmentFileError: If the environment is black, is not finite, or has the wrong size.
    """
    if light.shape not in (shape, (*shape, 3)):
        raise EnvironmentFileError(
            tr(
                "The environment is {light_shape} texels, but the head needs {head_shape}.",
                light_shape=light.shape,
                head_shape=shape,
            )
        )
    values = np.asarray(light, np.float64)
    # Divide by the largest value first, since sums of huge or tiny values may overflow or
    # underflow.
    peak = float(values.max())
    if not np.isfinite(values).all() or peak <= 0:
        raise EnvironmentFileError(
            tr("The environment is completely black."),
            tr("Measure the place again with a longer exposure."),
        )
    values = values / peak
    mean = float(luminance_of(values).mean())
    return values / mean, mean * peak


def light_table(
    transport: Transport, light: Floats, *, pictures: bool = False, grey: bool = False
) -> LightTable:
    """Prepare a place's light for painting on a head.

    Args:
        light: (H, W, 3) or (H, W) float. Environment at turn 0, in the size that the transport
            requires, as linear Rec. 709 radiance or as the luminance of grey light, at any
            exposure.
        pictures: Whether to include pictures.
        grey: Whether to use colour for the pictures only, as in the paper.

    Raises:
        EnvironmentFileError: If the environment is black, is not finite, or has the wrong size, or
            if pictures are requested for an environment without colours.
    """
    shape = transport.environment_shape
    values, scale = normalised(light, shape)
    if pictures and values.ndim == 2:
        raise EnvironmentFileError(tr("No pictures can be made from light without colours."))
    texels = transport.texel_basis.reshape(-1, *shape).astype(np.float64)
    # (frequency, rank, row): one product per azimuth frequency.
    basis = np.ascontiguousarray(np.fft.rfft(texels, axis=2).transpose(2, 0, 1)).conj()
    table = None if values.ndim == 2 else _pictures(transport, basis, values)
    if table is None or grey:
        response = _at_all_turns(basis, luminance_of(values)).astype(np.float32)
        luminance = transport.luminance_basis @ response
    else:
        luminance = colour.luminance(table).T
    faces = luminance[transport.face].astype(np.float64)
    brightness = faces.mean(axis=0)
    faces -= brightness
    light_map = LightMap(luminance_of(values))
    # Compute this now, so that the first stroke is not delayed.
    _ = light_map.is_even
    return LightTable(
        transport=transport,
        light=light_map,
        scale=scale,
        moments=np.concatenate([faces, faces * faces], axis=1),
        brightness=brightness,
        # Band-limited turns may be slightly below black.
        pictures=_on_black(transport, np.maximum(table, 0) * np.float32(scale))
        if pictures and table is not None
        else None,
    )


def _on_black(transport: Transport, pictures: Float32) -> Float32:
    """Place the head's pixels, (64, P, 3), in black pictures, (64, N, N, 3)."""
    size = transport.size
    flat = np.zeros((len(pictures), size * size, 3), np.float32)
    flat[:, transport.pixels] = pictures
    return flat.reshape(-1, size, size, 3)


def counted_light(table: LightTable, active: Bools) -> CountedLight:
    """Return the light on the active pixels at every turn, or zeros if no pixel is active.

    Args:
        active: (P,) bool. The face pixels that count.
    """
    counted_pixels = active[table.transport.face].astype(np.float64)
    count = float(counted_pixels.sum())
    if count == 0:
        return CountedLight(np.zeros(TURNS), np.zeros(TURNS))
    sums = counted_pixels @ table.moments
    squared: Float64 = sums[TURNS:] - sums[:TURNS] ** 2 / count
    return CountedLight(table.brightness + sums[:TURNS] / count, np.sqrt(np.maximum(squared, 0.0)))


def painted_curves(
    table: LightTable, weights: PaintedWeights, counted: CountedLight | None = None
) -> PaintedCurves:
    """Return the quality, mean and contrast of painted weights at every turn (eq. 5).

    Args:
        counted: Result of `counted_light` for the same active pixels, if already computed.
    """
    transport = table.transport
    light = counted_light(table, weights.active) if counted is None else counted
    norm = _norm(weights)
    # The remainder of uniform weights is only rounding error.
    face_weights = weights.weights[transport.face]
    quality = face_weights @ table.moments[:, :TURNS] if norm > 0 else np.zeros(TURNS)
    both = np.stack([weights.coefficients, weights.ones_in_basis / max(weights.count, 1)])
    target, average = (both.astype(np.float32) @ transport.texel_basis).astype(np.float64)
    glow = np.maximum(target, 0.0)
    studio_mean = float((average * glow).sum())
    return PaintedCurves(
        quality=quality,
        mean=light.mean,
        contrast=light.contrast,
        norm=norm,
        studio=float((target * glow).sum()) / studio_mean
        if norm > 0 and studio_mean > 1e-30
        else 0.0,
    )


def table_picture(table: LightTable, turn_deg: float) -> Float32:
    """Return the picture of the head at any turn, mixed from the two nearest grid turns.

    Mixing never makes a pixel darker than it is at both neighbouring turns. The result is as close
    to the picture in full-resolution light as band-limited interpolation is.

    Args:
        turn_deg: Azimuth in the panorama that the sitter faces, in degrees.

    Returns:
        (P, 3) float32. Linear Rec. 709 on the head's pixels, in the same unit as the environment.

    Raises:
        ValueError: If the table was created without pictures.
    """
    if table.pictures is None:
        raise ValueError("the table has no pictures")
    place = (wrap(turn_deg) * TURNS / 360.0) % TURNS
    below = int(place)
    share = np.float32(place - below)
    first, second = table.pictures[below % TURNS], table.pictures[(below + 1) % TURNS]
    return np.asarray(first + share * (second - first))


def _at_all_turns(basis: NDArray[np.complex128], light: Float64) -> Float64:
    """Return the product, (R, 64), of the texel basis and the light at every turn.

    It is computed by azimuth frequency. `basis` is the conjugate spectrum, (M, R, H). Turns by a
    fraction of a texel are interpolated within the band limit.
    """
    width = light.shape[1]
    spectrum = np.fft.rfft(light, axis=1).T[:, :, None]
    product = (basis @ spectrum)[:, :, 0]
    # Parseval: the ends of the spectrum count once, the rest twice.
    share = np.full(len(product), 2.0 / width)
    share[0] = share[-1] = 1.0 / width
    phase = 2 * np.pi / TURNS * np.outer(np.arange(len(product)), np.arange(TURNS))
    cosine, sine = np.cos(phase) * share[:, None], np.sin(phase) * share[:, None]
    return np.asarray(product.real.T @ cosine - product.imag.T @ sine)


def _pictures(transport: Transport, basis: NDArray[np.complex128], radiance: Floats) -> Float32:
    pictures = np.empty((TURNS, len(transport.pixels), 3), np.float32)
    for channel in range(3):
        light = np.asarray(radiance[:, :, channel], np.float64)
        response = _at_all_turns(basis, light).astype(np.float32)
        pictures[:, :, channel] = (transport.pixel_basis[channel] @ response).T
    return pictures


def _norm(weights: PaintedWeights) -> float:
    values = weights.values[weights.active]
    if values.size == 0:
        return 0.0
    centred = values - values.mean()
    norm = float(np.linalg.norm(centred))
    return norm if norm > 1e-9 * float(np.linalg.norm(values)) else 0.0
