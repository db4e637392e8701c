"""A place for one thing, the newest: frames go from a camera's thread to whoever looks at them.

A slow reader sees fewer frames, never older ones, and nothing grows.
"""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

T = TypeVar("T")


class Mailbox(Generic[T]):
    """Holds the newest item until somebody takes it; any number of threads may use it.

    Its waits are on the machine's own clock: they hand something over between two threads of this
    process, and no time of a camera's is in them.

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
        self._closed = False
        self._replaced = 0

    def put(self, item: T) -> None:
        """Put an item in, in place of one that nobody has taken."""
        with self._changed:
            if self._closed:
                return
            self._replaced += self._item is not None
            self._item = item
            self._changed.notify()

    def get(self, timeout_s: float = 0.0) -> T | None:
        """Take the newest item.

        `timeout_s`: how long to wait for one where there is none, in real seconds; 0 looks only.
        None when nothing came in time or the mailbox was closed. What was in it when it was closed
        can still be taken.
        """
        with self._changed:
            if timeout_s > 0.0:
                self._changed.wait_for(self._ready, timeout_s)
            item, self._item = self._item, None
            return item

    def close(self) -> None:
        """Take nothing more in, and wake everybody who waits; closing again changes nothing."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        """Whether it was closed."""
        return self._closed

    @property
    def replaced(self) -> int:
        """How many items nobody took before the next one came."""
        return self._replaced

    def _ready(self) -> bool:
        return self._item is not None or self._closed
