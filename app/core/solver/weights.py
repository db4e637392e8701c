"""Target weights f on the face (eq. 6), painted or taken from a picture, and their pre-integration.

Painted weights are pre-integrated incrementally. The projection of the weights onto the low-rank
basis of the transport is stored, so a stroke reads only the rows of the pixels that it changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.errors import StyleError
from app.core.solver.transport import Transport
from app.core.text import tr

_ROWS: Final = 512  # rows at once; a copy of the whole basis takes twice as long


def target_weights(luminance: Floats, face: Bools) -> Float64:
    """Return the weights of a target picture (eq. 6).

    The picture on the face is rescaled linearly to [0, 1] and its mean over the face is subtracted.
    Everything outside the face is ignored.

    Args:
        luminance: (P,) float. Linear luminance of the target picture on the head's pixels, at any
            scale.
        face: (P,) bool. Face pixels.

    Returns:
        (P,) float64. The weights f, which are exactly 0 outside the face and sum to 0 within
        rounding.

    Raises:
        StyleError: If the picture is not finite, or if it is uniform over the face and therefore
            defines no target.

    Examples:
        >>> f = target_weights(np.array([1.0, 3.0, 9.0]), np.array([True, True, False]))
        >>> f.tolist()
        [-0.5, 0.5, 0.0]
    """
    values = np.asarray(luminance, np.float64)[face]
    if values.size == 0 or not np.isfinite(values).all():
        raise StyleError(tr("The target picture has no usable pixels on the face."))
    low, high = float(values.min()), float(values.max())
    if high - low <= 1e-9 * abs(high):
        raise StyleError(tr("The target picture is equally bright all over the face."))
    values = (values - low) / (high - low)
    weights = np.zeros(len(luminance))
    weights[face] = _centred(values)
    return weights


def region_weights(luminance: Floats, region: Floats) -> Float64:
    """Return the weights of a target picture over the face region, from eq. 6 with weighted pixels.

    Args:
        luminance: (P,) float. Linear luminance of the target picture, at any scale.
        region: (P,) float. Weight of each pixel, 0 to 1.

    Returns:
        (P,) float64. The weights, which sum to 0 within rounding. The sum of their product with a
        picture is the covariance of target and picture over the region, up to a factor.

    Raises:
        StyleError: If the picture is uniform over the region.
    """
    weights = target_weights(luminance, np.asarray(region) > 0) * region
    # Centre twice, as above, to remove the rounding error of the first mean.
    for _ in range(2):
        weights -= region * (weights.sum() / np.sum(region))
    return np.asarray(weights)


def painted_weights(values: Floats, face: Bools, ignored: Bools | None = None) -> Float64:
    """Return weights from painted values, with zero mean over the face pixels in use.

    Args:
        values: (P,) float. Painted value for each pixel of the head, at any offset. Larger values
            are brighter.
        face: (P,) bool. Face pixels.
        ignored: (P,) bool. Face pixels to exclude.

    Returns:
        (P,) float64. The weights f, which are exactly 0 outside the face and on ignored pixels.
    """
    active = face if ignored is None else face & ~ignored
    weights = np.zeros(len(values))
    if active.any():
        weights[active] = _centred(np.asarray(values, np.float64)[active])
    return weights


def _centred(values: Float64) -> Float64:
    centred = values - values.mean()
    # The first mean leaves a rounding error that a second pass removes.
    return np.asarray(centred - centred.mean())


@dataclass(frozen=True, slots=True)
class PaintedWeights:
    """Painted weights and their pre-integration, for strokes that change few pixels.

    Attributes:
        values: (P,) float64. Painted values, before the mean is subtracted.
        active: (P,) bool. Face pixels that are not ignored.
        in_basis: (R,) float64. Sum over the active pixels of each value times the pixel's row of
            the luminance basis.
        ones_in_basis: (R,) float64. The same sum with 1 in place of each value.
        total: Sum of the values of the active pixels.
        count: Number of active pixels.
    """

    values: Float64
    active: Bools
    in_basis: Float64
    ones_in_basis: Float64
    total: float
    count: int

    @property
    def weights(self) -> Float64:
        """The weights f, (P,) float64: zero-mean over the active pixels, exactly 0 elsewhere."""
        return painted_weights(self.values, self.active)

    @property
    def coefficients(self) -> Float64:
        """The vector f' times the luminance basis, (R,) float64; F = coefficients @ texel basis."""
        mean = self.total / self.count if self.count else 0.0
        return np.asarray(self.in_basis - mean * self.ones_in_basis)

    def preintegrated(self, transport: Transport) -> Float32:
        """Return the pre-integrated target F' = f'T (eq. 3), (H, W) float32.

        The target is in panorama coordinates at turn 0.
        """
        flat: Float32 = self.coefficients.astype(np.float32) @ transport.texel_basis
        return flat.reshape(transport.environment_shape)


def painted(transport: Transport, values: Floats, ignored: Bools | None = None) -> PaintedWeights:
    """Pre-integrate every pixel, in preparation for painting.

    Args:
        values: (P,) float. Painted value for each pixel of the head. Not used outside the face.
        ignored: (P,) bool. Face pixels to exclude.

    Raises:
        StyleError: If there is not one finite value per pixel of the head.
    """
    if values.shape != transport.face.shape or not np.isfinite(values).all():
        raise StyleError(tr("The painted weights do not fit this head."))
    active = transport.face if ignored is None else transport.face & ~ignored
    start = PaintedWeights(
        values=np.asarray(values, np.float64).copy(),
        active=np.zeros_like(transport.face),
        in_basis=np.zeros(transport.header.rank),
        ones_in_basis=np.zeros(transport.header.rank),
        total=0.0,
        count=0,
    )
    pixels = np.flatnonzero(active)
    return paint(transport, start, pixels, values[pixels])


def paint(
    transport: Transport,
    before: PaintedWeights,
    pixels: NDArray[np.integer[Any]],
    values: Floats,
    ignored: Bools | None = None,
) -> PaintedWeights:
    """Update changed pixels, reading only the corresponding rows of the luminance basis (eq. 3).

    Args:
        pixels: (n,) int. Indices among the head's P pixels, each at most once. Those outside the
            face are ignored.
        values: (n,) float. New painted values for these pixels.
        ignored: (n,) bool. Pixels to exclude from now on. By default, none are excluded.

    Returns:
        The weights after the stroke. Rounding errors accumulate to less than 1e-6 of the weights
        per thousand strokes. Call `painted` to start afresh.
    """
    on_face = transport.face[pixels]
    if not on_face.all():
        pixels, values = pixels[on_face], values[on_face]
        ignored = None if ignored is None else ignored[on_face]
    old_active = before.active[pixels]
    new_active = np.ones(len(pixels), bool) if ignored is None else ~ignored
    new_values = np.asarray(values, np.float64)
    change = new_values * new_active - before.values[pixels] * old_active
    switch = new_active.astype(np.float64) - old_active
    both, sums = np.stack([change, switch]), np.zeros((2, transport.header.rank))
    for start in range(0, len(pixels), _ROWS):
        part = slice(start, start + _ROWS)
        # Use double precision: the mean is subtracted later, and the remainder can be small.
        rows = transport.luminance_basis.take(pixels[part], axis=0).astype(np.float64)
        sums += both[:, part] @ rows
    all_values, all_active = before.values.copy(), before.active.copy()
    all_values[pixels], all_active[pixels] = new_values, new_active
    return replace(
        before,
        values=all_values,
        active=all_active,
        in_basis=before.in_basis + sums[0],
        ones_in_basis=before.ones_in_basis + sums[1],
        total=before.total + float(change.sum()),
        count=before.count + int(switch.sum()),
    )
