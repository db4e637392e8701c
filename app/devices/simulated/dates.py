"""What a simulated camera takes the date to be."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Final

_FORM: Final = "%Y:%m:%d %H:%M:%S"
_START: Final = datetime(2026, 6, 21, 12, 0, 0)


class CameraDate:
    """Local time with an offset that is only ever repeated.

    Parameters
    ----------
    now : float
        The clock's reading at which the date begins, in seconds.
    """

    def __init__(self, now: float, year: int | None = None) -> None:
        self._base = _START if year is None else datetime(year, 1, 1)
        self._since = now
        self._offset = "+02:00" if year is None else "+00:00"
        self.unset = year is not None

    def set(self, text: str, now: float) -> None:
        """Set date and time.

        Raises
        ------
        ValueError
            For a day or an hour that there is none of.
        """
        self._base = datetime.strptime(text[:19], _FORM)
        self._since = now
        self._offset = text[19:] or self._offset
        self.unset = False

    def stamp(self, now: float) -> str:
        """Local time as EXIF writes it."""
        return (self._base + timedelta(seconds=now - self._since)).strftime(_FORM)

    def text(self, now: float) -> str:
        """Local time with its offset, as options and file lists have it."""
        return self.stamp(now) + self._offset

    @property
    def offset(self) -> str:
        """Offset from UTC, "+02:00"."""
        return self._offset
