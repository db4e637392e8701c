"""Which part of the canvas is seen, and how large."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from app.core.painting.canvas import Region

SMALLEST: Final = 0.5
LARGEST: Final = 8.0
"""Logical pixels per canvas pixel."""

_SHOWN_HEIGHT: Final = 0.95  # of the picture: crown to neck; the shoulders may be cut off
_SHOWN_WIDTH: Final = 0.75
_ABOVE: Final = 0.06  # of the height, over the crown


@dataclass(frozen=True, slots=True)
class Viewing:
    """A mapping from canvas to widget.

    Attributes
    ----------
    zoom : float
        Logical pixels per canvas pixel.
    left, top : float
        Where the canvas has its upper left corner, logical pixels of the widget.
    """

    zoom: float = 1.0
    left: float = 0.0
    top: float = 0.0

    def to_canvas(self, x: float, y: float) -> tuple[float, float]:
        """Canvas pixel under a point of the widget."""
        return (x - self.left) / self.zoom, (y - self.top) / self.zoom

    def to_widget(self, x: float, y: float) -> tuple[float, float]:
        """Point of the widget where a canvas pixel lies."""
        return self.left + x * self.zoom, self.top + y * self.zoom

    def area(self, region: Region) -> tuple[float, float, float, float]:
        """Left, top, width and height of a part of the canvas, logical pixels of the widget."""
        left, top = self.to_widget(region.left, region.top)
        width, height = region.right - region.left, region.bottom - region.top
        return left, top, width * self.zoom, height * self.zoom

    def moved(self, dx: float, dy: float) -> Viewing:
        """Return it shifted by logical pixels."""
        return replace(self, left=self.left + dx, top=self.top + dy)

    def zoomed(self, zoom: float, x: float, y: float) -> Viewing:
        """Return it at another zoom; what lies under a point of the widget stays there."""
        wanted = min(max(zoom, SMALLEST), LARGEST)
        at = self.to_canvas(x, y)
        return Viewing(wanted, x - at[0] * wanted, y - at[1] * wanted)

    def held(self, width: float, height: float, size: int) -> Viewing:
        """Return it shifted so that the middle of the widget lies on the canvas."""
        x, y = self.to_canvas(width / 2, height / 2)
        dx, dy = x - min(max(x, 0.0), size), y - min(max(y, 0.0), size)
        return self.moved(dx * self.zoom, dy * self.zoom)


def fitting(width: float, height: float, size: int) -> Viewing:
    """Show the head as large as it fits, in steps of 10 %.

    Parameters
    ----------
    width, height : float
        Of the widget, logical pixels.
    size : int
        Side of the canvas, pixels.
    """
    room = min(height / (size * _SHOWN_HEIGHT), width / (size * _SHOWN_WIDTH))
    zoom = min(max(int(room * 10 + 1e-9) / 10, SMALLEST), LARGEST)
    return Viewing(zoom, (width - size * zoom) / 2, height * _ABOVE)
