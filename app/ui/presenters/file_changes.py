"""Changes of the user's files: one after the other, none left out, and each can be undone."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from app.core.base.progress import Report, Token
from app.ui.presenters.services import Services
from app.ui.presenters.undo import Undoable, UndoStack

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


class FileChange(Generic[T]):
    """A change of the user's files that can be undone; each way it waits for its turn.

    It is in the list from the moment it is asked for: whoever undoes at once undoes this, and
    nothing that came before it.
    """

    def __init__(
        self,
        stack: UndoStack,
        files: SerialQueue,
        words: str,
        make: Callable[[], T],
        back: Callable[[T], Any],
        *,
        made: Callable[[T], None],
        undone: Callable[[Any], None],
        failed: Callable[[Exception], None],
        before: Callable[[], None] = lambda: None,
    ) -> None:
        self._stack, self._files = stack, files
        self._make, self._back = make, back
        self._made, self._undone, self._failed = made, undone, failed
        self._before = before
        self._kept: T | None = None
        self.step = Undoable(words, self._take_back, self._again, kept=lambda: self._kept)

    def begin(self) -> None:
        """Do it for the first time."""
        self._before()
        self._stack.push(self.step)
        self._submit(self._make, self._is_made, lambda: self._stack.drop(self.step))

    def take_back(self) -> None:
        """Undo it, whatever has been done since."""
        self._stack.take_back(self.step)

    def _again(self) -> None:
        self._before()
        self._submit(
            self._make, self._is_made, lambda: self._stack.failed(self.step, undoing=False)
        )

    def _take_back(self) -> None:
        def work() -> Any:
            return None if self._kept is None else self._back(self._kept)

        def done(answer: Any) -> None:
            if self._kept is not None:
                self._kept = None
                self._undone(answer)

        self._submit(work, done, lambda: self._stack.failed(self.step, undoing=True))

    def _is_made(self, kept: T) -> None:
        self._kept = kept
        self._made(kept)

    def _submit(
        self, work: Callable[[], Any], done: Callable[[Any], None], undo_list: Callable[[], None]
    ) -> None:
        def failed(error: Exception) -> None:
            undo_list()
            self._failed(error)

        self._files.submit(
            lambda token, report: work(), done=done, failed=failed, cancelled=undo_list
        )
