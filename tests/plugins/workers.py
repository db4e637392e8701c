"""Choose how many processes share the tests: `-n auto` counts cores and free memory."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

import psutil
import pytest

WORKER_BYTES: Final = 1_000_000_000  # what one process may hold, see `tests.plugins.memory`
SPARE_BYTES: Final = 1_000_000_000  # for the other programs, and for the programs that tests start
MOST: Final = 16  # every process imports all test files first: more of them save nothing
_CGROUP: Final = Path("/sys/fs/cgroup")


def worker_count(cores: int, free_bytes: int) -> int:
    """Fit the processes to cores and memory; always at least one.

    Examples:
        >>> worker_count(8, 16_000_000_000)
        8
        >>> worker_count(8, 4_500_000_000)
        3
    """
    return max(1, min(cores, (free_bytes - SPARE_BYTES) // WORKER_BYTES, MOST))


def free_memory(cgroup: Path = _CGROUP) -> int:
    """Return the bytes that can be taken without swapping, inside a container's limit."""
    free = int(psutil.virtual_memory().available)
    try:
        limit = int((cgroup / "memory.max").read_text())  # "max" where there is no limit
        used = int((cgroup / "memory.current").read_text())
    except (OSError, ValueError):
        return free
    return min(free, max(0, limit - used))


def cores() -> int:
    """Return the processors this process may use, which can be fewer than the machine has."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Answer `-n auto`; one worker means no second process at all."""
    named = os.environ.get("PYTEST_XDIST_AUTO_NUM_WORKERS", "")
    # Long tests often wait for other processes: one more test uses the processors meanwhile.
    spare = int(config.option.markexpr.startswith("slow"))
    count = int(named) if named.isdecimal() else worker_count(cores() + spare, free_memory())
    return count if count > 1 else 0


def pytest_report_header() -> str:
    """Show what the number of processes follows from."""
    return f"machine: {cores()} cores, {free_memory() / 1e9:.1f} GB free"
