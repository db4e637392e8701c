"""Why a file could not be written, in a few words."""

from __future__ import annotations

import errno
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

_NO_ROOM: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
_LOCKED: Final = frozenset({errno.EROFS, errno.EACCES, errno.EPERM})
_FULL: Final = ("no space left", "disk full", "disk is full", "not enough space", "file too large")
_DENIED: Final = ("read-only", "not writable", "permission denied")


def is_full(error: BaseException) -> bool:
    """Whether there was no room, as the system says or as a message tells."""
    return _is(error, _NO_ROOM, _FULL)


def disk_words(error: BaseException) -> str:
    """Say why nothing was written: "the disk is full"; "" where it is something else."""
    if is_full(error):
        return "the disk is full"
    return "its folder cannot be written to" if _is(error, _LOCKED, _DENIED) else ""


def _is(error: BaseException, codes: frozenset[int], words: tuple[str, ...]) -> bool:
    causes = tuple(_causes(error))
    if any(one.errno in codes for one in causes if isinstance(one, OSError)):
        return True
    # Image libraries know no numbers; the words of ours that came from them are all there is.
    return any(each in str(one).lower() for one in causes for each in words)


def _causes(error: BaseException) -> Iterator[BaseException]:
    here: BaseException | None = error
    for _ in range(10):
        if here is None:
            return
        yield here
        here = here.__cause__
