"""The window in a process of its own, drawn in memory, which a test may kill."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from app.ui.shell.log import LOG, LOGS
from app.ui.shell.one_window import ADDRESS

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 120.0


def start_window(home: Path, *words: object) -> subprocess.Popen[str]:
    """Start `turnlight` on a data folder."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "app", *map(str, words)],
        cwd=ROOT,
        env={**os.environ, "TURNLIGHT_HOME": str(home), "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@contextmanager
def window(home: Path, *words: object) -> Iterator[subprocess.Popen[str]]:
    """A window that is open and works; killed afterwards if it is still there."""
    former = address_of(home)
    process = start_window(home, *words)
    try:
        wait_for(lambda: address_of(home) not in ("", former) or process.poll() is not None)
        assert process.poll() is None, process.communicate()
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def wait_for(ready: Callable[[], bool]) -> None:
    """Wait until something is so, however slow the machine is."""
    limit = time.monotonic() + PATIENCE_S
    while not ready():
        assert time.monotonic() < limit, "waited in vain"
        time.sleep(0.05)


def address_of(home: Path) -> str:
    """Read where a window listens; a killed one leaves that behind."""
    path = home / ADDRESS
    return path.read_text() if path.exists() else ""


def ended(process: subprocess.Popen[str]) -> tuple[int, Sequence[str]]:
    """Wait for the end; give the exit code and the lines on standard error."""
    _, words = process.communicate(timeout=PATIENCE_S)
    return process.returncode, words.splitlines()


def log_of(home: Path) -> str:
    """Read the log."""
    path = home / LOGS / LOG
    return path.read_text("utf-8") if path.exists() else ""
