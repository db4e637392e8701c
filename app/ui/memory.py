"""Handing memory back to the system."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

__all__ = ["give_back", "keep_little"]

_MMAP_THRESHOLD, _ARENA_MAX = -3, -8  # numbers of malloc.h
_LARGE = 1 << 20  # bytes


def keep_little() -> None:
    """Have every large array handed back to the system as soon as it is freed.

    GNU's C library would keep more and more of them for the next one, and for each thread apart.
    Elsewhere nothing is done.
    """
    library = _library()
    if library is not None:
        library.mallopt(_MMAP_THRESHOLD, _LARGE)
        library.mallopt(_ARENA_MAX, 2)


def give_back() -> None:
    """Hand the memory that was freed back to the system.

    GNU's C library keeps what a thread has freed for that thread; with several threads at work on
    large pictures that is several times what is in use. Elsewhere nothing is done.
    """
    library = _library()
    if library is not None:
        library.malloc_trim(ctypes.c_size_t(0))


@cache
def _library() -> ctypes.CDLL | None:
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    ours = hasattr(library, "malloc_trim") and hasattr(library, "mallopt")
    return library if ours else None
