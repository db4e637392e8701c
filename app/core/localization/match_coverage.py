"""Whether the whole of a picture bears a pose out, and not only the points that it was made from.

A thing that stands twice in a place, or a pattern, makes a few points agree with a wrong pose. But
then the rest of the picture shows something else. So all points of the picture are asked, those
too that matched nothing for certain: does the panorama, where the pose says, show something more
like it than a few degrees to the left, the right, above and below? By chance one in five says yes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere

if TYPE_CHECKING:
    from app.core.localization.rotation import Pose

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_REACH_RAD: Final = math.radians(2.0)
_ASIDE_RAD: Final = math.radians(7.0)
_ASIDE: Final = ((0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0))
_AROUND_RAD: Final = math.radians(62.0)
_LEAST: Final = 12
_STRAY_RAD: Final = math.radians(10.0)
_SOME: Final = 4  # as if so many more agreed: of a few points two strays say little


def support(rays: Float64, described: Float32, spots: Float32, known: Float32, pose: Pose) -> float:
    """Measure how much better a pose explains all points than its neighbours do.

    Parameters
    ----------
    rays : (N, 2) float64
        All points of the picture, in its picture plane as in `app.core.localization.rotation.fit`.
    described : (N, 128) float32
        What they look like; unit length.
    spots : (M, 3) float32
        Points of the panorama, unit vectors in its axes.
    known : (M, 128) float32
        What they look like.

    Returns
    -------
    float
        Standard deviations above what chance would give: about 0 for a wrong pose.
    """
    axis = pose.rotation[:, 2].astype(np.float32)
    near = np.flatnonzero(spots @ axis > math.cos(_AROUND_RAD))
    if len(near) < _LEAST or len(rays) < _LEAST:
        return 0.0
    likeness = described @ known[near].T
    ahead = pose.expected(rays)
    best = _most_alike(ahead, pose.rotation, spots[near], likeness)
    others = np.full(len(rays), -1.0, np.float32)
    for up, right in _ASIDE:
        turn = sphere.from_vector(np.array([up * _ASIDE_RAD, right * _ASIDE_RAD, 0.0]))
        aside = _most_alike(ahead, pose.rotation @ turn, spots[near], likeness)
        np.maximum(others, aside, out=others)
    asked = (best > 0.0) & (others > 0.0)
    count = int(asked.sum())
    if count < _LEAST:
        return 0.0
    chance = 1.0 / (1.0 + len(_ASIDE))
    share = float((best[asked] > others[asked]).mean())
    return (share - chance) / math.sqrt(chance * (1.0 - chance) / count)


def strays(rays: Float64, bearings: Float64, inside: NDArray[np.bool_], pose: Pose) -> float:
    """Measure how many points are beside where a pose says, and not there.

    Parameters
    ----------
    rays : (N, 2) float64
        Points in the picture plane whose likeness in the panorama is certain.
    bearings : (N, 3) float64
        Where the panorama shows that, unit vectors in its axes.
    inside : (N,) bool
        Whether they agree with the pose.

    Returns
    -------
    float
        Their share, 0 to 1, of them and those that agree.
    """
    beside = np.einsum("nk,nk->n", pose.expected(rays), bearings @ pose.rotation)
    count = int((~inside & (beside > math.cos(_STRAY_RAD))).sum())
    return count / (count + int(inside.sum()) + _SOME)


def _most_alike(ahead: Float64, rotation: Float64, spots: Float32, likeness: Float32) -> Float32:
    """Likeness of the most alike point near where each is expected; -1 where there is none."""
    beside = (ahead @ rotation.T).astype(np.float32) @ spots.T > math.cos(_REACH_RAD)
    return np.asarray(np.where(beside, likeness, np.float32(-1.0)).max(axis=1), np.float32)
