"""Long work seen from a presenter: what to do, and what to do with its answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from app.core.base.errors import Cancelled
from app.core.base.progress import Token, silent

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.base.progress import Report

T = TypeVar("T")


class Runner(Protocol):
    """Runs long work somewhere else and brings its answer back to the thread of the screens."""

    def submit(
        self,
        key: str,
        work: Callable[[Token, Report], T],
        *,
        title: str = "",
        done: Callable[[T], None] | None = None,
        failed: Callable[[Exception], None] | None = None,
        cancelled: Callable[[], None] | None = None,
    ) -> None:
        """Start `work`; an older one of the same key is cancelled and answers no more.

        Parameters
        ----------
        done, failed, cancelled : callable, optional
            Exactly one of them is called, on the thread of the screens. A failure that nobody
            takes is told to the user.
        """

    def cancel(self, key: str) -> None:
        """Ask the work of this key to stop; none running is no fault."""

    def running(self, key: str) -> bool:
        """Whether work of this key has not yet answered."""


class ImmediateRunner:
    """Does everything at once, in the caller's thread: for tests."""

    def __init__(self) -> None:
        self.ran: list[str] = []

    def submit(
        self,
        key: str,
        work: Callable[[Token, Report], T],
        *,
        title: str = "",
        done: Callable[[T], None] | None = None,
        failed: Callable[[Exception], None] | None = None,
        cancelled: Callable[[], None] | None = None,
    ) -> None:
        """Do the work now; see `Runner.submit`."""
        del title
        self.ran.append(key)
        try:
            answer = work(Token(), silent)
        except Cancelled:
            _call(cancelled)
        except Exception as error:
            if failed is None:
                raise
            failed(error)
        else:
            _call(done, answer)

    def cancel(self, key: str) -> None:
        """Nothing is ever running."""
        del key

    def running(self, key: str) -> bool:
        """Nothing is ever running."""
        del key
        return False


def _call(callback: Callable[..., None] | None, *values: Any) -> None:
    if callback is not None:
        callback(*values)
