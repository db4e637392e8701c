"""Frames that do not fit each other though nothing moved, and such as do not fill the picture."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.hdr.contradiction import CLIPPED, LOOSE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Bytes, Float32
    from app.core.hdr.contradiction import Predictions


_BLACK: Final = 8
_FEWEST: Final = 64  # pixels that say something
# What two of three pixels keep to, most keep to a multiple of.
_USUAL_SHARE: Final = 0.68
_MISFIT: Final = 4.0
_MOST_SLACK: Final = 0.8
_SHARED: Final = 0.05  # of the picture that two frames must both expose well to be compared
_SAME_PLACE: Final = 0.6  # rank correlation of two frames of one place, however they are toned


def fill_hidden(
    frames: list[Bytes], hidden: Sequence[Float32 | None], predictions: Predictions
) -> None:
    """Give frames beyond their edges what their nearest neighbours show: no contradiction."""
    shown = list(frames)
    for index, mask in enumerate(hidden):
        if mask is None:
            continue
        empty = mask == 0.0
        filled = frames[index].copy()
        for other in sorted(range(len(frames)), key=lambda k: abs(k - index))[1:]:
            given = hidden[other]
            here = empty if given is None else empty & (given > 0.0)
            filled[here] = predictions.as_seen(shown[other], other, index)[here]
            empty = empty & ~here
            if not empty.any():
                break
        frames[index] = filled


def misfit(frames: Sequence[Bytes], predictions: Predictions) -> float:
    """Say by how many stops most places of neighbouring frames differ beyond what is usual."""
    usual = []
    for k in range(len(frames) - 1):
        off = predictions.apart(frames[k], frames[k + 1], k)
        if off.size > _FEWEST:
            usual.append(float(np.quantile(np.abs(off), _USUAL_SHARE)))
    return min(max(0.0, _MISFIT * max(usual, default=0.0) - LOOSE.stops), _MOST_SLACK)


def hopeless(frames: Sequence[Bytes], share: float) -> str:
    """Say why what moved cannot be told: another place, or frames of one that do not fit."""
    if _alike(frames) > _SAME_PLACE:
        return (
            f"The frames do not fit each other over {100.0 * share:.0f} % of the picture, so that "
            "what moved cannot be told: they were averaged. Exposures or tone curves are not as "
            "stated."
        )
    return (
        f"The frames show different things over {100.0 * share:.0f} % of the picture. "
        "Shoot the bracket again if you can."
    )


def _alike(frames: Sequence[Bytes]) -> float:
    """Least correlation of the structure of neighbouring frames where both are well exposed."""
    least = 1.0
    for one, other in pairwise(frames):
        first, second = one[..., 1].ravel(), other[..., 1].ravel()
        both = (first > _BLACK) & (first <= CLIPPED) & (second > _BLACK) & (second <= CLIPPED)
        if np.count_nonzero(both) > max(_FEWEST, _SHARED * both.size):
            ranks = [np.argsort(np.argsort(part[both], kind="stable")) for part in (first, second)]
            one_way, other_way = (rank - rank.mean() for rank in ranks)
            size = math.sqrt(float(one_way @ one_way) * float(other_way @ other_way))
            least = min(least, float(one_way @ other_way) / max(size, 1.0))
    return least
