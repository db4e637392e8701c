"""The list of places that were kept, with small pictures."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QHBoxLayout, QInputDialog, QVBoxLayout, QWidget

from app.ui.presenters.places_list import PlacesListPresenter
from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.messages import Empty
from app.ui.widgets.surfaces import Menu, PictureLine, Scroll

if TYPE_CHECKING:
    from pathlib import Path

    from app.ui.presenters.places_list import DeletedRow, PlacesListRow, PlacesListState
    from app.ui.shell.commands import Commands

_PICTURE: Final = (128, 64)


class PlacesBody(QWidget):
    """The list."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self._presenter = PlacesListPresenter(commands.services, commands.desk)
        self._state: PlacesListState | None = None
        self._stops: list[QWidget] = []
        t = theme()
        self._column = QVBoxLayout()
        self._column.setSpacing(t.px(8))
        self._column.addStretch(1)
        inside = QWidget()
        inside.setLayout(self._column)
        self._column.setContentsMargins(0, 0, t.px(16), 0)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(t.px(16))
        whole.addWidget(Scroll(inside), 1)
        whole.addLayout(self._foot())
        self.destroyed.connect(self._presenter.detach)
        self._presenter.attach(self)

    def show_state(self, state: PlacesListState) -> None:
        """Show the list."""
        if state == self._state:
            return
        self._state = state
        while (item := self._column.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        if not state.rows and not state.busy:
            self._column.addWidget(Empty("No place measured yet. The demo place needs no camera."))
        self._stops = []
        for row in state.rows:
            self._column.addWidget(self._line(row))
        if state.deleted:
            self._column.addWidget(Text("Deleted", 12, 600, role="dim"))
        for gone in state.deleted:
            self._column.addWidget(self._deleted_line(gone))
        self._column.addStretch(1)
        self._order_stops()

    def _order_stops(self) -> None:
        """Lead Tab through the places first: they stand above the buttons, but come later."""
        for before, after in pairwise([*self._stops, self._demo, self._files]):
            QWidget.setTabOrder(before, after)
        if self._stops and self._demo.hasFocus():
            self._stops[0].setFocus(Qt.FocusReason.OtherFocusReason)

    def _foot(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(theme().px(8))
        self._demo = demo = Button("Try the demo place", "pin")
        self._files = files = Button("Open files…", "file")
        demo.clicked.connect(lambda: self._leave(self._commands.desk.open_demo))
        files.clicked.connect(lambda: self._leave(self._commands.open_files))
        row.addWidget(demo)
        row.addWidget(files)
        row.addStretch(1)
        return row

    def _leave(self, call: object) -> None:
        self._commands.close_overlay()
        assert callable(call)
        call()

    def _line(self, row: PlacesListRow) -> QWidget:
        frame = PictureLine(row.name, row.thumbnail, _PICTURE, raised=row.current)
        line, words = frame.row, frame.words
        words.addWidget(Text(row.name, 14, 600, elide=True))
        when = f"{row.time}, open now" if row.current else row.time
        words.addWidget(Text(when, 12, role="dim", elide=True))
        if row.detail:
            detail = QHBoxLayout()
            if row.trouble:
                detail.addWidget(Icon("warning", 16, says="warning"))
            detail.addWidget(Text(row.detail, 12, role="dim", wrap=True), 1)
            words.addLayout(detail)
        self._add_opener(row, line)
        more = IconButton("more", f"More about {row.name}", kind="quiet", size="small")
        more.clicked.connect(lambda: self._more(row, more))
        line.addWidget(more)
        self._stops.append(more)
        return frame

    def _add_opener(self, row: PlacesListRow, line: QHBoxLayout) -> None:
        """Offer to open or to finish it; of one without any frame nothing can be made."""
        if row.left is not None and not row.left.can_finish:
            return
        words = "Finish" if row.left is not None else "Open again" if row.current else "Open"
        opener = Button(words, size="small")
        opener.setAccessibleName(f"{words.split()[0]} {row.name}")
        opener.clicked.connect(lambda: self._leave(lambda: self._presenter.open(row.folder)))
        line.addWidget(opener)
        self._stops.append(opener)

    def _deleted_line(self, row: DeletedRow) -> QWidget:
        frame = PictureLine(row.name, None, _PICTURE)
        frame.words.addWidget(Text(row.name, 14, role="dim", elide=True))
        frame.words.addWidget(Text(row.detail, 12, role="dim", elide=True))
        back = Button("Bring back", "undo", size="small")
        back.setAccessibleName(f"Bring back {row.name}")
        back.clicked.connect(lambda: self._presenter.restore(row.folder))
        frame.row.addWidget(back)
        self._stops.append(back)
        return frame

    def _more(self, row: PlacesListRow, under: QWidget) -> None:
        menu = Menu(self, f"More about {row.name}")
        menu.add("Rename…", lambda: self._rename(row), "edit")
        menu.add("Show the folder", lambda: _show_folder(row.folder), "folder")
        menu.add("Delete", lambda: self._presenter.delete(row.folder), "trash")
        menu.drop(under)

    def _rename(self, row: PlacesListRow) -> None:
        name, agreed = QInputDialog.getText(self, "Rename", "Name of the place", text=row.name)
        if agreed and name.strip():
            self._presenter.rename(row.folder, name)


def _show_folder(folder: Path) -> None:
    QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))
