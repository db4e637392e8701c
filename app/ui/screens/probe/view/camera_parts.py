"""The parts of the right side: camera and its panel, checklist and frames."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QGridLayout, QLineEdit, QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.probe.state import CameraBlock, CameraRow, Check, FrameTile
from app.ui.theme import Theme, px
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.buttons import Button, Pressable
from app.ui.widgets.displays import Bar, Picture, Spinner
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import boxed, clear, column, row
from app.ui.widgets.lists import Cell, Column, TableRow
from app.ui.widgets.paint import box, hover_fill, selected_edge
from app.ui.widgets.surfaces import Frame

if TYPE_CHECKING:
    from app.ui.screens.probe.cameras import CameraFinder

_COLUMNS = (Column("", 12), Column(""), Column("", 150))


class CameraHead(QWidget):
    """Name, how it is, and Change."""

    def __init__(self, cameras: CameraFinder, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        self.setFixedHeight(px(48))
        self.title = Text("", 16, 600, elide=True)
        self.second = Text("", 14, role="dim", elide=True)
        self._warning = Icon("warning", 16, "err")
        self._spinner = Spinner(tr("Looking for cameras"))
        self.change = Button(tr("Change"), size="small", do=cameras.toggle_panel)
        line = row(self._spinner, self._warning, (self.second, 1), gap=6)
        words = column(..., self.title, line, ...)
        change = (self.change, 0, Qt.AlignmentFlag.AlignVCenter)
        badge = Frame("raised", "none")
        row(Icon("theta", 24), into=badge, margins=12)
        row(badge, (words, 1), change, into=self, gap=16)

    def show_block(self, block: CameraBlock) -> None:
        """Show it."""
        self.title.set_text(block.title)
        said = block.short if self._compact and block.short else block.second
        second = f"{block.second}. {block.warning}" if block.warning else block.second
        # The panel has room for a whole sentence.
        said = tr("Not found") if block.missing and not block.busy and block.open else said
        self.second.set_text(block.warning or said)
        self._spinner.setVisible(bool(block.busy))
        self._warning.setVisible(bool(block.warning) and not block.busy)
        self.change.set_text(
            tr("Close") if block.open else tr("Choose") if block.missing else tr("Change")
        )
        self.setAccessibleName(tr("Camera: {title}, {second}", title=block.title, second=second))


class CameraPanel(QWidget):
    """Cameras found, an address, and a password where one is wanted."""

    def __init__(self, cameras: CameraFinder) -> None:
        super().__init__()
        self._cameras = cameras
        self._block: CameraBlock | None = None
        self.rows: list[TableRow] = []
        self.trouble = Text("", 14, wrap=True)
        self.note = Text("", 12, role="dim", wrap=True)
        self.search = Button(tr("Search again"), "refresh", size="small", do=cameras.search)
        self.address = TextField(tr("Address"), "192.168.1.1", "wifi")
        self.ask = Button(tr("Connect"), size="small", do=self._look_at)
        self.user = TextField(tr("User name"), "THETAYL00105377", "person")
        self.password = TextField(tr("Password"))
        self.password.edit.setEchoMode(QLineEdit.EchoMode.Password)
        self.hint = Text("", 12, role="dim", wrap=True)
        self.give = Button(tr("Use this password"), size="small", do=self._give)
        self._rows = column()
        give = (self.give, 0, Qt.AlignmentFlag.AlignLeft)
        self._secret = boxed(column(self.user, self.password, self.hint, give, gap=8))
        buttons = row(self.ask, self.search, ..., gap=8)
        parts = (self.trouble, self._rows, self.note, self.address, buttons, self._secret)
        column(*parts, into=self, gap=8, margins=(0, 0, 0, 16))
        OwnKeys(self.address.edit, self.user.edit, self.password.edit)
        self.address.entered.connect(cameras.look_at)
        self.password.entered.connect(lambda _text: self._give())
        self.user.entered.connect(lambda _text: self.password.setFocus())

    def _look_at(self) -> None:
        self._cameras.look_at(self.address.text())

    def _give(self) -> None:
        self._cameras.give_password(self.user.text(), self.password.text())

    def show_block(self, block: CameraBlock) -> None:
        """Show it; what is typed stays."""
        before, self._block = self._block, block
        if before == block:
            return
        self.setVisible(block.open)
        self.trouble.say(block.second if block.missing and not block.busy else "")
        self.note.say(block.note)
        self.search.set_busy(tr("Searching…") if block.busy else None)
        self.address.set_error(block.address_error)
        self._show_rows(block.rows, block.chosen)
        self._secret.setVisible(block.asks_password)
        if block.asks_password and (before is None or not before.asks_password):
            self.user.set_text(block.user)
        if not block.asks_password:
            self.password.set_text("")
        self.password.set_error(block.password_error)
        kept = tr("It is kept in this computer's keyring only.")
        self.hint.set_text(f"{block.password_hint} {kept}")

    def _show_rows(self, rows: tuple[CameraRow, ...], chosen: str) -> None:
        keys = tuple(row.key for row in rows)
        if tuple(row.property("key") for row in self.rows) != keys:
            clear(self._rows)
            self.rows = [self._made(row) for row in rows]
        for view, one in zip(self.rows, rows, strict=True):
            view.set(_cells(one))
            view.setToolTip(f"{one.title}, {one.second}")
            view.setAccessibleName(f"{one.title}, {one.second}")
            view.set_selected(one.key == chosen)

    def _made(self, row: CameraRow) -> TableRow:
        view = TableRow(_COLUMNS, _cells(row))
        view.setProperty("key", row.key)
        view.clicked.connect(lambda _on=False, key=row.key: self._cameras.choose(key))
        self._rows.addWidget(view)
        return view


def _cells(row: CameraRow) -> tuple[Cell, ...]:
    return Cell(""), Cell(row.title, strong=True), Cell(row.second)


_TILE: Final = 48


class CheckTile(Pressable):
    """A line of the list before pressing, with its drawing; it can be ticked."""

    def __init__(self, check: Check, compact: bool) -> None:
        super().__init__(check.words, tip=check.words if compact else "")
        self.key = check.key
        self._compact = compact
        self.wanted = (72 if compact else 192, _TILE)
        self.least = (56 if compact else 150, _TILE)
        self.setCheckable(True)
        self.setMinimumHeight(px(_TILE))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
        if not compact:
            words = Text(check.words, 12, wrap=True)
            words.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            # Three lines of a longer language make it higher.
            row(46, (words, 1, Qt.AlignmentFlag.AlignVCenter), 28, into=self, margins=(0, 6, 0, 6))

    def show_ticked(self, ticked: bool) -> None:
        """Tick it without telling anybody."""
        self.setChecked(ticked)
        self.setAccessibleDescription(tr("done") if ticked else tr("not yet done"))

    def nextCheckState(self) -> None:
        """Stay as the presenter says: a click asks, it does not tick."""

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        fill = hover_fill(t) if self.hovered() and t.contrast else t.c.raised
        edge, width = (t.c.line, t.line_width) if t.contrast else (None, 1)
        if self.isDown() or (self.hovered() and not t.contrast):
            edge, width = t.c.ctl, selected_edge(t) if self.isDown() else 1
        box(painter, self.rect(), px(8), fill, edge, width)
        side = px(28)
        if self._compact:
            spot = QRect(px(8), 0, side, self.height())
            if not self.isChecked():
                spot.moveLeft((self.width() - side) // 2)
            draw_icon(painter, self.key, spot, side, t.c.text)
        else:
            draw_icon(painter, self.key, QRect(px(10), 0, side, self.height()), side, t.c.text)
        if self.isChecked():
            mark = px(16)
            spot = QRect(self.width() - mark - px(8), 0, mark, self.height())
            draw_icon(painter, "check", spot, mark, t.c.ok)


class _FrameView(QWidget):
    """One exposure: small picture, EV, shutter, clip share."""

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
        # Under the exposure, or where there is room at its right.
        first = [self.ev, self.shutter] if narrow else [row(self.ev, ..., self.shutter, gap=None)]
        second = row(self._clip_icon, (self.clipped, 1), gap=4)
        column(self.picture, 4, self._bar, *first, second, into=self)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)

    def show_tile(self, tile: FrameTile) -> None:
        """Show it."""
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
        waiting = tile.arrived < 1.0
        self._bar.setVisible(waiting)
        self._bar.set(tile.arrived)


class FramesGrid(QWidget):
    """The exposures side by side, three or four in a line."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(px(8))
        self._grid.setVerticalSpacing(px(8))
        self.views: list[_FrameView] = []
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def resizeEvent(self, event: object) -> None:
        """Keep all pictures at 2:1 and equally high."""
        self._fit()

    def _fit(self) -> None:
        columns = 3 if len(self.views) <= 3 else 4
        width = (self.width() - (columns - 1) * px(8)) // columns
        for view in self.views:
            view.picture.setFixedHeight(max(width // 2, 8))

    def show_tiles(self, tiles: tuple[FrameTile, ...]) -> None:
        """Show as many as there are."""
        columns = 3 if len(tiles) <= 3 else 4
        if len(tiles) != len(self.views):
            for old in self.views:
                self._grid.removeWidget(old)
                old.hide()
                old.deleteLater()
            self.views = [_FrameView(columns > 3) for _ in tiles]
            for number, view in enumerate(self.views):
                self._grid.addWidget(view, number // columns, number % columns)
            for column in range(4):
                self._grid.setColumnStretch(column, 1 if column < columns else 0)
            self._fit()
        for view, tile in zip(self.views, tiles, strict=True):
            view.show_tile(tile)
