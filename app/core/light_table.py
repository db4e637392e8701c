"""One place's light on one head at all turns, prepared so that painted weights answer at once.

The pictures at the 64 turns do not depend on what is painted. With them at hand a stroke costs
one product of its coefficients with 64 columns, and nothing of the full transport.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.angles import TURNS, wrap
from app.core.errors import EnvironmentFileError
from app.core.reasons import LightMap

if TYPE_CHECKING:
    from app.core.transport import Transport
    from app.core.weights import PaintedWeights

__all__ = [
    "LightTable",
    "PaintedCurves",
    "contrast_of",
    "light_table",
    "normalised",
    "painted_curves",
    "table_picture",
]

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Floats: TypeAlias = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class LightTable:
    """A head in a place's light, at all turns. Its arrays must not be written to.

    Attributes
    ----------
    transport : Transport
        Of the head.
    light : LightMap
        The environment, mean 1.
    scale : float
        What it was divided by.
    response : (R, 64) float64
        Texel basis times the environment at turn 5.625 k deg.
    moments : (F, 128) float64
        Luminance of the F face pixels at the 64 turns, less its mean over the face per turn,
        then the squares of the same. Exposure-free.
    pictures : (64, P, 3) float32 or None
        Linear Rec. 709 pictures on the head's pixels, in the unit of the environment.
    """

    transport: Transport = field(repr=False)
    light: LightMap = field(repr=False)
    scale: float
    response: Float64 = field(repr=False)
    moments: Float64 = field(repr=False)
    pictures: Float32 | None = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class PaintedCurves:
    """Painted weights in a place's light; exposure-free.

    Attributes
    ----------
    quality, mean, contrast : (64,) float64
        C of eq. 5, mean luminance, and norm of the picture minus its mean, at turn 5.625 k deg;
        over the pixels that count.
    norm : float
        Norm of the weights; 0 when they ask for nothing.
    studio : float
        Quality over mean under the environment max(F, 0); 0 when that is black.
    """

    quality: Float64
    mean: Float64
    contrast: Float64
    norm: float
    studio: float


def normalised(luminance: Floats, shape: tuple[int, int]) -> tuple[Float64, float]:
    """Divide an environment by its mean, so that numbers do not depend on its exposure.

    Parameters
    ----------
    luminance : (H, W) float
        Linear luminance, any exposure.
    shape : tuple of int
        Rows and columns that the head takes.

    Returns
    -------
    (H, W) float64
        The environment with mean 1.
    float
        What it was divided by.

    Raises
    ------
    EnvironmentFileError
        If the environment is black, not finite or has another size.
    """
    if luminance.shape != shape:
        raise EnvironmentFileError(
            f"The environment has {luminance.shape} texels, the head takes {shape}."
        )
    light = np.asarray(luminance, np.float64)
    # The largest value first: sums of very large or small values may leave the number range.
    peak = float(light.max())
    if not np.isfinite(light).all() or peak <= 0:
        raise EnvironmentFileError("The environment is black: there is no light to turn toward.")
    light = light / peak
    mean = float(light.mean())
    return light / mean, mean * peak


def light_table(
    transport: Transport, luminance: Floats, radiance: Floats | None = None
) -> LightTable:
    """Prepare a place's light for painting on a head.

    Parameters
    ----------
    transport : Transport
        Of the head.
    luminance : (H, W) float
        Environment at turn 0 in the transport's size, linear luminance, any exposure.
    radiance : (H, W, 3) float, optional
        The same in linear Rec. 709, for pictures; without it there are none.

    Returns
    -------
    LightTable

    Raises
    ------
    EnvironmentFileError
        If the environment is black, not finite or has another size.
    """
    shape = transport.environment_shape
    light, scale = normalised(luminance, shape)
    if radiance is not None and (radiance.shape != (*shape, 3) or not np.isfinite(radiance).all()):
        raise EnvironmentFileError("The environment in colour does not fit the head.")
    texels = transport.texel_basis.reshape(-1, *shape).astype(np.float64)
    # (frequency, rank, row): one product per azimuth frequency.
    basis = np.ascontiguousarray(np.fft.rfft(texels, axis=2).transpose(2, 0, 1)).conj()
    response = _at_all_turns(basis, light)
    faces = transport.luminance_basis[transport.face].astype(np.float64) @ response
    faces -= faces.mean(axis=0)
    pictures = None if radiance is None else _pictures(transport, basis, radiance)
    light_map = LightMap(light)
    # Worked out here, once, and not at the first stroke.
    _ = light_map.is_even
    return LightTable(
        transport=transport,
        light=light_map,
        scale=scale,
        response=response,
        moments=np.concatenate([faces, faces * faces], axis=1),
        pictures=pictures,
    )


def contrast_of(table: LightTable, active: Mask) -> Float64:
    """Contrast at all turns of the pixels that count.

    Parameters
    ----------
    table : LightTable
    active : (P,) bool
        Face pixels that count.

    Returns
    -------
    (64,) float64
        Norm of the picture's luminance minus its mean over those pixels, exposure-free.
    """
    counted = active[table.transport.face].astype(np.float64)
    count = float(counted.sum())
    if count == 0:
        return np.zeros(TURNS)
    sums = counted @ table.moments
    squared: Float64 = sums[TURNS:] - sums[:TURNS] ** 2 / count
    return np.sqrt(np.maximum(squared, 0.0))


def painted_curves(
    table: LightTable, weights: PaintedWeights, contrast: Float64 | None = None
) -> PaintedCurves:
    """Quality, mean and contrast of painted weights at all turns (eq. 5).

    Parameters
    ----------
    table : LightTable
        Of the place and the head that was painted on.
    weights : PaintedWeights
        What was painted.
    contrast : (64,) float64, optional
        From `contrast_of` for the same active pixels, where it is known already.

    Returns
    -------
    PaintedCurves
    """
    transport = table.transport
    count = max(weights.count, 1)
    both = np.stack([weights.coefficients, weights.ones_in_basis / count])
    quality, mean = both @ table.response
    norm = _norm(weights)
    # What is left of weights that are the same everywhere is rounding, and asks for nothing.
    quality = quality if norm > 0 else np.zeros(TURNS)
    target, average = (both.astype(np.float32) @ transport.texel_basis).astype(np.float64)
    glow = np.maximum(target, 0.0)
    lit = float((average * glow).sum())
    return PaintedCurves(
        quality=quality,
        mean=mean,
        contrast=contrast_of(table, weights.active) if contrast is None else contrast,
        norm=norm,
        studio=float((target * glow).sum()) / lit if norm > 0 and lit > 1e-30 else 0.0,
    )


def table_picture(table: LightTable, turn_deg: float) -> Float32:
    """Picture of the head at any turn, between grid turns by mixing the two next to it.

    Mixing cannot darken a pixel below its neighbours in turn, and is as near to the picture
    under the finely measured light as band-limited interpolation is.

    Parameters
    ----------
    table : LightTable
        Made with `radiance`.
    turn_deg : float
        Azimuth in the panorama that the sitter faces, deg.

    Returns
    -------
    (P, 3) float32
        Linear Rec. 709 on the head's pixels, in the unit of the environment.

    Raises
    ------
    ValueError
        If the table was made without colours.
    """
    if table.pictures is None:
        raise ValueError("the table has no pictures")
    place = (wrap(turn_deg) * TURNS / 360.0) % TURNS
    below = int(place)
    share = np.float32(place - below)
    first, second = table.pictures[below % TURNS], table.pictures[(below + 1) % TURNS]
    mixed: Float32 = first + share * (second - first)
    return mixed


def _at_all_turns(basis: NDArray[np.complex128], light: Float64) -> Float64:
    """(R, 64) products of the texel basis with the light at all turns, by azimuth frequency.

    `basis` is the conjugate spectrum, (M, R, H). Turns by part of a texel are band-limited.
    """
    width = light.shape[1]
    spectrum = np.fft.rfft(light, axis=1).T[:, :, None]
    product = (basis @ spectrum)[:, :, 0]
    # Parseval: the ends of the spectrum count once, the rest twice.
    share = np.full(len(product), 2.0 / width)
    share[0] = share[-1] = 1.0 / width
    phase = 2 * np.pi / TURNS * np.outer(np.arange(len(product)), np.arange(TURNS))
    cosine, sine = np.cos(phase) * share[:, None], np.sin(phase) * share[:, None]
    response: Float64 = product.real.T @ cosine - product.imag.T @ sine
    return response


def _pictures(transport: Transport, basis: NDArray[np.complex128], radiance: Floats) -> Float32:
    pictures = np.empty((TURNS, len(transport.pixels), 3), np.float32)
    for channel in range(3):
        light = np.asarray(radiance[:, :, channel], np.float64)
        response = _at_all_turns(basis, light).astype(np.float32)
        pictures[:, :, channel] = (transport.pixel_basis[channel] @ response).T
    # Band-limited turns and the low rank may dip a little below black.
    return np.maximum(pictures, 0.0, out=pictures)


def _norm(weights: PaintedWeights) -> float:
    values = weights.values[weights.active]
    if values.size == 0:
        return 0.0
    centred = values - values.mean()
    norm = float(np.linalg.norm(centred))
    return norm if norm > 1e-9 * float(np.linalg.norm(values)) else 0.0
