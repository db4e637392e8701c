"""Print answers to stdout and everything else to stderr."""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from app.core.text import tr
from app.words.phrases.quantities import about_words
from app.words.progress import progress_words
from app.words.why_out_of_reach import reason_sentence

if TYPE_CHECKING:
    import argparse

    from app.core.base.progress import Progress
    from app.core.second_light.search import LampPlacement
    from app.core.solver.style_result import PeakResult, StyleResult

_PAUSE_S = 1.0  # seconds between two lines about the same step


def answer(args: argparse.Namespace, facts: dict[str, Any], words: str) -> int:
    """Print the answer as JSON or text, and return exit code 0."""
    print(json.dumps(facts, ensure_ascii=False) if args.json else words)
    return 0


def say(*lines: object) -> None:
    """Print lines to stderr immediately."""
    for line in lines:
        print(line, file=sys.stderr, flush=True)


def fields(thing: object, *names: str) -> dict[str, Any]:
    """Return the named fields of an object for JSON."""
    return {name: getattr(thing, name) for name in names}


def numbers(one: StyleResult | PeakResult) -> dict[str, Any]:
    """Return the JSON entries for a turn."""
    return {
        "turn_deg": one.turn_deg,
        "turn_refined_deg": round(one.turn_refined_deg, 6),
        "quality": short(one.quality),
        "match": short(one.match),
        "strength": short(one.strength),
    }


def reach_facts(one: StyleResult | LampPlacement) -> dict[str, Any]:
    """Return a style's JSON entries on reach: the grade, the reason and the cause, as data."""
    words = reason_sentence(one.shortfall) or None
    return {
        "attainable": one.attainable,
        "reason": None if one.attainable else words,
        "grade": one.grade,
        "shortfall": words if one.attainable else None,
        "cause": None if one.shortfall is None else asdict(one.shortfall),
        "looks_more_like": one.looks_more_like,
    }


def short(value: float) -> float:
    """Round to nine significant digits, which is more than the precision of the data."""
    return float(f"{value:.9g}")


def points(value: float) -> str:
    """Format a value, rounded down so that a value below a limit never reads as the limit."""
    return str(max(math.floor(value), 0))


class ProgressPrinter:
    """A `Report` that prints progress to stderr, with the estimated time left."""

    def __init__(self) -> None:
        self._last = (-_PAUSE_S, "")
        self._first: tuple[float, float] | None = None
        self._last_line = ""

    def __call__(self, fraction: float, step: Progress | str) -> None:
        """Print the progress unless it has already been printed."""
        now, message = time.monotonic(), progress_words(step)
        if self._first is None or fraction < self._first[0]:
            self._first = (fraction, now)
        gain = fraction - self._first[0]
        words = message
        if gain > 0.02 and fraction < 1:
            time_left = about_words((now - self._first[1]) / gain * (1 - fraction))
            words = tr("{message}, about {time} left", message=message, time=time_left)
        line = f"{100 * fraction:3.0f}%  {words}"
        due = message != self._last[1] or now - self._last[0] >= _PAUSE_S or fraction >= 1
        if line != self._last_line and due:
            say(line)
            self._last_line, self._last = line, (now, message)
