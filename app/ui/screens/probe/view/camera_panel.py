"""The camera in use, and the panel in which another one is chosen."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QRect, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.buttons import Button
from app.ui.widgets.displays import Spinner
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.lists import Cell, Column, TableRow
from app.ui.widgets.paint import box

if TYPE_CHECKING:
    from app.ui.screens.probe.state import CameraBlock, CameraRow

_COLUMNS = (Column("", 12), Column(""), Column("", 150))


class _Badge(QWidget):
    """The drawing of a camera on a plate of 48."""

    def __init__(self) -> None:
        super().__init__()
        side = theme().px(48)
        self.setFixedSize(side, side)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        edge = t.c.line if t.contrast else None
        box(painter, self.rect(), t.px(8), t.c.raised, edge, t.line_width)
        draw_icon(painter, "theta", QRect(self.rect()), t.px(24), t.c.text)


class CameraHead(QWidget):
    """Name, how it is, and Change."""

    change_asked = Signal()

    def __init__(self, compact: bool) -> None:
        super().__init__()
        t = theme()
        self._compact = compact
        self.setFixedHeight(t.px(48))
        self.title = Text("", 16, 600, elide=True)
        self.second = Text("", 14, role="dim", elide=True)
        self._warning = Icon("warning", 16, "err")
        self._spinner = Spinner("Looking for cameras")
        self.change = Button("Change", size="small")
        words = QVBoxLayout()
        words.setSpacing(0)
        words.addStretch(1)
        words.addWidget(self.title)
        line = QHBoxLayout()
        line.setSpacing(t.px(6))
        for widget in (self._spinner, self._warning):
            line.addWidget(widget)
        line.addWidget(self.second, 1)
        words.addLayout(line)
        words.addStretch(1)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(t.px(16))
        row.addWidget(_Badge())
        row.addLayout(words, 1)
        row.addWidget(self.change, 0, Qt.AlignmentFlag.AlignVCenter)
        self.change.clicked.connect(self.change_asked)

    def show_block(self, block: CameraBlock) -> None:
        """Show it."""
        self.title.set_text(block.title)
        said = block.short if self._compact and block.short else block.second
        second = f"{block.second}. {block.warning}" if block.warning else block.second
        # The panel has room for a whole sentence.
        said = "Not found" if block.missing and not block.busy and block.open else said
        self.second.set_text(block.warning or said)
        self._spinner.setVisible(bool(block.busy))
        self._warning.setVisible(bool(block.warning) and not block.busy)
        self.change.set_text("Close" if block.open else "Choose" if block.missing else "Change")
        self.setAccessibleName(f"Camera: {block.title}, {second}")


class CameraPanel(QWidget):
    """Cameras found, an address, and a password where one is wanted."""

    chosen = Signal(str)
    address_given = Signal(str)
    password_given = Signal(str, str)
    search_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        t = theme()
        self._block: CameraBlock | None = None
        self.rows: list[TableRow] = []
        self.trouble = Text("", 14, wrap=True)
        self.note = Text("", 12, role="dim", wrap=True)
        self.search = Button("Search again", "refresh", size="small")
        self.address = TextField("Address", "192.168.1.1", "wifi")
        self.ask = Button("Connect", size="small")
        self.user = TextField("User name", "THETAYL00105377", "person")
        self.password = TextField("Password")
        self.password.edit.setEchoMode(QLineEdit.EchoMode.Password)
        self.hint = Text("", 12, role="dim", wrap=True)
        self.give = Button("Use this password", size="small")
        self._rows = QVBoxLayout()
        self._rows.setSpacing(0)
        self._secret = QWidget()
        secret = QVBoxLayout(self._secret)
        secret.setContentsMargins(0, 0, 0, 0)
        secret.setSpacing(t.px(8))
        for widget in (self.user, self.password, self.hint):
            secret.addWidget(widget)
        secret.addWidget(self.give, 0, Qt.AlignmentFlag.AlignLeft)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, t.px(16))
        column.setSpacing(t.px(8))
        column.addWidget(self.trouble)
        column.addLayout(self._rows)
        column.addWidget(self.note)
        column.addWidget(self.address)
        line = QHBoxLayout()
        line.setSpacing(t.px(8))
        line.addWidget(self.ask)
        line.addWidget(self.search)
        line.addStretch(1)
        column.addLayout(line)
        column.addWidget(self._secret)
        self._connect()

    def _connect(self) -> None:
        OwnKeys(self.address.edit, self.user.edit, self.password.edit)
        self.search.clicked.connect(self.search_asked)
        self.ask.clicked.connect(lambda: self.address_given.emit(self.address.text()))
        self.address.entered.connect(self.address_given)
        self.give.clicked.connect(self._give)
        self.password.entered.connect(lambda _text: self._give())
        self.user.entered.connect(lambda _text: self.password.setFocus())

    def _give(self) -> None:
        self.password_given.emit(self.user.text(), self.password.text())

    def show_block(self, block: CameraBlock) -> None:
        """Show it; what is typed stays."""
        before, self._block = self._block, block
        if before == block:
            return
        self.setVisible(block.open)
        self.trouble.set_text(block.second if block.missing and not block.busy else "")
        self.trouble.setVisible(bool(self.trouble.text()))
        self.note.set_text(block.note)
        self.note.setVisible(bool(block.note))
        self.search.set_busy("Searching…" if block.busy else None)
        self.address.set_error(block.address_error)
        self._show_rows(block.rows, block.chosen)
        self._secret.setVisible(block.asks_password)
        if block.asks_password and (before is None or not before.asks_password):
            self.user.set_text(block.user)
        if not block.asks_password:
            self.password.set_text("")
        self.password.set_error(block.password_error)
        self.hint.set_text(f"{block.password_hint} It is kept in this computer's keyring only.")

    def _show_rows(self, rows: tuple[CameraRow, ...], chosen: str) -> None:
        keys = tuple(row.key for row in rows)
        if tuple(row.property("key") for row in self.rows) != keys:
            for old in self.rows:
                self._rows.removeWidget(old)
                old.hide()
                old.deleteLater()
            self.rows = [self._made(row) for row in rows]
        for view, row in zip(self.rows, rows, strict=True):
            view.set(_cells(row))
            view.setToolTip(f"{row.title}, {row.second}")
            view.setAccessibleName(f"{row.title}, {row.second}")
            view.set_selected(row.key == chosen)

    def _made(self, row: CameraRow) -> TableRow:
        view = TableRow(_COLUMNS, _cells(row))
        view.setProperty("key", row.key)
        view.clicked.connect(lambda _on=False, key=row.key: self.chosen.emit(key))
        self._rows.addWidget(view)
        return view


def _cells(row: CameraRow) -> tuple[Cell, ...]:
    return Cell(""), Cell(row.title, strong=True), Cell(row.second)
