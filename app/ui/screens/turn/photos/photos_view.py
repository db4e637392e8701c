"""The photos taken here: a line for the last photo, and the full list."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLayout, QSizePolicy, QWidget

from app.core.text import tr, tr_plural
from app.ui.screens.turn.photos.photos import ShotRow, ShotsState
from app.ui.theme import px
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.dialogs import Sheet
from app.ui.widgets.displays import Picture
from app.ui.widgets.fields import Toggle
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, clear, column, row
from app.ui.widgets.messages import Empty
from app.ui.widgets.surfaces import PictureLine, Scroll

_ASK: Final = tr("Check my shot")
_ASK_AGAIN: Final = tr("Open")
_ASK_MORE: Final = tr("Another photo")
_HINT: Final = tr("After the shot, drop the photo here to check its light.")
_HINT_SHORT: Final = tr("After the shot, drop the photo here.")
_TITLE: Final = tr("Photos taken here")
_EMPTY: Final = tr("No photos of this place yet. Drop your photo on the window.")
_SMALL: Final = (56, 40)
_PICTURE: Final = (112, 84)
_COMPARED: Final = 208
_WIDTH: Final = 560
_ROOM: Final = 640  # in a narrower line the button has a shorter label
_TOP: Final = Qt.AlignmentFlag.AlignTop


class ShotsLine(QWidget):
    """The last photo checked, with buttons for checking another photo and for turning again."""

    listed = Signal()

    def __init__(self, ask: Callable[[], None], again: Callable[[], None]) -> None:
        super().__init__()
        self._state = ShotsState()
        self.opener = Button(_ASK, "camera", do=ask)
        self.opener.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.opener.set_tip(tr("Open the photo you took, or drop it on the window"), "P")
        self._picture = Picture(tr("The photo"), radius=4)
        self._picture.setFixedSize(px(_SMALL[0]), px(_SMALL[1]))
        self._icon = Icon("help", 20)
        self._words = Text("", 14, wrap=True)
        self._words.setMaximumHeight(px(_SMALL[1]))
        self.lister = Button(tr("All photos"), "list", size="small", do=self.listed)
        self.lister.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.again = Button(tr("Turn again"), "turn", "primary", do=again)
        self.again.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.again.set_tip(tr("Back to the guidance, with the same goal"))
        words = (self._words, 1, Qt.AlignmentFlag.AlignVCenter)
        parts = (self._picture, self._icon, words, self.again, self.lister)
        row(self.opener, *parts, into=self, gap=12)
        self.setFixedHeight(px(_SMALL[1]))
        self._fill()

    @property
    def words(self) -> str:
        """The sentence on display."""
        return self._words.text()

    def set_main(self, main: bool) -> None:
        """Set whether *Check my shot* is the main button, which it is only in the light."""
        self.opener.kind = "primary" if main else "outlined"
        self.again.kind = "outlined" if main else "primary"
        for button in (self.opener, self.again):
            button.update()

    def show_shots(self, state: ShotsState) -> None:
        """Show the last photo."""
        if state != self._state or _picture(state) is not _picture(self._state):
            self._state = state
            self._fill()

    def _fill(self) -> None:
        state = self._state
        new = bool(state.rows) and state.rows[0].new and not state.busy
        last = state.rows[0] if new else None
        self._picture.set_picture(None if last is None else last.thumbnail)
        roomy = self.width() >= px(_ROOM)
        self._picture.setVisible(last is not None and last.pictured and roomy)
        again = _ASK_AGAIN if state.rows else _ASK
        label = _ASK if last is None else _ASK_MORE
        self.opener.set_text(label if roomy else again)
        self.opener.setAccessibleName(_ASK)
        self._icon.setVisible(last is not None)
        self.again.setVisible(last is not None and last.again)
        if last is not None:
            self._icon.set(last.icon, "ok" if last.inside else "text")
            self._picture.setAccessibleName(last.name)
        self._words.set_text(self._sentence(last))
        self._words.set_role("text" if last is not None else "dim")
        lines = () if last is None else (last.sentence, last.face, last.detail)
        self._words.setToolTip("".join(f"{words}. " for words in lines if words).strip())
        count = len(state.rows)
        self.lister.setVisible(count > 0)
        self.lister.set_text(
            tr_plural("{count} photo", "All {count}", count) if roomy else f"{count}"
        )
        self.lister.setAccessibleName(tr("Photos taken here: {count}", count=count))

    def _sentence(self, last: ShotRow | None) -> str:
        if self._state.busy:
            return self._state.busy
        if last is not None:
            return ". ".join(words for words in (last.sentence, last.face, "") if words) + "."
        return _HINT if self.width() >= px(_ROOM) else _HINT_SHORT

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Shorten the button's label when space is short."""
        super().resizeEvent(event)
        self._fill()

    def minimumSizeHint(self) -> QSize:
        """Return a minimum size that allows the sentence to be truncated."""
        return QSize(0, self.height())


def _together(words: str) -> str:
    """Return the text with non-breaking spaces where a line must not break."""
    return words.replace(": ", ":\u00a0").replace(" %", "\u00a0%")


def _picture(state: ShotsState) -> object:
    return state.rows[0].thumbnail if state.rows else None


class ShotsSheet(Sheet):
    """All photos taken here, newest first."""

    def __init__(
        self, host: QWidget, remove: Callable[[str], None], mirror: Callable[[bool], None]
    ) -> None:
        super().__init__(host, _TITLE, _WIDTH, "right")
        self._remove = remove
        self._state: ShotsState | None = None
        self._pictures: tuple[int, ...] = ()
        inside = QWidget()
        self._column = column(into=inside, gap=8, margins=(0, 0, 16, 0))
        self.mirrored = Toggle(tr("Mirrored"), do=mirror)
        self.mirrored.setToolTip(tr("For new photos whose background is not found here"))
        self.body.addWidget(self.mirrored)
        self.body.addWidget(Scroll(inside), 1)

    def show_shots(self, state: ShotsState) -> None:
        """Show the list of photos."""
        self.mirrored.setChecked(state.mirrored)
        pictures = tuple(id(shot.thumbnail) for shot in state.rows)
        if state == self._state and pictures == self._pictures:
            return
        self._state, self._pictures = state, pictures
        clear(self._column)
        lines = [self._line(shot) for shot in state.rows] or [Empty(_EMPTY)]
        add(self._column, *_compared(state), *lines, ...)

    def _line(self, shot: ShotRow) -> QWidget:
        frame = PictureLine(shot.name, shot.thumbnail, _PICTURE, raised=shot.new)
        frame.setAccessibleName(f"{shot.sentence}. {shot.detail}")
        icon = Icon(shot.icon, 20, "ok" if shot.inside else "text")
        sentence = Text(shot.sentence, 14, 600, wrap=True)
        face = Text(_together(shot.face), 14, wrap=True)
        detail = Text(_together(shot.detail), 12, role="dim", wrap=True)
        add(frame.words, row((icon, 0, _TOP), (sentence, 1), gap=8), face, detail, ...)
        face.setVisible(bool(shot.face))
        remove = IconButton(
            "trash", tr("Remove {name}", name=shot.name), kind="quiet", size="small"
        )
        remove.clicked.connect(lambda: self._remove(shot.key))
        frame.row.addWidget(remove, 0, _TOP)
        return frame


def _compared(state: ShotsState) -> list[QLayout]:
    """Lay out the last two photos of a style side by side."""
    pictures = []
    for tag, shot in ((tr("Before"), state.before), (tr("After"), state.after)):
        if shot is not None:
            picture = Picture(tag)
            picture.setFixedHeight(px(_COMPARED))
            picture.set_picture(shot.thumbnail)
            picture.set_tag(tag)
            pictures.append((picture, 1))
    return [row(*pictures, gap=8)] if pictures else []
