"""The window's log and the interpreter's crash report.

LOGS/turnlight.log   starts, ends and errors, in at most two files of 1 MiB each
LOGS/crash.log       written by `faulthandler` during a run, and empty unless a library crashes
LOGS/last-crash.log  the crash of an earlier run, for the user to read or send
"""

from __future__ import annotations

import contextlib
import faulthandler
import io
import logging
import logging.handlers
import os
import platform
import sys
from pathlib import Path
from typing import Final, TextIO

from app import __version__
from app.core.base.atomic_files import make_folder

LOGS: Final = "logs"
"""Name of the log folder inside the data folder."""

LOG: Final = "turnlight.log"
LAST_CRASH: Final = "last-crash.log"
_CRASH: Final = "crash.log"
_LOG_BYTES: Final = 1 << 20
_CRASH_BYTES: Final = 1 << 18
_log = logging.getLogger("turnlight")
_log.addHandler(logging.NullHandler())  # without a log file, print nothing to the terminal either


class _PrivateFile(logging.handlers.RotatingFileHandler):
    """A log file that only the user can read."""

    def _open(self) -> io.TextIOWrapper:
        handle = os.open(self.baseFilename, os.O_APPEND | os.O_CREAT | os.O_WRONLY, 0o600)
        raw = os.fdopen(handle, "ab")
        return io.TextIOWrapper(raw, encoding=self.encoding, errors=self.errors)


def log_to(folder: Path) -> None:
    """Write the log to a file in the given folder, if possible."""
    with contextlib.suppress(OSError):
        make_folder(folder, private=True)
        # File names may contain bytes that are not valid text.
        handler = _PrivateFile(
            folder / LOG,
            maxBytes=_LOG_BYTES,
            backupCount=1,
            encoding="utf-8",
            errors="backslashreplace",
        )
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s %(message)s"))
        root = logging.getLogger()
        root.addHandler(handler)
        root.setLevel(logging.INFO)
        _log.info(
            "start: Turnlight %s, process %d, Python %s, %s",
            __version__,
            os.getpid(),
            platform.python_version(),
            platform.platform(),
        )


class CrashLog:
    """Makes the interpreter record its stack if a library crashes the process.

    Attributes:
        crashed: Whether the previous run ended in a crash.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: TextIO | None = None
        self.crashed = False
        with contextlib.suppress(OSError):
            make_folder(folder, private=True)
            self.crashed = self._keep_last()
            handle = os.open(folder / _CRASH, os.O_CREAT | os.O_TRUNC | os.O_WRONLY, 0o600)
            self._file = open(handle, "w", encoding="utf-8")  # noqa: SIM115 - open to the end
            faulthandler.enable(self._file)

    def close(self) -> None:
        """Record that this run ended normally."""
        if self._file is not None:
            faulthandler.disable()
            self._file.close()
            with contextlib.suppress(OSError):
                (self._folder / _CRASH).unlink()

    def _keep_last(self) -> bool:
        crash = self._folder / _CRASH
        if not crash.is_file() or crash.stat().st_size == 0:
            return False
        with crash.open("rb") as stream:
            trace = stream.read(_CRASH_BYTES).decode("utf-8", "replace")
        _log.error("the previous run crashed:\n%s", trace)
        os.replace(crash, self._folder / LAST_CRASH)
        return True


def crash_text(folder: Path) -> str:
    """Return a report on the last crash that is ready to be sent to the developers."""
    parts = [f"Turnlight {__version__}, Python {sys.version}, {platform.platform()}"]
    for name in (LAST_CRASH, LOG):
        with contextlib.suppress(OSError), (folder / name).open("rb") as stream:
            stream.seek(max(stream.seek(0, os.SEEK_END) - _CRASH_BYTES // 4, 0))
            parts.append(f"{name}:\n{stream.read(_CRASH_BYTES // 4).decode('utf-8', 'replace')}")
    return "\n\n".join(parts)
