"""Handing memory back to the system, and not looking for any where there is none."""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import gc
import sys
from collections.abc import Iterator
from functools import cache

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


@contextlib.contextmanager
def reading_in() -> Iterator[None]:
    """Read modules in: they stay to the end, so nobody looks for garbage among them.

    Else a full collection goes through every function of every library, and whatever is being
    done on the screens waits for it, for some 50 ms.

    Yields:
        None. While no garbage is collected; what there is in the end is never looked at again.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        # At the end all of it goes: some libraries complain of what is left.
        atexit.register(gc.unfreeze)
        if was:
            gc.enable()


@cache
def _library() -> ctypes.CDLL | None:
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    ours = hasattr(library, "malloc_trim") and hasattr(library, "mallopt")
    return library if ours else None
