"""Running out of memory: how libraries show it, and what the user reads."""

from __future__ import annotations

import errno
import sys
from typing import Final

from app.core.base.errors import CoreError
from app.core.text import tr

_WORDS: Final = (
    *("bad_alloc", "insufficient memory", "failed to allocate", "cannot allocate memory"),
    *("can't start new thread", "failed to map segment", "out of memory", "could not allocate"),
    *("thread-local", "not enough memory", "unable to allocate", "can't allocate"),
)
"""In what libraries say when the system gives no more memory, also for a thread or a library."""

_MEGABYTE: Final = 1 << 20


class MemoryShort(CoreError):
    """The system gives no more memory."""

    def __init__(self) -> None:
        super().__init__(
            tr("There is not enough memory for this."),
            tr("Close other programs, or use a smaller file."),
        )


def is_memory_short(error: BaseException | None) -> bool:
    """Whether an error, or one that it came of, is that the system gives no more memory."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return True
        if not isinstance(error, CoreError) and says_memory_short(str(error)):
            return True
        error = error.__cause__ or error.__context__
    return False


def says_memory_short(words: str) -> bool:
    """Whether a library says that the system gives no more memory."""
    plain = words.casefold()
    return any(each in plain for each in _WORDS)


def check_limit(least: int) -> None:
    """Refuse early where this process may have less address space than its libraries take.

    Some of them end the process when there is no more.

    Args:
        least: bytes.

    Raises `CoreError` with both numbers.
    """
    if sys.platform == "win32":
        return
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < least:
        raise CoreError(
            tr(
                "This process may use only {most} MB of memory and needs {least} MB.",
                most=limit // _MEGABYTE,
                least=least // _MEGABYTE,
            ),
            tr("Raise the limit: ulimit -v."),
        )
