"""Cancelling and reporting for long work, without knowing anything of threads or screens.

A long function takes a `Token` and a `Report`. It calls ``token.check()`` often (a few times
a second) and ``report(fraction, message)`` when there is something new to say. Who runs it,
in which thread, and how progress is shown is the caller's affair.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeAlias, TypedDict, TypeVar

from app.core.base.errors import Cancelled

Report: TypeAlias = Callable[[float, str], None]
"""Callable ``(fraction, message)``: fraction in [0, 1], message a short plain phrase."""


class Token:
    """A request to stop that only ever goes from "no" to "yes".

    Setting a boolean attribute is atomic in CPython, so one thread may cancel while another
    checks; no lock is needed.

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
        """Ask the work that holds this token to stop; asking again changes nothing."""
        self._cancelled = True

    @property
    def cancelled(self) -> bool:
        """Whether somebody asked to stop."""
        return self._cancelled

    def check(self) -> None:
        """Stop here if somebody asked to. Raises `Cancelled` when `cancel` was called before."""
        if self._cancelled:
            raise Cancelled


def silent(fraction: float, message: str) -> None:
    """Report nothing: the default.

    Args:
        fraction: Share of the work done, 0 to 1; ignored.
    """


def span(report: Report, start: float, stop: float) -> Report:
    """Map a part's own 0..1 onto ``start..stop`` of the whole.

    Args:
        start, stop: Where the part begins and ends in the whole, 0 to 1.

    Returns:
        What to hand to the part. Fractions outside [0, 1] are clipped.

    Examples:
        >>> half = span(lambda fraction, message: print(fraction, message), 0.5, 1.0)
        >>> half(0.5, "rendering")
        0.75 rendering
    """

    def mapped(fraction: float, message: str) -> None:
        inside = min(max(fraction, 0.0), 1.0)
        report(start + (stop - start) * inside, message)

    return mapped


T = TypeVar("T")


class Handlers(TypedDict, Generic[T], total=False):
    """The title of work that is shown, and what is called at its end, on the thread of the screens.

    Of `done`, `failed` and `cancelled` exactly one; a failure without a handler is told to the
    user.
    """

    title: str
    done: Callable[[T], None] | None
    failed: Callable[[Exception], None] | None
    cancelled: Callable[[], None] | None
