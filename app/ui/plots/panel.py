"""The pyqtgraph view of a plot, whose items are positioned in data units."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import pyqtgraph as pg
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QGraphicsItem, QGraphicsScene, QWidget

from app.ui.plots.parts.mapping import Viewport

_Item = TypeVar("_Item", bound=QGraphicsItem)


class Panel(pg.GraphicsView):  # type: ignore[misc]
    """The part of a plot that pyqtgraph draws, in data units.

    In data units, x increases to the right and y increases downward. The plot itself handles the
    mouse and the keyboard. `over` paints on top of all items, in logical pixels.
    """

    def __init__(self, plot: QWidget, over: Callable[[QPainter], None]) -> None:
        super().__init__(plot, background=None)
        self._over = over
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        for widget in (self, self.viewport()):
            widget.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            widget.setAutoFillBackground(False)
        self.setCacheMode(self.CacheModeFlag.CacheNone)
        self.setViewportUpdateMode(self.ViewportUpdateMode.FullViewportUpdate)
        self.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        # With few items, an index tree is no faster, and it keeps deleted pyqtgraph items whose
        # size changed without notice.
        self.scene().setItemIndexMethod(QGraphicsScene.ItemIndexMethod.NoIndex)
        self.box = pg.ViewBox(enableMouse=False, enableMenu=False, invertY=True, defaultPadding=0.0)
        self.box.disableAutoRange()
        # The view already clips its content.
        self.box.setFlag(self.box.GraphicsItemFlag.ItemClipsChildrenToShape, False)
        self.setCentralItem(self.box)

    def add(self, item: _Item) -> _Item:
        """Add an item on top of the others, and return the item."""
        self.box.addItem(item, ignoreBounds=True)
        return item

    def paint_changes_only(self) -> None:
        """Repaint only the areas of items that have changed."""
        self.setViewportUpdateMode(self.ViewportUpdateMode.MinimalViewportUpdate)

    def look(self, view: Viewport) -> None:
        """Show part of a panorama, using degrees as the data units."""
        across, up = view.width / 2.0 / view.scale, view.height / 2.0 / view.scale
        x, y = view.azimuth_deg, -view.elevation_deg
        self.look_at(QRectF(x - across, y - up, 2.0 * across, 2.0 * up))

    def look_at(self, area: QRectF) -> None:
        """Show an area that is given in data units."""
        across, down = (area.left(), area.right()), (area.top(), area.bottom())
        self.box.setRange(xRange=across, yRange=down, padding=0.0)

    def drawForeground(self, painter: QPainter, _rect: QRectF) -> None:
        """Paint over the items."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._over(painter)
