"""A film of a turn in a place: its own frames as photographs, and what it says of a measured light.

A panorama tells what light reaches the head, a film what it does to the sitter's own face: where
both are there, the film is the truth, and by how much the panorama's turns differ from it is told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Float32
from app.core.base.colour import luminance
from app.core.base.errors import CoreError, ProbeError
from app.core.base.images import write_png
from app.core.film.film import Film
from app.core.hdr.resampling import likeness, log_light
from app.core.solver.environment import reduce_radiance, solid_angles
from app.core.solver.place_light import PlaceLight
from app.core.solver.portraits import value_at
from app.core.solver.solve import StyleResult, solve_all
from app.core.solver.style_pack import StylePack
from app.core.storage.places.shots import Shot, add_shot
from app.core.text import tr

_ROWS: Final = 64
_LEVEL: Final = slice(_ROWS // 4, 3 * _ROWS // 4)  # what a film shows: neither zenith nor ground
_LEAST_ALIKE: Final = 0.3
_AGREED_DEG: Final = 5.0


@dataclass(frozen=True, slots=True)
class Beside:
    """A film beside a place's panorama.

    `offset_deg`: azimuth in the panorama at which the lens stood when the film began.
    `apart_deg`: by style that both offer, how much further the film turns than the panorama.
    """

    offset_deg: float
    apart_deg: Mapping[str, float]

    @property
    def words(self) -> str:
        """Whether both agree, and what to do where they do not."""
        if not self.apart_deg:
            return tr("Film and panorama offer no style in common: trust the film.")
        middle = float(np.median(np.abs([*self.apart_deg.values()])))
        facts = {"deg": round(middle), "count": len(self.apart_deg)}
        if middle <= _AGREED_DEG:
            return tr("Film and panorama agree: {deg}° apart, median of {count} styles.", **facts)
        return tr(
            "Film and panorama disagree: {deg}° apart, median of {count} styles. Trust the film; "
            "if the light has changed, measure again.", **facts,
        )  # fmt: skip


def beside(
    film: Film, results: Sequence[StyleResult], place: PlaceLight, pack: StylePack
) -> Beside:
    """Lay a film on a place's panorama and compare their turns.

    Args:
        results: Of the film.

    Raises:
        ProbeError: If the film shows another place.
    """
    offset = _offset(film.radiance, place.environment.radiance)
    own = {one.name: one for one in solve_all(pack, place.searched) if one.attainable}
    apart = {
        one.name: wrap(one.turn_refined_deg + offset - own[one.name].turn_refined_deg)
        for one in results
        if one.attainable and one.name in own
    }
    return Beside(offset, apart)


def _offset(filmed: Float32, panorama: Float32) -> float:
    """By how many degrees a film's panorama is turned in another of the same place."""
    shape = (_ROWS, 2 * _ROWS)
    looks = [log_light(luminance(reduce_radiance(each, shape))) for each in (panorama, filmed)]
    weight = np.zeros(shape, np.float32)
    weight[_LEVEL] = solid_angles(shape)[_LEVEL, None]
    alike = [likeness(looks, (weight, weight), shift) for shift in range(shape[1])]
    best = int(np.argmax(alike))
    if alike[best] < _LEAST_ALIKE:
        raise ProbeError(
            tr("The film was not taken in this place, or its light is quite another now."),
            tr("Open it as a place of its own."),
        )
    before, here, after = (alike[(best + step) % shape[1]] for step in (-1, 0, 1))
    part = 0.5 * (after - before) / max(2.0 * here - before - after, 1e-9)
    return wrap((best + part) * 360.0 / shape[1])


def keep_frames(
    folder: Path,
    film: Film,
    results: Sequence[StyleResult],
    now: datetime,
    offset_deg: float = 0.0,
) -> None:
    """Keep, for each style that a film offers, its own frame as a photograph of the place.

    What cannot be kept is left out.
    """
    with TemporaryDirectory() as work, suppress(CoreError, OSError):
        for result in results:
            turn = result.turn_refined_deg
            frame, clock = film.frame_at(turn), film.clock_at(turn)
            picture = film.pictures[frame] if result.attainable else None
            if picture is None:
                continue
            photo = Path(work) / f"{result.name} {clock.replace(':', '-')}.frame.png"
            write_png(photo, picture)
            nose = float(film.noses_deg[frame])
            shot = Shot(
                tr("Film {clock}", clock=clock),
                now.isoformat(),
                True,
                result.name,
                result.title,
                wrap(turn + offset_deg),
                facing_deg=wrap(nose + offset_deg),
                sitter_deg=0.0,
                confidence=float(film.trust[frame]),
                match=int(value_at(result.match_curve, nose)),
                best=int(result.match),
            )
            add_shot(folder, photo, shot, picture)
