"""After the shot: the line at the foot of the left column, and the list of photos taken here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from app.ui.screens.turn.state import ShotsState
from app.ui.theme import theme
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.messages import Empty
from app.ui.widgets.surfaces import PictureLine, Scroll

if TYPE_CHECKING:
    from collections.abc import Callable

    from PySide6.QtGui import QResizeEvent

    from app.ui.screens.turn.state import ShotRow

_ASK: Final = "How was it? Open the photo"
_ASK_SHORT: Final = "How was it?"
_ASK_AGAIN: Final = "Open"
_HINT: Final = "After the shot, drop it here: how far off the light was it?"
_HINT_SHORT: Final = "After the shot, drop the photo here."
_TITLE: Final = "Photos taken here"
_EMPTY: Final = "No photo of this place yet. Drop the one you took on the window."
_SMALL: Final = (56, 40)
_PICTURE: Final = (112, 84)
_WIDTH: Final = 560
_ROOM: Final = 640  # below this the button says less


class ShotsLine(QWidget):
    """Asks for the photo, and says how the last one was."""

    asked = Signal()
    listed = Signal()

    def __init__(self) -> None:
        super().__init__()
        t = theme()
        self._state = ShotsState()
        self._open = Button(_ASK, "camera")
        self._open.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._open.set_tip("Open the photo you took, or drop it on the window", "P")
        self._open.clicked.connect(self.asked)
        self._picture = Picture("The photo", radius=4)
        self._picture.setFixedSize(t.px(_SMALL[0]), t.px(_SMALL[1]))
        self._icon = Icon("help", 20)
        self._words = Text("", 14, wrap=True)
        self._words.setMaximumHeight(t.px(_SMALL[1]))
        self._all = Button("All photos", "list", size="small")
        self._all.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._all.clicked.connect(self.listed)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(t.px(12))
        row.addWidget(self._open)
        row.addWidget(self._picture)
        row.addWidget(self._icon)
        row.addWidget(self._words, 1, Qt.AlignmentFlag.AlignVCenter)
        row.addWidget(self._all)
        self.setFixedHeight(t.px(_SMALL[1]))
        self._fill()

    @property
    def words(self) -> str:
        """What it says."""
        return self._words.text()

    @property
    def opener(self) -> Button:
        """The button that asks for the photo."""
        return self._open

    @property
    def lister(self) -> Button:
        """The button that shows the list."""
        return self._all

    def show_shots(self, state: ShotsState) -> None:
        """Say how the last photo was."""
        if state != self._state or _picture(state) is not _picture(self._state):
            self._state = state
            self._fill()

    def _fill(self) -> None:
        state = self._state
        last = state.rows[0] if state.rows and not state.busy else None
        self._picture.set_picture(None if last is None else last.thumbnail)
        roomy = self.width() >= theme().px(_ROOM)
        self._picture.setVisible(last is not None and last.pictured and roomy)
        again = _ASK_AGAIN if state.rows else _ASK_SHORT
        self._open.set_text(_ASK if roomy else again)
        self._open.setAccessibleName(_ASK)
        self._icon.setVisible(last is not None)
        if last is not None:
            self._icon.set(last.icon, "ok" if last.inside else "text")
            self._picture.setAccessibleName(last.name)
        self._words.set_text(self._sentence(last))
        self._words.set_role("text" if last is not None else "dim")
        self._words.setToolTip("" if last is None else f"{last.sentence}. {last.detail}.")
        count = len(state.rows)
        self._all.setVisible(count > 0)
        self._all.set_text(("1 photo" if count == 1 else f"All {count}") if roomy else f"{count}")
        self._all.setAccessibleName(f"{_TITLE}: {count}")

    def _sentence(self, last: ShotRow | None) -> str:
        if self._state.busy:
            return self._state.busy
        if last is not None:
            return f"{last.sentence}."
        return _HINT if self.width() >= theme().px(_ROOM) else _HINT_SHORT

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say less where there is less room."""
        super().resizeEvent(event)
        self._fill()

    def minimumSizeHint(self) -> QSize:
        """Cut the sentence rather than be wider than there is room."""
        return QSize(0, self.height())


def _together(words: str) -> str:
    """Let no line end between a number and what it counts."""
    return words.replace(": ", ":\u00a0").replace(" %", "\u00a0%")


def _picture(state: ShotsState) -> object:
    return state.rows[0].thumbnail if state.rows else None


class ShotsSheet(Sheet):
    """All photos taken here, the last one first."""

    def __init__(self, host: QWidget, remove: Callable[[str], None]) -> None:
        super().__init__(host, _TITLE, _WIDTH, "right")
        self._remove = remove
        self._state: ShotsState | None = None
        self._pictures: tuple[int, ...] = ()
        t = theme()
        self._column = QVBoxLayout()
        self._column.setSpacing(t.px(8))
        self._column.setContentsMargins(0, 0, t.px(16), 0)
        inside = QWidget()
        inside.setLayout(self._column)
        self.body.addWidget(Scroll(inside), 1)

    def show_shots(self, state: ShotsState) -> None:
        """Show the list."""
        pictures = tuple(id(row.thumbnail) for row in state.rows)
        if state == self._state and pictures == self._pictures:
            return
        self._state, self._pictures = state, pictures
        while (item := self._column.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        if not state.rows:
            self._column.addWidget(Empty(_EMPTY))
        for row in state.rows:
            self._column.addWidget(self._line(row))
        self._column.addStretch(1)

    def _line(self, row: ShotRow) -> QWidget:
        t = theme()
        frame = PictureLine(row.name, row.thumbnail, _PICTURE, raised=row.new)
        frame.setAccessibleName(f"{row.sentence}. {row.detail}")
        words = frame.words
        head = QHBoxLayout()
        head.setSpacing(t.px(8))
        head.addWidget(Icon(row.icon, 20, "ok" if row.inside else "text"), 0, _TOP)
        head.addWidget(Text(row.sentence, 14, 600, wrap=True), 1)
        words.addLayout(head)
        words.addWidget(Text(_together(row.detail), 12, role="dim", wrap=True))
        words.addStretch(1)
        remove = IconButton("trash", f"Remove {row.name}", kind="quiet", size="small")
        remove.clicked.connect(lambda: self._remove(row.key))
        frame.row.addWidget(remove, 0, _TOP)
        return frame


_TOP: Final = Qt.AlignmentFlag.AlignTop
