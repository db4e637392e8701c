"""Compare a video with a measured place and save its frames as photos.

A panorama shows the light that reaches the head, and a video shows how that light falls on the
sitter's own face. If both exist, the video is the ground truth, and the error in the panorama's
turns is reported.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import ProbeError
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading import find_heading
from app.core.localization.heading_conversion import turn_of_heading
from app.core.measure.film.film import Film, flip
from app.core.solver.place_light import PlaceLight
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack
from app.core.text import tr

GLANCES: Final = 16
"""Number of frames that are used to locate a video in a panorama."""

_SAME_DEG: Final = 10.0  # maximum difference between the frames that are located
_FEWEST: Final = 3
_AGREED_DEG: Final = 5


@dataclass(frozen=True, slots=True)
class Beside:
    """A comparison between a video and a place.

    Attributes:
        offset_deg: Azimuth of the lens in the panorama at the start of the video.
        apart_deg: The video's turn minus the panorama's turn, for each style that both offer.
    """

    offset_deg: float
    apart_deg: Mapping[str, float]

    @property
    def typical_deg(self) -> int | None:
        """The median difference of the turns in whole degrees, or None if they share no style."""
        apart = np.abs([*self.apart_deg.values()])
        return round(float(np.median(apart))) if self.apart_deg else None

    @property
    def agree(self) -> bool:
        """Whether the video and the panorama yield the same turns."""
        return self.typical_deg is not None and self.typical_deg <= _AGREED_DEG


def looks_mirrored(
    frames: Iterable[tuple[float, float, Bytes]], index: HeadingIndex
) -> bool | None:
    """Return whether only the mirrored video fits a place, or None if neither version does.

    Args:
        frames: A dozen frames of the video, as for `read_film`.
    """
    votes = [0, 0]
    for _, _, picture in frames:
        for way, view in enumerate((picture, flip(picture))):
            votes[way] += find_heading(view, index, None).heading_deg is not None
        if max(votes) >= _FEWEST and min(votes) == 0:
            break
    return None if max(votes) < _FEWEST or votes[0] == votes[1] else votes[1] > votes[0]


def beside(
    film: Film,
    results: Sequence[StyleResult],
    frames: Iterable[tuple[float, float, Bytes]],
    place: PlaceLight,
    pack: StylePack,
    index: HeadingIndex | None = None,
) -> Beside:
    """Locate a video in a place's panorama by the background and compare the turns of the two.

    Args:
        results: The results for the video.
        frames: A dozen frames of the video, as for `read_film`.
        index: Index of the place's panorama, or None to build it.

    Raises:
        ProbeError: If the video shows a different place.
    """
    index = index or build_index(place.display)
    turns = [
        turn_of_heading(heading) - float(np.interp(time_s, film.times_s, film.headings.turns_deg))
        for time_s, _, picture in frames
        if (heading := find_heading(picture, index, None).heading_deg) is not None
    ]
    groups = [
        [wrap(two - one) for two in turns if abs(wrap(two - one)) < _SAME_DEG] for one in turns
    ]
    most = max(groups, key=len, default=[])
    if len(most) < _FEWEST:
        raise ProbeError(
            tr("The film does not show enough of this place to compare it with the panorama."),
            tr("Open it as a separate place."),
        )
    offset = wrap(turns[groups.index(most)] + float(np.median(most)))
    own = {one.name: one for one in solve_all(pack, place.searched) if one.attainable}
    apart = {
        one.name: wrap(one.turn_refined_deg + offset - own[one.name].turn_refined_deg)
        for one in results
        if one.attainable and one.name in own
    }
    return Beside(offset, apart)
