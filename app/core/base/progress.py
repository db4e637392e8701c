"""Cancel long tasks and report their progress, independently of threads and of the UI.

A long-running function takes a `Token` and a `Report`. It calls ``token.check()`` often (a few
times a second) and ``report(fraction, progress)`` when there is progress to report. The caller
chooses the thread and the display, and `app.words.progress` writes the text.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeAlias, TypedDict, TypeVar

from app.core.base.errors import Cancelled


class Task(StrEnum):
    """A step of a long computation."""

    READING = "reading"
    COPYING = "copying"
    COPIED = "copied"
    DELETING = "deleting"
    SAVING_PLACE = "saving place"
    READING_FRAMES = "reading frames"
    ALIGNING_FRAMES = "aligning frames"
    CHECKING_EXPOSURES = "checking exposures"
    MERGING = "merging"
    STITCHING = "stitching"
    FINDING_LAMPS = "finding lamps"
    READING_PHOTOS = "reading photos"
    COMPARING_PHOTOS = "comparing photos"
    WATCHING_FILM = "watching film"
    FINDING_LIGHT = "finding light"
    LEARNING_BACKGROUND = "learning background"
    FINDING_BACKGROUND = "finding background"
    FINDING_LAMP = "finding lamp"
    TURNING_LAMP = "turning lamp"
    TRYING_LAMP = "trying lamp"
    SORTING_SHADOWS = "sorting shadows"
    HOLDING_LAMP = "holding lamp"
    VIEWING_HEAD = "viewing head"
    MEASURING_SKIN = "measuring skin"
    FOLLOWING_LIGHT = "following light"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a long computation, as data.

    Attributes:
        name: File, place or lamp that the step is about, or "" if there is none.
        number, count: Number of the current item, counted from 1, and the total number of items.
            Both are 0 if the step does not count items.
    """

    task: Task
    name: str = ""
    number: int = 0
    count: int = 0


Report: TypeAlias = Callable[[float, Progress], None]
"""Function called as ``report(fraction, progress)``, with a fraction in [0, 1]."""

PhraseReport: TypeAlias = Callable[[float, Progress | str], None]
"""A `Report` for code above core, which also accepts a short phrase."""


M = TypeVar("M")


class Token:
    """A request to stop, which cannot be withdrawn.

    Setting a boolean attribute is atomic in CPython, so one thread may cancel while another one
    checks, without a lock.

    Examples:
        >>> token = Token()
        >>> token.check()
        >>> token.cancel()
        >>> token.cancelled
        True
    """

    __slots__ = ("_cancelled",)

    def __init__(self) -> None:
        self._cancelled = False

    def cancel(self) -> None:
        """Request that the task stop. Further calls have no effect."""
        self._cancelled = True

    @property
    def cancelled(self) -> bool:
        """Whether a stop has been requested."""
        return self._cancelled

    def check(self) -> None:
        """Raise `Cancelled` if a stop has been requested."""
        if self._cancelled:
            raise Cancelled


def silent(fraction: float, message: object) -> None:
    """Ignore all progress. This function is the default report.

    Args:
        fraction: Fraction of the work done, 0 to 1.
    """


def span(
    report: Callable[[float, M], None], start: float, stop: float
) -> Callable[[float, M], None]:
    """Return a report for part of a task, which maps 0..1 to ``start..stop`` of the whole.

    Args:
        start, stop: Fractions of the whole, 0 to 1, at which the part starts and stops.

    Returns:
        The report for the part, which clips fractions to [0, 1].

    Examples:
        >>> half = span(lambda fraction, message: print(fraction, message), 0.5, 1.0)
        >>> half(0.5, "rendering")
        0.75 rendering
    """

    def mapped(fraction: float, message: M) -> None:
        inside = min(max(fraction, 0.0), 1.0)
        report(start + (stop - start) * inside, message)

    return mapped


T = TypeVar("T")


class Handlers(TypedDict, Generic[T], total=False):
    """The title of a job and the callbacks that run on the UI thread when the job ends.

    Exactly one of `done`, `failed` and `cancelled` is called. A failure without a handler is shown
    to the user.
    """

    title: str
    done: Callable[[T], None] | None
    failed: Callable[[Exception], None] | None
    cancelled: Callable[[], None] | None
