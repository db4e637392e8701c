"""A job runner that does everything at once, in the caller's thread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from app.core.base.errors import Cancelled
from app.core.base.progress import Token, silent

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.base.progress import PhraseReport

T = TypeVar("T")


class ImmediateRunner:
    """Does everything at once, in the caller's thread: for tests."""

    def __init__(self) -> None:
        self.ran: list[str] = []

    def submit(
        self,
        key: str,
        work: Callable[[Token, PhraseReport], T],
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
