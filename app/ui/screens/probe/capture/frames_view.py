"""The frames of a capture side by side."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.probe.capture.frames import FrameTile
from app.ui.theme import px
from app.ui.widgets.displays import Bar, Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import clear, column, grid, row


class _FrameView(QWidget):
    """One exposure, with its thumbnail, EV, shutter speed and clipped percentage."""

    def __init__(self, narrow: bool) -> None:
        super().__init__()
        self._narrow = narrow
        self._tile: FrameTile | None = None
        self.picture = Picture(tr("Frame"), 4)
        self.ev = Text("", 14, 600)
        align = Qt.AlignmentFlag.AlignLeft if narrow else Qt.AlignmentFlag.AlignRight
        self.shutter = Text("", 12, role="dim", align=align)
        self._clip_icon = Icon("hatch", 16)
        self.clipped = Text("", 12, elide=True)
        self._bar = Bar(tr("Download"))
        self._bar.setMinimumWidth(0)
        self._bar.setMaximumWidth(px(400))
        self._bar.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        # the shutter speed goes below the EV, or to its right if there is room
        first = [self.ev, self.shutter] if narrow else [row(self.ev, ..., self.shutter, gap=None)]
        second = row(self._clip_icon, (self.clipped, 1), gap=4)
        column(self.picture, 4, self._bar, *first, second, into=self)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)

    def show_tile(self, tile: FrameTile) -> None:
        before = self._tile
        if before is not None and tile == before and tile.picture is before.picture:
            return
        self._tile = tile
        self.picture.set_picture(tile.picture)
        self.picture.setAccessibleName(tr("Frame {spoken}", spoken=tile.spoken))
        self.setToolTip(tile.spoken)
        self.ev.set_text(tile.ev)
        self.shutter.set_text(tile.shutter)
        words = tile.clipped_brief if self._narrow else tile.clipped
        self.clipped.set_text(words)
        self._clip_icon.setVisible(bool(words))
        self._bar.setVisible(tile.arrived < 1.0)
        self._bar.set(tile.arrived)


class FramesGrid(QWidget):
    """The exposures side by side, three or four to a row."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = grid(across=4, gap=(8, 8))
        self._grid.setContentsMargins(0, 0, 0, 0)
        self.setLayout(self._grid)
        self.views: list[_FrameView] = []
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def resizeEvent(self, event: object) -> None:
        """Keep all thumbnails at 2:1 and at the same height."""
        self._fit()

    def _fit(self) -> None:
        columns = 3 if len(self.views) <= 3 else 4
        width = (self.width() - (columns - 1) * px(8)) // columns
        for view in self.views:
            view.picture.setFixedHeight(max(width // 2, 8))

    def show_tiles(self, tiles: tuple[FrameTile, ...]) -> None:
        """Show a tile for each frame."""
        columns = 3 if len(tiles) <= 3 else 4
        if len(tiles) != len(self.views):
            clear(self._grid)
            self.views = [_FrameView(columns > 3) for _ in tiles]
            for number, view in enumerate(self.views):
                self._grid.addWidget(view, number // columns, number % columns)
            for column in range(4):
                self._grid.setColumnStretch(column, 1 if column < columns else 0)
            self._fit()
        for view, tile in zip(self.views, tiles, strict=True):
            view.show_tile(tile)
