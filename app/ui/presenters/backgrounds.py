"""The feature points of the panoramas, which Turn needs to locate the live camera.

They are computed while the gallery is being looked at, or when Turn needs them, whichever comes
first.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.progress import Report, Token
from app.core.solver.place_light import PlaceLight

if TYPE_CHECKING:
    from app.core.localization.features import HeadingIndex

_PLACES: Final = 3  # number of indexes kept in memory, about 5 MB each
_COARSE: Final = 4
_WAIT_S: Final = 0.05


class Backgrounds:
    """Computes the index of each panorama once. Any thread may call any method."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._indexes: OrderedDict[bytes, HeadingIndex] = OrderedDict()

    def at_hand(self, light: PlaceLight) -> HeadingIndex | None:
        """Return the index of a panorama, or None if it must be read or computed first."""
        return self._indexes.get(_key(light))

    def find(
        self, light: PlaceLight, folder: Path | None, token: Token, report: Report
    ) -> HeadingIndex:
        """Return the index of a panorama, if necessary once another thread has computed it.

        Args:
            folder: Folder of the place, which may hold a saved index, or None if the place has not
                been saved.

        Raises:
            CoreError: If the panorama has too few points.
            Cancelled: If the token is cancelled.
        """
        # Import here, as the window must open fast.
        from app.core.localization.features import build_index, read_index

        while not self._lock.acquire(timeout=_WAIT_S):
            token.check()
        try:
            key = _key(light)
            index = self._indexes.pop(key, None)
            if index is None and folder is not None:
                index = read_index(folder, light.display)
            if index is None:
                index = build_index(light.display, token, report)
            self._indexes[key] = index
            while len(self._indexes) > _PLACES:
                self._indexes.popitem(last=False)
            return index
        finally:
            self._lock.release()


def _key(light: PlaceLight) -> bytes:
    """Return a hash of the panorama, which stays the same when the place is reopened."""
    coarse = np.ascontiguousarray(light.display[::_COARSE, ::_COARSE])
    return hashlib.blake2b(coarse.tobytes(), digest_size=16).digest()
