"""Target and Now side by side, with the text about the style."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QBoxLayout, QSizePolicy

from app.core.text import tr
from app.ui.theme import px
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row

if TYPE_CHECKING:
    from app.ui.screens.turn.pictures import Pictures
    from app.ui.screens.turn.portraits import StyleWords


class Portraits:
    """Both portraits and the text beside them.

    Attributes:
        layout: The layout to add to the column.
    """

    def __init__(self, factor: float) -> None:
        def size(designed: int) -> int:
            return max(round(designed * factor), 12)

        self._target, self._now = Picture(tr("Target")), Picture(tr("Now"))
        for picture in (self._target, self._now):
            picture.setFixedSize(px(max(132 * factor, 64)), px(max(136 * factor, 66)))
        self._target.set_tag(tr("Target"))
        self._title = Text("", max(size(20), 14), 600, elide=True)
        self._side = Text("", size(14), role="dim", wrap=True)
        narrow = QSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        narrow.setHeightForWidth(True)
        self._side.setSizePolicy(narrow)  # its longest word must not widen the column
        self._match = Text("", size(14), 600, elide=True)
        self._match_goal = Text("", size(14), role="dim", elide=True)
        self._face = Text("", size(14), 600, elide=True)
        title = (..., self._title, self._side, max(8 * factor, 4))
        words = column(*title, self._match, self._match_goal, self._face, ...)
        parts = (self._target, self._now, 8 * factor, (words, 1))
        self.layout: QBoxLayout = row(*parts, gap=8 * factor)

    @property
    def size(self) -> QSize:
        """Size of each portrait, in logical pixels."""
        return self._target.size()

    def show_style(self, words: StyleWords, pictures: Pictures) -> None:
        """Show the portraits and the text."""
        self._target.set_picture(pictures.target)
        self._now.set_picture(pictures.now)
        self._now.set_tag(words.now_tag)
        self._now.setAccessibleName(words.now_tag)
        self._title.set_text(words.title)
        self._side.set_text(words.side)
        self._match.set_text(words.match)
        self._match_goal.set_text(words.match_at_goal)
        self._face.say(words.face)
