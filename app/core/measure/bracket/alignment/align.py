"""Align a bracket's panoramas.

Each frame is compared with a reference frame, or with its neighbour if it has too little in common
with the reference. Frames that are already aligned stay exactly as they are. So do frames that
cannot be compared, because no correction is better than a wrong one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Bytes, Float64
from app.core.base.remarks import Remark
from app.core.base.sphere import angle_of
from app.core.measure.bracket.alignment.registration import (
    Fit,
    Level,
    middle_frame,
    pyramid,
    register,
    usable_share,
)
from app.core.measure.bracket.remarks import FramesApart, FramesRotated, FramesUnlike

# In degrees, less than a pixel of a 5376 x 2688 frame. Resampling would do more harm.
_LEAST_DEG: Final = 0.05
_FAR_STOPS: Final = 7.0  # stops; frames farther apart have almost nothing in common
_MANY_POINTS: Final = 500
_STRANGE_DEG: Final = 0.3


@dataclass(frozen=True, slots=True)
class FrameAlignment:
    """The rotation that aligns a frame with the reference frame.

    Attributes:
        rotation: (3, 3) float64. Rotation for `sphere.remap_frame`, or None if the frame stays as
            it is, either because `angle_deg` is too small or because the frames could not be
            compared.
        residual_deg: Standard error of the rotation in degrees, or infinity if nothing could be
            compared.
        points: Number of points that were compared.
        trusted: Whether the frames could be compared.
    """

    rotation: Float64 | None
    angle_deg: float
    residual_deg: float
    points: int
    trusted: bool


_ALONE: Final = FrameAlignment(None, 0.0, math.inf, 0, trusted=False)


def reference_of(frames: Sequence[Bytes]) -> int:
    """Return the index of the reference frame, which is the middle one if that is well exposed.

    The frames, (h, w, 3) uint8 each, are in order of exposure. The reference is the frame nearest
    to the middle whose usable pixels cover at least 60% of the solid angle that those of the best
    frame cover.
    """
    return middle_frame([usable_share(pyramid(frame)) for frame in frames])


def estimate(frames: Sequence[Bytes], stops: Sequence[float]) -> tuple[FrameAlignment, ...]:
    """Return the rotations that align a bracket's panoramas with the reference frame.

    Frames with other proportions stay as they are, since their angle of view is unknown. So do
    frames that are already aligned or cannot be compared.

    Args:
        frames: One thumbnail per frame, (h, w, 3) uint8, consisting of area means of encoded RGB,
            about 672 x 336 pixels.
        stops: Exposures of the frames, in stops.
    """
    count = len(frames)
    if count < 2 or frames[0].shape[1] != 2 * frames[0].shape[0]:
        return (_ALONE,) * count
    # Run one after another, since threads on such small pictures wait too long for one another.
    pyramids = [pyramid(frame) for frame in frames]
    middle = middle_frame([usable_share(levels) for levels in pyramids])
    others = [index for index in range(count) if index != middle]
    near = [k for k in others if abs(stops[k] - stops[middle]) <= _FAR_STOPS]
    direct = {k: _between(middle, k, pyramids, stops) for k in near}
    fits: dict[int, Fit] = {middle: Fit(np.eye(3), error_deg=0.0)}
    for index in sorted(others, key=lambda k: (abs(stops[k] - stops[middle]), k)):
        fit = direct.get(index, Fit(np.eye(3)))
        fits[index] = fit if fit.trusted else _through(index, middle, fit, fits, pyramids, stops)
    return tuple(_alignment(fits[index], index == middle) for index in range(count))


def remarks(alignments: Sequence[FrameAlignment], names: Sequence[str]) -> tuple[Remark, ...]:
    """Report how misaligned frames were corrected.

    If every comparable frame is aligned, there are no remarks, since frames that are too dark to
    compare are then no cause for concern.
    """
    moved = [k for k, a in enumerate(alignments) if a.rotation is not None]
    blind = [k for k, a in enumerate(alignments) if not a.trusted]
    strange = [
        k
        for k in blind
        if alignments[k].points > _MANY_POINTS and alignments[k].residual_deg > _STRANGE_DEG
    ]
    dark = [k for k in blind if k not in strange] if moved else []
    result: list[Remark] = []
    if moved:
        angles = tuple(alignments[k].angle_deg for k in moved)
        result.append(FramesRotated(tuple(names[k] for k in moved), angles))
    if strange:
        result.append(FramesUnlike(tuple(names[k] for k in strange)))
    if dark:
        result.append(FramesApart(tuple(names[k] for k in dark)))
    return tuple(result)


def _alignment(fit: Fit, reference: bool) -> FrameAlignment:
    """Decide whether to apply a rotation to a frame."""
    if reference:
        return FrameAlignment(None, 0.0, 0.0, fit.points, trusted=True)
    angle = angle_of(fit.rotation)
    idle = not fit.trusted or angle < max(_LEAST_DEG, 3.0 * fit.error_deg)
    rotation = None if idle else np.ascontiguousarray(fit.rotation.T)
    return FrameAlignment(rotation, angle, fit.error_deg, fit.points, fit.trusted)


def _through(
    index: int,
    middle: int,
    fit: Fit,
    fits: dict[int, Fit],
    pyramids: Sequence[list[Level]],
    stops: Sequence[float],
) -> Fit:
    """Fit a frame via the nearest fitted frame if its direct fit is not good enough."""
    apart = abs(stops[index] - stops[middle])
    others = [k for k in fits if k != middle and fits[k].trusted]
    if not others:
        return fit
    near = min(others, key=lambda k: abs(stops[k] - stops[index]))
    if abs(stops[near] - stops[index]) > min(_FAR_STOPS, apart):
        return fit
    link, first = _between(near, index, pyramids, stops), fits[near]
    # An aligned frame in between passes on exactly the rotation that is applied to it.
    way = first.rotation if _alignment(first, False).rotation is not None else np.eye(3)
    error = math.hypot(link.error_deg, first.error_deg)
    return replace(link, rotation=link.rotation @ way, error_deg=error)


def _between(
    first: int, second: int, pyramids: Sequence[list[Level]], stops: Sequence[float]
) -> Fit:
    """Fit the rotation from one frame to another, starting from the brighter one."""
    if stops[first] >= stops[second]:
        return register(pyramids[first], pyramids[second])
    return register(pyramids[second], pyramids[first]).inverse
