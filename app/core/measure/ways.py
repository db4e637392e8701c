"""The ways to measure light: which files each takes, and its entry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.core.base.progress import Report, Token, silent
from app.core.measure.ball import measure as ball
from app.core.measure.bracket import measure as bracket
from app.core.measure.fisheye import measure as fisheye
from app.core.measure.measurement import Entry, Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.photos import measure as photos
from app.core.measure.read.metadata import FRAME_ENDINGS
from app.core.measure.single import measure as single


@dataclass(frozen=True, slots=True)
class MeasuringWay:
    """One way to measure light.

    Attributes:
        endings: Of the files that it takes, in lower case.
        most: Files of one measurement.
    """

    key: str
    entry: Entry
    endings: frozenset[str]
    most: int

    def takes(self, file: Path) -> bool:
        """Whether a file's name fits."""
        return file.suffix.lower() in self.endings


_PICTURES: Final = frozenset(FRAME_ENDINGS)

WAYS: Final = {
    way.key: way
    for way in (
        MeasuringWay("single", single.measure, _PICTURES, 1),
        MeasuringWay("bracket", bracket.measure, _PICTURES, 64),
        MeasuringWay("fisheye", fisheye.measure, _PICTURES, 64),
        MeasuringWay("ball", ball.measure, _PICTURES, 64),
        MeasuringWay("photos", photos.measure, _PICTURES, 200),
    )
}
"""By key; a package of that name beside this module measures."""


def measure(
    way: str,
    files: Sequence[Path],
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> Measurement:
    """Measure the light of a place by files, or one folder of them; raises as `Entry`.

    Args:
        way: Key of `WAYS`.
    """
    return WAYS[way].entry(files, options or MeasureOptions(), token or Token(), report)
