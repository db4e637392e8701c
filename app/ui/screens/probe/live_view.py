"""The best styles in the live preview."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.probe.live import Live, RoughCard
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, column, row
from app.ui.widgets.surfaces import OutlineBox

_CARDS: Final = 3


class _RoughView(OutlineBox):
    """A style in the live preview: its name, its turn and its reliability."""

    def __init__(self, compact: bool) -> None:
        super().__init__("panel", "line")
        self.title = Text("", 14 if compact else 20, 600, elide=True)
        self.side = Text("", 12, role="dim", elide=True)
        self.turn = Text("", 20 if compact else 36, 700, "amber")
        self._arrow = Icon("clockwise", 16 if compact else 24, "amber")
        self.direction = Text("", 12 if compact else 14, role="dim", elide=True)
        self.note = Text("", 12 if compact else 14, elide=True)
        self._icon = Icon("check", 16)
        turn = row(self._arrow, (self.turn, 1), gap=8)
        line = row(self._icon, (self.note, 1), gap=6)
        gap = 0 if compact else 4
        column(
            self.title, self.side, gap, turn, self.direction, gap, line, ..., into=self, margins=12
        )
        policy = QSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        policy.setRetainSizeWhenHidden(True)
        self.setSizePolicy(policy)

    def show_card(self, card: RoughCard) -> None:
        self.title.set_text(card.title)
        self.side.set_text(card.side)
        self.turn.set_text(card.turn)
        self.direction.set_text(card.direction)
        self._arrow.set(card.arrow)
        self.note.set_text(f"{card.grade}, {card.note}")
        self._icon.set("warning" if card.unsure else "check")
        self.setAccessibleName(card.spoken)
        self.setToolTip(card.spoken)


class RoughCards(QWidget):
    """The best styles in the live preview, or the reason why there are none."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        self.message = Text("", 14, 600, wrap=True)
        self._icon = Icon("eye", 20)
        self.views: list[_RoughView] = []
        line = row((self._icon, 0, Qt.AlignmentFlag.AlignTop), (self.message, 1), gap=8)
        self._compact, self._cards = compact, row(gap=8)
        column(line, self._cards, ..., into=self, gap=8)
        # A page that is rarely visible must not make its stack taller.
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Ignored)
        self.setAccessibleName(tr("Best styles here, roughly"))

    def show_live(self, live: Live) -> None:
        """Show the styles in the preview."""
        self.message.set_text(live.message)
        self._icon.set(*(("warning", "err") if live.trouble else ("eye", "text")))
        if not self.views:  # created on first use, to open the screen faster
            self.views = [_RoughView(self._compact) for _ in range(_CARDS)]
            add(self._cards, *((view, 1) for view in self.views))
        for number, view in enumerate(self.views):
            view.setVisible(number < len(live.cards))
            if number < len(live.cards):
                view.show_card(live.cards[number])
