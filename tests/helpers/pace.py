"""How fast this machine is right now, beside the one that times in milliseconds were set on.

Bars in seconds belong to a machine of a certain speed. A slower one, or one that other programs
keep busy, takes longer for everything alike: for this fixed piece of work too.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

_USUAL_S: Final = 1.0e-3  # of `_work`, on the machine of benchmarks/results/speed.json
_MOST: Final = 4.0  # as in tests/acceptance/test_speed.py
_TIMES: Final = 3


def pace() -> float:
    """How many times as long as there this thread's work takes at the moment, from 1 to 4."""
    fastest = min(_seconds() for _ in range(_TIMES))
    return min(max(1.0, fastest / _USUAL_S), _MOST)


def units(work: Callable[[], object], rounds: int = 3) -> float:
    """Processor time of a piece of work, in that of `_work` beside it; the least of some rounds.

    A unit is 1 ms on the machine of benchmarks/results/speed.json.
    """
    costs, paces = [], []
    for _ in range(rounds):
        began = time.process_time()
        work()
        costs.append(time.process_time() - began)
        paces.append(_seconds())
    return min(costs) / min(paces)


def _seconds() -> float:
    began = time.thread_time()
    _work()
    return time.thread_time() - began


def _work() -> int:
    """What a screen's code does most: small objects, names and numbers."""
    found: dict[str, tuple[int, float]] = {}
    for number in range(6000):
        name = f"part {number % 311}"
        count, total = found.get(name, (0, 0.0))
        found[name] = (count + 1, total + number * 0.5)
    return sum(count for count, _ in sorted(found.values()))
