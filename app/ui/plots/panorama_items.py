"""The items drawn in a panorama: pixels, hatching, grid, lamps and the marker's line."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

from numpy.typing import NDArray
from PySide6.QtGui import QColor, QPainter

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.ui.plots.panel import Panel
from app.ui.plots.parts.base import disc, draw_text
from app.ui.plots.parts.curve_items import Group, Mark, PlotLine, around
from app.ui.plots.parts.geometry import Point
from app.ui.plots.parts.layers import Hatching, PanoramaLayer
from app.ui.plots.parts.mapping import Viewport
from app.ui.plots.parts.panorama_scale import Marks, SceneLamp
from app.ui.theme import px, theme
from app.ui.widgets.paint import pen

_DARK: Final = QColor(0, 0, 0, 80)
_LIGHT: Final = QColor(255, 255, 255, 130)
_AROUND_DEG: Final = 45  # spacing of vertical lines in degrees
_UP_DEG: Final = 30  # spacing of horizontal lines in degrees
_LAMP: Final = 13  # radius of a lamp's ring


class PanoramaDrawing:
    """The items drawn in a panorama, from back to front."""

    def __init__(self, panel: Panel) -> None:
        c = theme().c
        self._panel = panel
        self._layer, self._hatching = panel.add(PanoramaLayer()), panel.add(Hatching())
        self._grid: Group | None = None
        self._lamps: dict[SceneLamp, tuple[Mark, Mark]] = {}
        self._marker = panel.add(around(pen(c.tag, 4.0), pen(c.amberfill, 2.0)))
        self._marker.setZValue(2.0)

    def set_pixels(self, picture: Bytes | None) -> None:
        """Show a different picture."""
        self._layer.set_pixels(picture)
        self._panel.setVisible(picture is not None)

    def set_clipped(self, clipped: NDArray[Any] | None) -> None:
        """Set the hatched areas."""
        self._hatching.set_clipped(clipped)

    def show_marks(self, view: Viewport, marks: Marks) -> None:
        """Show part of the panorama together with its marks."""
        self._panel.look(view)
        self._hatching.setVisible(marks.clipped)
        self._show_grid(view, marks)
        self._marker.setVisible(marks.marker_deg is not None)
        self._marker.setX(wrap(marks.marker_deg or 0.0))
        for lamp in self._lamps.keys() - set(marks.lamps):
            for mark in self._lamps.pop(lamp):
                self._panel.box.removeItem(mark)
        for lamp in marks.lamps:
            self._show_lamp(view, lamp)

    def _show_grid(self, view: Viewport, marks: Marks) -> None:
        """Centre the grid on the grid line that is nearest to the centre of the view."""
        if self._grid is None and marks.grid:
            # Draw all dark edges below all lines.
            self._grid = self._panel.add(Group(*_grid(_DARK, 2.0), *_grid(_LIGHT, 0.0)))
        if self._grid is not None:
            self._grid.setVisible(marks.grid)
            ahead = view.azimuth_deg - marks.front_deg
            self._grid.setX(marks.front_deg + _AROUND_DEG * round(ahead / _AROUND_DEG))

    def _show_lamp(self, view: Viewport, lamp: SceneLamp) -> None:
        """Place a lamp's letter in its direction, or at both edges if the lamp is near the seam."""
        if lamp not in self._lamps:
            size, draw = 2.0 * px(_LAMP) + 2.0, partial(_draw_lamp, lamp.letter)
            self._lamps[lamp] = (Mark(draw, size), Mark(draw, size))
            for mark in self._lamps[lamp]:
                self._panel.add(mark).setZValue(1.0)
        radius = px(_LAMP)
        places = view.xs_of(lamp.azimuth_deg, radius)
        y = min(max(view.y_of(lamp.elevation_deg), radius), view.height - radius)
        for mark, place in zip(self._lamps[lamp], (*places[:2], None, None), strict=False):
            mark.setVisible(place is not None)
            if place is not None:
                x = min(max(place, radius), view.width - radius)
                across = view.azimuth_deg + (x - view.width / 2.0) / view.scale
                mark.setPos(across, -view.elevation_at(y))


def _grid(colour: QColor, wider: float) -> list[PlotLine]:
    """Return the vertical grid lines around azimuth 0, and the horizontal grid lines.

    The horizon is thicker than the other lines.
    """
    lines = []
    for azimuth in range(-5 * _AROUND_DEG, 5 * _AROUND_DEG + 1, _AROUND_DEG):
        lines.append(PlotLine(pen(colour, 1.0 + wider)))
        lines[-1].setPos(azimuth)
    for elevation in range(-60, 61, _UP_DEG):
        width = 2.0 if elevation == 0 else 1.0
        lines.append(PlotLine(pen(colour, width + wider), upright=False))
        lines[-1].setPos(elevation)
    return lines


def _draw_lamp(letter: str, painter: QPainter, middle: Point) -> None:
    t, radius = theme(), px(_LAMP)
    disc(painter, middle, radius + 1.0, t.c.tag)
    disc(painter, middle, radius - 1.0, t.c.tag, t.c.ontag, 2.0)
    draw_text(painter, middle, letter, t.font(14, 700), t.c.ontag)
