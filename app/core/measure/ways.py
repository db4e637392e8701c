"""The table of measuring methods, and the function that measures light with one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.core.base.progress import Report, Token, silent
from app.core.measure.ball import measure as ball
from app.core.measure.bracket import measure as bracket
from app.core.measure.film import measure as film
from app.core.measure.film.movie_header import VIDEO_ENDINGS
from app.core.measure.fisheye import measure as fisheye
from app.core.measure.measurement import Entry, Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.photos import measure as photos
from app.core.measure.read.metadata import FRAME_ENDINGS
from app.core.measure.single import measure as single


@dataclass(frozen=True, slots=True)
class MeasuringWay:
    """One method of measuring light.

    Attributes:
        endings: File suffixes that the method accepts, in lower case.
        most: Maximum number of files.
        on_wish: Whether the user has to choose this method because the files do not reveal it.
    """

    key: str
    entry: Entry
    endings: frozenset[str]
    most: int
    on_wish: bool = False

    def takes(self, file: Path) -> bool:
        """Return whether this method accepts a file, judging by the file's suffix."""
        return file.suffix.lower() in self.endings


_PICTURES: Final = frozenset(FRAME_ENDINGS)

WAYS: Final = {
    way.key: way
    for way in (
        MeasuringWay("single", single.measure, _PICTURES, 1),
        MeasuringWay("bracket", bracket.measure, _PICTURES, 64),
        MeasuringWay("film", film.measure, frozenset(VIDEO_ENDINGS), 1),
        MeasuringWay("fisheye", fisheye.measure, _PICTURES, 64, on_wish=True),
        MeasuringWay("ball", ball.measure, _PICTURES, 64, on_wish=True),
        MeasuringWay("photos", photos.measure, _PICTURES, 200, on_wish=True),
    )
}
"""All measuring methods by key. The key is also the name of the package for that method."""


def way_of(files: Sequence[Path], wish: str) -> MeasuringWay | None:
    """Choose a measuring method by the files' names, or return None if no method accepts them.

    Args:
        wish: Key of the preferred method, which is chosen if it accepts any of the files. An
            unknown key is ignored.
    """
    choice = WAYS.get(wish)
    if choice is not None and any(choice.takes(file) for file in files):
        return choice
    offered = [way for way in WAYS.values() if not way.on_wish]
    first = next((way for way in offered if any(way.takes(file) for file in files)), None)
    if first is None:
        return None
    count = sum(first.takes(file) for file in files)
    alike = [way for way in offered if way.endings == first.endings]
    return next((way for way in alike if count <= way.most), alike[-1])


def measure(
    way: str,
    files: Sequence[Path],
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> Measurement:
    """Measure the light at a place from files or from one folder.

    The errors are those of `Entry`.

    Args:
        way: Key in `WAYS`.
    """
    return WAYS[way].entry(files, options or MeasureOptions(), token or Token(), report)
