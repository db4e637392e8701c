"""Standard output and error streams that accept any text and never abort a command midway.

File names can contain anything. Control characters and invalid text are shown as escape sequences
such as ``\u001b``, which a JSON parser decodes to the original. If standard error is closed or
full, only messages are lost. If standard output is closed or full, the result is lost, and that is
an error.

Ctrl-C is cooperative: a task stops at its next check. SIGTERM and SIGHUP are handled in the same
way, and partial files are removed. Only the exit code differs.
"""

from __future__ import annotations

import _thread
import contextlib
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Any, Final, TextIO, cast

from app.core.base.errors import CoreError
from app.core.base.progress import Token
from app.core.base.visible_text import STEERING
from app.core.text import tr

_ESCAPES: Final = {code: f"\\u{code:04x}" for code in STEERING}


class _Plain:
    """A text stream that escapes terminal control characters."""

    def __init__(self, stream: TextIO, *, needs_escape: bool) -> None:
        self._stream = stream
        self._needs_escape = needs_escape

    def write(self, text: str) -> int:
        """Write text with control characters escaped."""
        with self._check_output():
            self._stream.write(text.translate(_ESCAPES))
        return len(text)

    def flush(self) -> None:
        """Flush the stream, handling errors as in `write`."""
        with self._check_output():
            self._stream.flush()

    @contextlib.contextmanager
    def _check_output(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            if self._needs_escape:
                raise
        except (OSError, ValueError) as error:
            if self._needs_escape:
                reason = (getattr(error, "strerror", None) or str(error)).lower()
                raise CoreError(
                    tr("The result cannot be printed: {reason}.", reason=reason)
                ) from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def plain_streams(*, quiet: bool) -> Iterator[None]:
    """Make standard output and error safe for any text, and reopen them if they are closed.

    Args:
        quiet: Whether to suppress what C libraries print directly to standard error, such as
            libpng's messages about a damaged file. Turnlight prints its own message instead.
    """
    _fill_descriptors()
    before = sys.stdout, sys.stderr
    answer, words = _opened(before[0], 1), _opened(before[1], 2)
    with _apart(words) if quiet else contextlib.nullcontext(words) as words:
        sys.stdout = cast("TextIO", _Plain(answer, needs_escape=True))
        sys.stderr = cast("TextIO", _Plain(words, needs_escape=False))
        try:
            yield
        finally:
            sys.stdout, sys.stderr = before
            for stream in (answer, words):
                try:
                    stream.flush()
                except (OSError, ValueError):
                    _discard(stream)


@contextlib.contextmanager
def _apart(stream: TextIO) -> Iterator[TextIO]:
    """Duplicate standard error for Turnlight, and silence the original for C libraries."""
    try:
        usual = stream.fileno() == 2
    except (OSError, ValueError):
        usual = False
    if not usual:
        yield stream
        return
    stderr_copy = os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    os.close(nothing)
    try:
        with open(
            stderr_copy, "w", buffering=1, encoding=stream.encoding, errors="replace", closefd=False
        ) as own:
            yield own
    finally:
        os.dup2(stderr_copy, 2)
        os.close(stderr_copy)


def one_line(text: str) -> str:
    """Escape line breaks in a message, since they can only come from file names."""
    return text.replace("\n", "\\n")


def _fill_descriptors() -> None:
    """Reopen closed standard descriptors so that no other file is given their numbers."""
    if os.name != "posix":
        return
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Closed output rejects writes, so that losing an answer is an error.
            nothing = os.open(os.devnull, os.O_WRONLY if number == 2 else os.O_RDONLY)
            if nothing != number:
                os.dup2(nothing, number)
                os.close(nothing)


def _opened(stream: TextIO | None, number: int) -> TextIO:
    """Reopen a stream in UTF-8, since the system encoding may lack some characters."""
    if stream is None:
        try:
            return open(number, "w", encoding="utf-8", closefd=False)
        except OSError:
            return io.StringIO()
    if isinstance(stream, io.TextIOWrapper):
        encoding = None if stream.isatty() else "utf-8"
        stream.reconfigure(encoding=encoding, errors="replace")
    return stream


def _discard(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that the interpreter's final flush cannot fail."""
    try:
        descriptor = stream.fileno()
        nothing = os.open(os.devnull, os.O_WRONLY)
    except (OSError, ValueError):
        return
    os.dup2(nothing, descriptor)
    os.close(nothing)


_IMPORTING: Final = "<frozen importlib._bootstrap>"
_LATER_S: Final = 0.02


_ENDING: Final = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)
)
_signals: Final[list[int]] = []


def stop_code() -> int:
    """Return the exit code of an interrupted command: 128 plus the signal number."""
    return 128 + (_signals[-1] if _signals else signal.SIGINT)


@contextlib.contextmanager
def imports_whole() -> Iterator[None]:
    """Delay Ctrl-C, SIGTERM and SIGHUP until the current import has finished.

    A C library interrupted during its initialisation raises a misleading error or aborts the
    process, and no caller can recognise either as an interruption.
    """
    usual = signal.default_int_handler
    main = threading.current_thread() is threading.main_thread()
    _signals.clear()
    if not main or signal.getsignal(signal.SIGINT) is not usual:
        yield
        return
    waiting: list[threading.Timer] = []

    def handle(number: int, frame: FrameType | None) -> None:
        if not _signals or number != signal.SIGINT:
            _signals.append(number)  # later signals come from the timer
        if not _is_importing(frame):
            usual(signal.SIGINT, frame)
        again = threading.Timer(_LATER_S, _interrupt_main)
        again.daemon = True
        waiting.append(again)
        again.start()

    ending = [each for each in _ENDING if signal.getsignal(each) is signal.SIG_DFL]
    before = {each: signal.signal(each, handle) for each in (signal.SIGINT, *ending)}
    try:
        yield
    finally:
        for each in waiting:
            each.cancel()
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt_main() -> None:
    if sys.platform == "win32":
        _thread.interrupt_main()
    elif (main := threading.main_thread().ident) is not None:
        signal.pthread_kill(main, signal.SIGINT)  # Also wakes the main thread from a blocking call.


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None and frame.f_code.co_filename != _IMPORTING:
        frame = frame.f_back
    return frame is not None


@contextlib.contextmanager
def stopping(token: Token, words: str = "") -> Iterator[None]:
    """Request a stop on Ctrl-C, SIGTERM or SIGHUP, and exit immediately on a second signal."""
    words = words or tr("Stopping.")
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread receives signals
        return

    def handle(number: int, _frame: object) -> None:
        _signals.append(number)
        if token.cancelled:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
            return
        token.cancel()
        with contextlib.suppress(OSError, ValueError):
            # Calling print inside a signal handler is not safe.
            os.write(sys.stderr.fileno(), f"{words}\n".encode())

    signals = [each for each in _ENDING if signal.getsignal(each) is not signal.SIG_IGN]
    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, *signals)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
