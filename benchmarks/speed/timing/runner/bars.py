"""Targets of the hot paths: one table, for the command, its tests and the documentation.

A ratio to plain code and a multiple of the machine's limit hold on any machine. Seconds are for two
current cores.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.speed.timing.runner.rows import Row


@dataclass(frozen=True, slots=True)
class Bar:
    """Target of one hot path.

    Attributes:
        ratio: Least speed relative to plain code.
    """

    ratio: float = 0.0
    seconds: float = math.inf
    limits: float = math.inf

    def missed(self, row: Row, slack: float = 1.0) -> tuple[str, ...]:
        """Return the targets that a row misses.

        Args:
            slack: Factor by which a slower machine may exceed the seconds.

        Returns:
            A phrase for each, empty if all are reached.
        """
        found = []
        if row.ratio < self.ratio:
            found.append(f"{row.ratio:.1f} times faster than plain, not {self.ratio:g}")
        if row.seconds > slack * self.seconds:
            found.append(f"{1e3 * row.seconds:.3g} ms, not {1e3 * slack * self.seconds:g}")
        if row.limits > self.limits:
            found.append(f"{row.limits:.2f} times the limit, not {self.limits:g}")
        return tuple(found)

    @property
    def words(self) -> str:
        """Return the target as shown in a table."""
        parts = []
        if self.ratio > 0:
            parts.append(f"≥ {self.ratio:g}x")
        if math.isfinite(self.seconds):
            parts.append(f"≤ {1e3 * self.seconds:g} ms")
        if math.isfinite(self.limits):
            parts.append(f"≤ {self.limits:g} limits")
        return ", ".join(parts)


BARS: Final[dict[str, Bar]] = {
    "solve.quality": Bar(ratio=100, seconds=0.05e-3),
    "solve.match": Bar(ratio=100, seconds=0.5e-3),
    "solve.match.product": Bar(ratio=20, seconds=0.5e-3),
    "answers.all": Bar(seconds=8e-3),
    "solve.match.yaw": Bar(seconds=6e-3),
    "answers.yaw": Bar(seconds=25e-3),
    "preintegrate.full": Bar(seconds=1e-3),
    "preintegrate.stroke": Bar(seconds=0.1e-3),
    "render.rgb": Bar(seconds=3e-3),
    "gallery.all": Bar(seconds=150e-3),
    "paint.segment": Bar(ratio=20, seconds=6e-3),
    "light.one": Bar(ratio=100, seconds=1.5e-3),
    "light.all": Bar(ratio=100, seconds=25e-3),
    "light.match": Bar(ratio=100, seconds=60e-3),
    "heading.track": Bar(seconds=60e-3),
    "heading.search": Bar(seconds=700e-3),
    # 15 % of a core at 30 pictures a second, for receiving and decoding together.
    "preview.decode": Bar(seconds=5e-3),
    "merge.three": Bar(ratio=4.5, limits=2.0),
    "start.solve": Bar(seconds=1.5),
}
"""Targets by row name."""


def missed(rows: Sequence[Row], slack: float = 1.0) -> dict[str, tuple[str, ...]]:
    """Return the rows that miss their targets.

    Returns:
        Phrases by row name; empty if all are reached.
    """
    found = {row.name: BARS[row.name].missed(row, slack) for row in rows if row.name in BARS}
    return {name: words for name, words in found.items() if words}
