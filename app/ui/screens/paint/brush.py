"""The brush in the hand: tool, size, strength, softness, mirror and pen pressure."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.painting.stroke import Brush, Tool

if TYPE_CHECKING:
    from collections.abc import Callable

SMALLEST: Final = 4.0
LARGEST: Final = 160.0
"""Diameters of the brush, canvas pixels."""

_GROW: Final = 1.15
_EVEN: Final = 2.0


class BrushBox:
    """Holds the brush and takes what the user changes of it."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._brush = Brush(pen_pressure=True)

    @property
    def brush(self) -> Brush:
        """What is painted with."""
        return self._brush

    def choose_tool(self, tool: Tool) -> None:
        """Take another tool."""
        self._set(replace(self._brush, tool=tool))

    def set_size(self, diameter: float) -> None:
        """Change the diameter, canvas pixels."""
        wanted = min(max(float(diameter), SMALLEST), LARGEST)
        self._set(replace(self._brush, diameter=wanted))

    def resize(self, steps: int) -> None:
        """Make it larger or smaller by some steps of 15 %, of 2 pixels at least."""
        now = self._brush.diameter
        wanted = round(now * _GROW**steps / _EVEN) * _EVEN
        if wanted == now:
            wanted = now + _EVEN * steps
        self.set_size(wanted)

    def set_strength(self, strength: float) -> None:
        """Change how far one stroke goes, 0 to 1."""
        self._set(replace(self._brush, strength=min(max(float(strength), 0.0), 1.0)))

    def set_softness(self, softness: float) -> None:
        """Change over which share of its radius it fades out, 0 to 1."""
        self._set(replace(self._brush, softness=min(max(float(softness), 0.0), 1.0)))

    def set_mirror(self, on: bool) -> None:
        """Paint both sides of the face alike, or not."""
        self._set(replace(self._brush, mirror=on))

    def set_pen_pressure(self, on: bool) -> None:
        """Let the pen's pressure count, or not."""
        self._set(replace(self._brush, pen_pressure=on))

    def flip_mirror(self) -> None:
        """Paint both sides alike if it did not, and the reverse."""
        self.set_mirror(not self._brush.mirror)

    def flip_pen_pressure(self) -> None:
        """Let the pen's pressure count if it did not, and the reverse."""
        self.set_pen_pressure(not self._brush.pen_pressure)

    def _set(self, brush: Brush) -> None:
        if brush != self._brush:
            self._brush = brush
            self._changed()
