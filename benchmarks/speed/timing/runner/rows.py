"""Timing of a hot path: against plain code, a limit and peers, in turn and several times.

All competitors are timed within one run and in turn, and the best of several counts: other load on
a machine can make a measurement slower, never faster. The time of a call is the wall time, or the
CPU time if that is less, so that waiting for a core hardly counts. Multi-threaded work is timed by
the wall clock alone; only peers get the better of both.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.progress import PhraseReport, Token

Doer: TypeAlias = Literal["thread", "threads", "process"]
Work: TypeAlias = Callable[[], Any]

MEMORY: Final = "memory traffic"
"""The usual limit: minimum bytes touched, over the bandwidth measured in the same run."""

_BUFFER: Final = 1 << 26  # bytes; far larger than any cache


@dataclass(frozen=True, slots=True)
class Peer:
    """Another program that does the same job."""

    name: str
    seconds: float
    note: str


@dataclass(frozen=True, slots=True)
class Row:
    """One hot path.

    Attributes:
        limit_seconds: The machine's minimum, measured in the same run. Data that fit in a cache can
            be faster than a limit that counts memory traffic.
    """

    name: str
    seconds: float
    median_seconds: float
    baseline_seconds: float
    limit_seconds: float
    baseline: str
    limit: str = MEMORY
    peers: tuple[Peer, ...] = ()

    @property
    def ratio(self) -> float:
        """Speed relative to the plain implementation."""
        return self.baseline_seconds / self.seconds

    @property
    def limits(self) -> float:
        """Time as a multiple of the machine's limit."""
        return self.seconds / self.limit_seconds


@dataclass(frozen=True, slots=True, eq=False)
class PeerCase:
    """A peer to time."""

    name: str
    work: Work
    judge: Callable[[object], str]
    share: float = 1.0
    rounds: int = 2


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A hot path to time.

    Attributes:
        rounds: Number of rounds in which all take their turn, so that a busy moment affects neither
            side of a ratio alone.
        budget_s: Time of a round after which no further call is started.
    """

    name: str
    fast: Work
    plain: Work
    baseline: str
    limit: float | Work
    limit_is: str = MEMORY
    share: float = 1.0
    rounds: int = 2
    budget_s: float = 0.3
    least: int = 3
    most: int = 2000
    by: Doer = "thread"
    peers: tuple[PeerCase, ...] = field(default=())


def bandwidth() -> float:
    """Measure memory bandwidth, bytes per second read and written by a large copy."""
    source = np.ones(_BUFFER // 8)
    target = np.empty_like(source)
    return 2 * source.nbytes / min(clock(lambda: np.copyto(target, source), 0.3))


def clock(
    work: Work,
    budget_s: float,
    least: int = 3,
    most: int = 20,
    *,
    warm: bool = True,
    by: Doer = "thread",
    token: Token | None = None,
) -> list[float]:
    """Time repeated calls."""
    if warm:
        work()
    times: list[float] = []
    stop = time.perf_counter() + budget_s
    while len(times) < least or (time.perf_counter() < stop and len(times) < most):
        if token is not None:
            token.check()
        times.append(_once(work, by)[0])
    return times


def _once(work: Work, by: Doer) -> tuple[float, object]:
    """Return the seconds of a call, and its result."""
    wall, processor = time.perf_counter(), _processor(by)
    result = work()
    processor, wall = _processor(by) - processor, time.perf_counter() - wall
    # Not every system reports the CPU time of other processes.
    told = by != "threads" and processor > 0
    return (min(wall, processor) if told else wall), result


def _processor(by: Doer) -> float:
    if by == "process":
        spent = os.times()
        return spent.children_user + spent.children_system
    return time.process_time()


def time_all(
    cases: Sequence[Case],
    speed: float,
    report: PhraseReport,
    token: Token,
    enough: Callable[[Row], bool] = lambda _: False,
) -> tuple[Row, ...]:
    """Time hot paths, each against its plain implementation, its limit and its peers.

    Args:
        speed: Memory bandwidth, bytes per second.
        report: Called with the row that is being timed.
        enough: Whether a row needs no further rounds.
    """
    rows = []
    for done, case in enumerate(cases):
        token.check()
        report(done / len(cases), case.name)
        rows.append(_row(case, speed, token, enough))
    report(1.0, "done")
    return tuple(rows)


def _row(case: Case, speed: float, token: Token, enough: Callable[[Row], bool]) -> Row:
    fast: list[float] = []
    plain: list[float] = []
    limit = [] if callable(case.limit) else [case.limit / speed]
    for number in range(case.rounds):
        timed = partial(clock, budget_s=case.budget_s, least=case.least, token=token)
        timed = partial(timed, warm=number == 0, by=case.by)
        plain += timed(case.plain)
        fast += timed(case.fast, most=case.most)
        if callable(case.limit):
            limit += timed(case.limit)
        row = Row(
            name=case.name,
            seconds=min(fast),
            median_seconds=float(np.median(fast)),
            baseline_seconds=min(plain) / case.share,
            limit_seconds=min(limit),
            baseline=case.baseline,
            limit=case.limit_is,
        )
        if enough(row):
            break
    return replace(row, peers=tuple(_peer(peer, token) for peer in case.peers))


def _peer(peer: PeerCase, token: Token) -> Peer:
    """Time another program. Some take many seconds, so there is no warm-up call."""
    result: object = None
    times = []
    for _ in range(peer.rounds):
        token.check()
        seconds, result = _once(peer.work, "thread")
        times.append(seconds)
    return Peer(peer.name, min(times) / peer.share, peer.judge(result))
