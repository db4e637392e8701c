"""Recognise errors that mean memory has run out, however a library reports them."""

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
"""Phrases, in lower case, with which libraries report that memory has run out."""

_MEGABYTE: Final = 1 << 20


class MemoryShort(CoreError):
    """The system is out of memory."""

    def __init__(self) -> None:
        super().__init__(
            tr("There is not enough memory to do this."),
            tr("Close other programs, or use a smaller file."),
        )


def is_memory_short(error: BaseException | None) -> bool:
    """Return whether an error or its cause means that memory has run out."""
    visited: set[int] = set()
    while error is not None and id(error) not in visited:
        visited.add(id(error))
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return True
        if not isinstance(error, CoreError) and says_memory_short(str(error)):
            return True
        error = error.__cause__ or error.__context__
    return False


def says_memory_short(words: str) -> bool:
    """Return whether a library's message means that memory has run out."""
    plain = words.casefold()
    return any(each in plain for each in _WORDS)


def check_limit(least: int) -> None:
    """Refuse to start with less address space than the libraries need.

    Some libraries abort the process when address space runs out.

    Args:
        least: Number of bytes needed.

    Raises:
        CoreError: If the limit is lower than `least`. The message states both.
    """
    if sys.platform == "win32":
        return
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < least:
        raise CoreError(
            tr(
                "This process may use only {most} MB of memory, but needs {least} MB.",
                most=limit // _MEGABYTE,
                least=least // _MEGABYTE,
            ),
            tr("Raise the limit with ulimit -v."),
        )
