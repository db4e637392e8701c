"""The camera: its name, its status and the panel for choosing another camera."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit, QWidget

from app.core.text import tr
from app.ui.screens.probe.capture.camera import CameraBlock, CameraFinder
from app.ui.screens.probe.capture.checklist import ChoiceRow
from app.ui.theme import px
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.buttons import Button
from app.ui.widgets.displays import Spinner
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import boxed, clear, column, row
from app.ui.widgets.lists import Cell, Column, TableRow
from app.ui.widgets.surfaces import OutlineBox

_COLUMNS = (Column("", 12), Column(""), Column("", 150))


class CameraHead(QWidget):
    """The camera's name and status, and the *Change* button."""

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
        badge = OutlineBox("raised", "none")
        row(Icon("theta", 24), into=badge, margins=12)
        row(badge, (words, 1), change, into=self, gap=16)

    def show_block(self, block: CameraBlock) -> None:
        """Show the camera's name and status."""
        self.title.set_text(block.title)
        words = block.short if self._compact and block.short else block.second
        second = f"{block.second}. {block.warning}" if block.warning else block.second
        # The panel has room for a whole sentence.
        words = tr("Not found") if block.missing and not block.busy and block.open else words
        self.second.set_text(block.warning or words)
        self._spinner.setVisible(bool(block.busy))
        self._warning.setVisible(bool(block.warning) and not block.busy)
        self.change.set_text(
            tr("Close") if block.open else tr("Choose") if block.missing else tr("Change")
        )
        self.setAccessibleName(tr("Camera: {title}, {second}", title=block.title, second=second))


class CameraPanel(QWidget):
    """The list of cameras, an address field and, if needed, a password form."""

    def __init__(self, cameras: CameraFinder) -> None:
        super().__init__()
        self._cameras = cameras
        self._block: CameraBlock | None = None
        self.rows: list[TableRow] = []
        self.hide()

    def _build(self) -> None:
        """Create the controls on demand. They are not needed if a camera is found at once."""
        cameras = self._cameras
        self.trouble = Text("", 14, wrap=True)
        self.note = Text("", 12, role="dim", wrap=True)
        self.search = Button(tr("Search again"), "refresh", size="small", do=cameras.search)
        self.address = TextField(tr("Address"), "192.168.1.1", "wifi")
        self.ask = Button(tr("Connect"), size="small")
        self.ask.clicked.connect(lambda: cameras.look_at(self.address.text()))
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

    def _give(self) -> None:
        self._cameras.give_password(self.user.text(), self.password.text())

    def show_block(self, block: CameraBlock) -> None:
        """Show the cameras without disturbing any text that is being typed."""
        before, self._block = self._block, block
        if before == block or not (block.open or self.layout()):
            return
        if self.layout() is None:
            self._build()
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
        hint = tr("The password is saved only in this computer's keyring.")
        self.hint.set_text(f"{block.password_hint} {hint}")

    def _show_rows(self, rows: tuple[ChoiceRow, ...], key: str) -> None:
        keys = tuple(row.key for row in rows)
        if tuple(row.property("key") for row in self.rows) != keys:
            clear(self._rows)
            self.rows = [self._make_row(row) for row in rows]
        for view, one in zip(self.rows, rows, strict=True):
            view.set(_cells(one))
            view.setToolTip(f"{one.title}, {one.second}")
            view.setAccessibleName(f"{one.title}, {one.second}")
            view.set_selected(one.key == key)

    def _make_row(self, row: ChoiceRow) -> TableRow:
        view = TableRow(_COLUMNS, _cells(row))
        view.setProperty("key", row.key)
        view.clicked.connect(lambda _on=False, key=row.key: self._cameras.choose(key))
        self._rows.addWidget(view)
        return view


def _cells(row: ChoiceRow) -> tuple[Cell, ...]:
    return Cell(""), Cell(row.title, strong=True), Cell(row.second)
