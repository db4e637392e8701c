"""Plain callbacks: who wants to know is told, in the order of asking."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

Callback: TypeAlias = Callable[..., None]


class Event:
    """Something that happens from time to time. To be used on one thread only.

    Examples:
        >>> heard: list[int] = []
        >>> event = Event()
        >>> event.connect(heard.append)
        >>> event.emit(3)
        >>> heard
        [3]
    """

    def __init__(self) -> None:
        self._callbacks: tuple[Callback, ...] = ()

    def connect(self, callback: Callback) -> None:
        """Call `callback` whenever it happens; asking twice changes nothing."""
        if callback not in self._callbacks:
            self._callbacks = (*self._callbacks, callback)

    def disconnect(self, callback: Callback) -> None:
        """Do not call `callback` any more; who never asked is not missed."""
        self._callbacks = tuple(known for known in self._callbacks if known != callback)

    def emit(self, *values: Any) -> None:
        """Tell all who asked.

        Who is disconnected meanwhile, by another callback, is not told any more.
        """
        for callback in self._callbacks:
            if callback in self._callbacks:
                callback(*values)
