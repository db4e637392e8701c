"""A mailbox for the newest frame of a camera's thread.

A slow reader sees fewer frames, never old ones, and no queue grows.
"""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

T = TypeVar("T")


class Mailbox(Generic[T]):
    """Holds the newest item until it is taken; any number of threads may use it.

    It waits on the machine's own clock, since it only connects two threads of this process.

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
        """Put an item in; it replaces one that was not taken."""
        with self._changed:
            self._item = item
            self._changed.notify()

    def get(self, timeout_s: float = 0.0) -> T | None:
        """Take the newest item; None if there is none in time.

        `timeout_s`: how long to wait in real seconds; 0 does not wait.
        """
        with self._changed:
            if timeout_s > 0.0:
                self._changed.wait_for(lambda: self._item is not None, timeout_s)
            item, self._item = self._item, None
            return item
