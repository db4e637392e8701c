"""View of the step for a second light."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.cards import Frame
from app.ui.widgets.icons import Icon
from app.ui.widgets.labels import Text
from app.ui.widgets.surfaces import Scroll

if TYPE_CHECKING:
    from app.ui.presenters.light import LightPresenter, LightRow, LightState

__all__ = ["LightScreen"]

_WIDTH: Final = 760


class LightScreen(QWidget):
    """Says what styles lack here and from where they are lit in a studio.

    Parameters
    ----------
    presenter : LightPresenter
        Its presenter.
    compact : bool
        For narrow windows; the layout is the same.
    """

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__()
        del compact
        self._presenter = presenter
        self._state: LightState | None = None
        t = theme()
        self._headline = Text("", 20, 600, wrap=True)
        self._words = Text("", 14, role="dim", wrap=True)
        self._go_on = Button("", kind="primary", size="main")
        self._go_on.clicked.connect(presenter.go_on)
        self._rows = QVBoxLayout()
        self._rows.setSpacing(t.px(8))
        column = QVBoxLayout()
        column.setSpacing(t.px(8))
        column.addWidget(self._headline)
        column.addWidget(self._words)
        column.addSpacing(t.px(16))
        column.addLayout(self._rows)
        column.addSpacing(t.px(16))
        foot = QHBoxLayout()
        foot.addWidget(self._go_on)
        foot.addStretch(1)
        column.addLayout(foot)
        column.addStretch(1)
        body = QWidget()
        body.setMaximumWidth(t.px(_WIDTH))
        body.setLayout(column)
        column.setContentsMargins(0, 0, 0, 0)
        middle = QWidget()
        row = QHBoxLayout(middle)
        row.setContentsMargins(t.px(24), t.px(24), t.px(24), t.px(24))
        row.addStretch(1)
        row.addWidget(body, 100)
        row.addStretch(1)
        area = Scroll(middle)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.addWidget(area)

    def show_state(self, state: LightState) -> None:
        """Show what changed."""
        if state == self._state:
            return
        before, self._state = self._state, state
        self._headline.set_text(state.headline)
        self._words.set_text(state.words)
        self._go_on.set_text(state.action)
        if before is None or before.rows != state.rows:
            while (item := self._rows.takeAt(0)) is not None:
                if (widget := item.widget()) is not None:
                    widget.hide()
                    widget.deleteLater()
            for row in state.rows:
                self._rows.addWidget(self._card(row))

    def _card(self, row: LightRow) -> QWidget:
        t = theme()
        card = Frame()
        line = QHBoxLayout(card)
        line.setContentsMargins(t.px(16), t.px(16), t.px(16), t.px(16))
        line.setSpacing(t.px(16))
        line.addWidget(Icon("bulb", 24))
        words = QVBoxLayout()
        words.setSpacing(t.px(4))
        words.addWidget(Text(row.title, 16, 600, elide=True))
        words.addWidget(Text(row.reason, 14, role="dim", wrap=True))
        for lamp in row.lamps:
            words.addWidget(Text(f"In a studio its lamp stands {lamp}.", 14, wrap=True))
        line.addLayout(words, 1)
        look = Button("Look at it", size="small")
        look.setAccessibleName(f"Look at {row.title}")
        look.clicked.connect(lambda: self._presenter.choose(row.name))
        line.addWidget(look)
        return card
