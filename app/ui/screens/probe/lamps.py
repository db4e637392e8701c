"""The lamps at the place, as rows of the table below the panorama."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.base.angles import wrap
from app.core.measure.finish.findings import Findings, LampFinding
from app.core.text import tr
from app.words.lights import NAMES, share_words
from app.words.phrases.directions import direction_words, elevation_words
from app.words.phrases.turns import signed


@dataclass(frozen=True, slots=True)
class LampRow:
    """A lamp in the table and on the panorama.

    Attributes:
        letter, name: Display text such as "A" and "Window".
        azimuth, elevation, share: Display text such as "47°", "30° up" and "at least 64%".
        azimuth_deg, elevation_deg: Direction in the original panorama, in degrees.
        spoken: Text of the whole row for screen readers.
    """

    letter: str
    name: str
    where: str
    azimuth: str
    elevation: str
    share: str
    clipped: bool
    azimuth_deg: float
    elevation_deg: float
    spoken: str


def lamp_rows(findings: Findings, front_deg: float, *, rough: bool = False) -> tuple[LampRow, ...]:
    """Return the rows of the table. If the place is `rough`, clipped light is only an estimate."""
    return tuple(_lamp_row(lamp, front_deg, rough) for lamp in findings.lamps)


def _lamp_row(lamp: LampFinding, front_deg: float, rough: bool) -> LampRow:
    azimuth = wrap(lamp.azimuth_deg - front_deg)
    share = share_words(lamp.share, lamp.clipped and not rough)
    words = {
        "letter": lamp.letter,
        "name": NAMES[lamp.kind],
        "where": direction_words(azimuth, lamp.elevation_deg, of_sitter=True),
        "azimuth": signed(azimuth),
        "elevation": elevation_words(lamp.elevation_deg),
        "share": tr("perhaps {share}", share=share) if rough and lamp.clipped else share,
    }
    spoken = tr(
        "{letter}, {name}, {where}, azimuth {azimuth}, elevation {elevation}, share {share}",
        **words,
    )
    return LampRow(
        **words,
        clipped=lamp.clipped,
        azimuth_deg=lamp.azimuth_deg,
        elevation_deg=lamp.elevation_deg,
        spoken=tr("{spoken}, clipped", spoken=spoken) if lamp.clipped else spoken,
    )
