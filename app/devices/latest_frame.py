"""A mailbox for the newest frame from a camera's thread.

A slow reader gets fewer frames but never old ones, and no queue builds up.
"""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

T = TypeVar("T")


class Mailbox(Generic[T]):
    """Holds the newest item until it is read. Any number of threads may use it.

    The mailbox waits in real time, since it only connects two threads of this process.

    Examples:
        >>> box: Mailbox[str] = Mailbox()
        >>> box.put("old")
        >>> box.put("new")
        >>> box.get()
        'new'
        >>> box.get() is None
        True
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._item: T | None = None

    def put(self, item: T) -> None:
        """Store an item, replacing any that has not been read."""
        with self._changed:
            self._item = item
            self._changed.notify()

    def get(self, timeout_s: float = 0.0) -> T | None:
        """Remove and return the newest item, or return None if none arrives in time.

        Args:
            timeout_s: Time to wait in real seconds, or 0 to return at once.
        """
        with self._changed:
            if timeout_s > 0.0:
                self._changed.wait_for(lambda: self._item is not None, timeout_s)
            item, self._item = self._item, None
            return item
