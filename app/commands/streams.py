r"""Standard output and error that take any text and cannot break a command half-way.

Names of files come from anywhere: what would steer a terminal or is not text at all is shown as
``\u001b``, which JSON reads back as it was. A closed or full standard error costs only the words;
a closed or full standard output is an error, since the answer is lost.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from typing import Any, Final, TextIO, cast

from app.core.base.errors import CoreError
from app.core.text import tr

_STEERING: Final = (
    *(code for code in range(0x20) if chr(code) not in "\n\t"),
    *range(0x7F, 0xA0),
    0x061C,
    *(0x200E, 0x200F, *range(0x2028, 0x202F)),
    *range(0x2066, 0x206A),
    *range(0xD800, 0xE000),
)
"""Control characters, changes of direction and of line, bytes of names that are not text."""

_SHOWN: Final = {code: f"\\u{code:04x}" for code in _STEERING}


class _Plain:
    """A text stream that shows what would steer a terminal."""

    def __init__(self, stream: TextIO, *, needed: bool) -> None:
        self._stream = stream
        self._needed = needed

    def write(self, text: str) -> int:
        """Write what can be shown."""
        with self._checked():
            self._stream.write(text.translate(_SHOWN))
        return len(text)

    def flush(self) -> None:
        """Flush; errors as `write`."""
        with self._checked():
            self._stream.flush()

    @contextlib.contextmanager
    def _checked(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            if self._needed:
                raise
        except (OSError, ValueError) as error:
            if self._needed:
                reason = (getattr(error, "strerror", None) or str(error)).lower()
                raise CoreError(
                    tr("The answer cannot be printed: {reason}.", reason=reason)
                ) from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def plain_streams(*, quiet: bool) -> Iterator[None]:
    """Make standard output and error plain; those that are closed are there all the same.

    Args:
        quiet: Whether to leave out what libraries in C write to standard error by themselves, such
            as libpng about a damaged file: our own sentence about it follows.
    """
    _fill_descriptors()
    before = sys.stdout, sys.stderr
    answer, words = _opened(before[0], 1), _opened(before[1], 2)
    with _apart(words) if quiet else contextlib.nullcontext(words) as words:
        sys.stdout = cast("TextIO", _Plain(answer, needed=True))
        sys.stderr = cast("TextIO", _Plain(words, needed=False))
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
    """Give standard error a descriptor of its own, and the libraries one that leads nowhere."""
    try:
        usual = stream.fileno() == 2
    except (OSError, ValueError):
        usual = False
    if not usual:
        yield stream
        return
    kept = os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    os.close(nothing)
    try:
        with open(
            kept, "w", buffering=1, encoding=stream.encoding, errors="replace", closefd=False
        ) as own:
            yield own
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def one_line(text: str) -> str:
    """Show the line ends in a sentence, which can only come from names."""
    return text.replace("\n", "\\n")


def _fill_descriptors() -> None:
    """Take up closed standard descriptors: the next file opened would become the output."""
    if os.name != "posix":
        return
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Output that was closed takes nothing, so that losing an answer is an error.
            nothing = os.open(os.devnull, os.O_WRONLY if number == 2 else os.O_RDONLY)
            if nothing != number:
                os.dup2(nothing, number)
                os.close(nothing)


def _opened(stream: TextIO | None, number: int) -> TextIO:
    """Write UTF-8 where the system's own encoding cannot carry degree signs and names."""
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
    """Point a stream at nothing, so that the interpreter's last flush cannot fail again."""
    try:
        descriptor = stream.fileno()
        nothing = os.open(os.devnull, os.O_WRONLY)
    except (OSError, ValueError):
        return
    os.dup2(nothing, descriptor)
    os.close(nothing)
