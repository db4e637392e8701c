"""Work that has to be done whatever else is asked for: one after the other, none left out."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.base.progress import Report, Token
    from app.ui.presenters.services import Services

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class _Turn:
    """One piece of work that waits."""

    work: Callable[[Token, Report], Any]
    title: str
    done: Callable[[Any], None] | None
    failed: Callable[[Exception], None]
    cancelled: Callable[[], None] | None


class SerialQueue:
    """Does what changes files in the order in which it was asked for.

    A runner cancels older work of the same key, and then tells nobody how it ended. That is right
    for answers; of two styles that are deleted one after the other both are to be deleted.
    """

    def __init__(self, services: Services, key: str) -> None:
        self._services = services
        self._key = key
        self._waiting: deque[_Turn] = deque()
        self._busy = False

    def submit(
        self,
        work: Callable[[Token, Report], T],
        *,
        title: str = "",
        done: Callable[[T], None] | None = None,
        failed: Callable[[Exception], None] | None = None,
        cancelled: Callable[[], None] | None = None,
    ) -> None:
        """Do it once everything before it has ended; see `Runner.submit`."""
        told = failed or self._services.notify.tell_error
        self._waiting.append(_Turn(work, title, done, told, cancelled))
        self._next()

    def _next(self) -> None:
        if self._busy or not self._waiting:
            return
        self._busy = True
        turn = self._waiting.popleft()
        self._services.runner.submit(
            self._key,
            turn.work,
            title=turn.title,
            done=lambda answer: self._ended(turn.done, answer),
            failed=lambda error: self._ended(turn.failed, error),
            cancelled=lambda: self._ended(turn.cancelled),
        )

    def _ended(self, call: Callable[..., None] | None, *answer: object) -> None:
        self._busy = False
        try:
            if call is not None:
                call(*answer)
        finally:
            self._next()
