"""From a full transport matrix to the form that ships: mirror symmetric and low rank."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32, Float64, Int64

if TYPE_CHECKING:
    from app.core.baking.columns import TexelColumns


def mirror_pixels(pixels: NDArray[np.int32], size: int) -> Int64:
    """Where in `pixels` the mirror image of each pixel stands; itself when it is not there."""
    mirrored = pixels // size * size + size - 1 - pixels % size
    where = np.searchsorted(pixels, mirrored)
    where = np.minimum(where, len(pixels) - 1)
    found = pixels[where] == mirrored
    return np.where(found, where, np.arange(len(pixels)))


def symmetrise(matrix: Float32, twin: Int64, texels: TexelColumns) -> tuple[Float32, float]:
    """Average a matrix with its own mirror image.

    The two halves of a symmetric head were traced independently, so their difference also tells
    the noise.

    Args:
        matrix: (P, H * W, 3) float32.
        twin: (P,) int. Mirror image of each pixel.

    Returns:
        symmetric: (P, H * W, 3) float32.
        noise: RMS noise / RMS of the picture after averaging, median over the texels.
    """
    shape = (len(matrix), texels.height, texels.width, 3)
    mirrored = matrix[twin].reshape(shape)[:, :, ::-1].reshape(matrix.shape)
    noise = float(np.median(texel_noise(matrix, mirrored))) / math.sqrt(2)
    return np.float32(0.5) * (matrix + mirrored), noise


def texel_noise(one: Float32, two: Float32) -> Float64:
    """Noise of one of two independent bakes: RMS difference / sqrt 2 / RMS, for each texel."""
    difference = np.square(one - two).mean(axis=(0, 2), dtype=np.float64)
    power = np.maximum((one * two).mean(axis=(0, 2), dtype=np.float64), 1e-30)
    return np.asarray(np.sqrt(difference / 2 / power))


def compress(matrix: Float32, texels: TexelColumns, rank: int) -> tuple[Float32, Float32, float]:
    """Best low-rank form of a transport matrix, every texel's picture counting alike.

    The texel basis is made of functions that are even or odd under mirroring, so that a mirrored
    panorama gives the mirrored picture exactly.

    Args:
        matrix: (P, H * W, 3) float32.

    Returns:
        pixel_basis: (3, P, R) float32.
        texel_basis: (R, H * W) float32.
        truncation: RMS error / RMS, 95th percentile over the texels.
    """
    count, half = texels.count, texels.width // 2
    scale = np.sqrt(np.square(matrix).mean(axis=(0, 2), dtype=np.float64))
    scale = np.maximum(scale, 1e-3 * scale.max())
    scale = (scale + _mirrored(scale, texels)) / 2
    flat = matrix.transpose(0, 2, 1).reshape(-1, count) / scale.astype(np.float32)
    gram = (flat.T @ flat).astype(np.float64)
    values, functions = [], []
    for sign in (1.0, -1.0):
        to_half = np.zeros((count, texels.height * half))
        grid = np.arange(count).reshape(texels.height, texels.width)
        left, right = grid[:, :half].ravel(), grid[:, ::-1][:, :half].ravel()
        to_half[left, np.arange(len(left))] = np.sqrt(0.5)
        to_half[right, np.arange(len(left))] = sign * np.sqrt(0.5)
        energy, vectors = np.linalg.eigh(to_half.T @ gram @ to_half)
        values.append(energy)
        functions.append((to_half @ vectors).T)
    order = np.argsort(-np.concatenate(values))[:rank]
    basis = np.concatenate(functions)[order].astype(np.float32)
    texel_basis = basis * scale.astype(np.float32)
    projected = flat @ basis.T
    lost = np.square(flat - projected @ basis).mean(axis=0) / np.square(flat).mean(axis=0)
    pixel_basis = projected.reshape(len(matrix), 3, -1).transpose(1, 0, 2)
    truncation = float(np.sqrt(np.percentile(lost, 95)))
    return np.ascontiguousarray(pixel_basis), texel_basis, truncation


def _mirrored(values: Float64, texels: TexelColumns) -> Float64:
    return values.reshape(texels.height, texels.width)[:, ::-1].ravel()
