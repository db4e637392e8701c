"""The left-hand column: the lamp, its distance, its limits and the list of styles."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.core.text import tr
from app.ui.screens.light.lamp import DISTANCES_M, LampState
from app.ui.screens.light.screen import LightPresenter, LightState
from app.ui.screens.light.style_list import RowState, Section
from app.ui.screens.light.style_list_view import RowCard, SectionHeading
from app.ui.theme import px, theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.surfaces import Menu, Scroll, Surface
from app.words.phrases.quantities import metres

_LAMP_MARGIN: Final = 16

_NO_LAMP: Final = ("", tr("Choose a lamp"), tr("phone, panel, flash or your own"), "bulb")


class LampColumn(Surface):
    """The lamp, its distance, its limits and the list of styles."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__("panel", ("right",), tr("Lamp and styles"))
        self._presenter = presenter
        self._lamp: LampState | None = None
        self._sections: tuple[Section, ...] = ()
        self._busy = False
        self._last_key = ""
        self.rows: list[RowCard] = []
        self._headings: list[SectionHeading] = []
        self._compact = compact
        fields = self._make_fields()
        self._note = Text("", 14, role="dim", wrap=True)
        self._closer = Button("", size="small", do=presenter.come_closer)
        closer = row(self._closer, ..., gap=None, margins=(0, 8, 0, 0))
        self._list = column(gap=8)
        inside = QWidget()
        around = (_LAMP_MARGIN, 8, _LAMP_MARGIN, 16)
        self._column = column(
            *((fields,) if compact else ()),
            *(self._note, closer, self._list, ...),
            into=inside,
            margins=around,
        )
        self._roving = Roving(self)
        self._roving.moved.connect(self._on_row_move)
        self._scroll = Scroll(inside, name=tr("Styles with this lamp"))
        self._scroll.lend(self._column, px(_LAMP_MARGIN), px(4))
        if not compact:
            fields.setContentsMargins(*(px(side) for side in (_LAMP_MARGIN, 8, _LAMP_MARGIN, 0)))
        whole = column(*(() if compact else (fields,)), (self._scroll, 1), into=self)
        whole.setContentsMargins(0, px(8), theme().line_width, 0)
        self._note.hide()
        self._closer.hide()

    def _make_fields(self) -> QVBoxLayout:
        presenter = self._presenter
        self.lamp = ListField(tr("Your lamp"), (_NO_LAMP,), icon="bulb")
        self.lamp.chosen.connect(lambda key: presenter.take_lamp(key) if key else None)
        name = tr("Distance") if self._compact else tr("From the middle of the head")
        stops = (0.0, len(DISTANCES_M) - 1.0, 0.0, 1.0)
        self.distance = LabelledSlider(name, *stops, lambda at: metres(DISTANCES_M[round(at)]))
        self.distance.setToolTip(tr("Distance from the lamp to the middle of the head"))
        self.distance.changed.connect(lambda stop: presenter.move_away(round(stop)))
        self.arm = Toggle(tr("Within arm’s reach only"), do=presenter.set_arm)
        self.floor = Toggle(tr("Stay above floor level"), do=presenter.set_floor)
        self.more = IconButton("more", tr("More about this lamp"), kind="quiet", do=self._open_menu)
        self._bright = Text("", 12, role="dim", wrap=True)
        self.correct = Button(tr("Correct…"), kind="quiet", size="small", do=presenter.scale.ask)
        self.correct.setAccessibleName(tr("Correct the brightness of the place"))
        self._fixed = Text("", 12, role="dim", wrap=True)
        # Align with the taller field.
        lamp = row((self.lamp, 1), column(..., self.more, 8, gap=None), gap=4)
        bright = row((self._bright, 1, Qt.AlignmentFlag.AlignVCenter), self.correct, gap=4)
        fields = (self.distance, self._fixed, 4, self.arm, self.floor)
        return column(lamp, 12, *fields, 4, bright, 4)

    def show_state(self, state: LightState) -> None:
        """Show the state, updating only the parts that have changed."""
        self._show_lamp(state.lamp)
        self._note.say(state.note)
        self._closer.set_text(state.note_action)
        self._closer.setVisible(bool(state.note_action))
        dim = state.busy or state.stale
        if state.sections is not self._sections or dim != self._busy:
            self._busy = dim
            self._show_sections(state.sections)

    def _show_lamp(self, lamp: LampState) -> None:
        if lamp == self._lamp:
            return
        self._lamp = lamp
        self.lamp.set_items(lamp.items if lamp.key else (_NO_LAMP, *lamp.items))
        self.lamp.choose(lamp.key)
        self.distance.set_value(float(lamp.distance))
        self.distance.setEnabled(bool(lamp.key) and not lamp.distance_fixed)
        self._fixed.say(lamp.distance_fixed)
        self.arm.setChecked(lamp.arm)
        self.floor.setChecked(lamp.floor)
        self._bright.say(lamp.brightness)
        self.correct.setVisible(bool(lamp.brightness))
        self.more.setVisible(lamp.own)

    def _open_menu(self) -> None:
        menu = Menu(self, tr("More about this lamp"))
        for action in self._presenter.lamp_actions.actions():
            menu.add(action.words, action.run, action.icon)
        menu.drop(self.more)

    def _show_sections(self, sections: tuple[Section, ...]) -> None:
        cards = {row.state.key: row for row in self.rows}
        same = [[row.key for row in part.rows] for part in sections] == [
            [row.key for row in part.rows] for part in self._sections
        ]
        titles = [(part.title, part.count) for part in sections]
        if same and titles == [(part.title, part.count) for part in self._sections]:
            for part in sections:
                for row in part.rows:
                    cards[row.key].show_state(row, self._busy)
        else:
            self._rebuild(sections)
        self._sections = sections
        selected = next((row for row in self.rows if row.state.chosen), None)
        if selected is not None:
            self._roving.set_stop(selected)
            if selected.state.key != self._last_key:
                self._last_key = selected.state.key
                # Wait until the rows have been laid out.
                QTimer.singleShot(0, self, self._show_chosen)

    def _show_chosen(self) -> None:
        selected = next((row for row in self.rows if row.state.chosen), None)
        if selected is None or self._compact:
            return
        if selected is self.rows[0]:
            # Scroll to the top so that the heading and the note stay visible.
            self._scroll.verticalScrollBar().setValue(0)
        else:
            self._scroll.keep_visible(selected)

    def _rebuild(self, sections: tuple[Section, ...]) -> None:
        """Rearrange the rows, reusing the existing ones."""
        rows = {row.state.key: row for row in self.rows}
        headings = {heading.title: heading for heading in self._headings}
        while self._list.takeAt(0) is not None:
            pass
        self.rows, self._headings = [], []
        for part in sections:
            heading = headings.pop(part.title, None) or SectionHeading(part.title)
            heading.count.say(part.count)
            self._headings.append(heading)
            self._list.addWidget(heading)
            heading.raise_()  # Screen readers follow the stacking order.
            for state in part.rows:
                row = rows.pop(state.key, None) or self._make_row(state)
                row.show_state(state, self._busy)
                self._list.addWidget(row)
                row.raise_()
                self.rows.append(row)
        for one in (*rows.values(), *headings.values()):
            one.hide()
            one.deleteLater()
        self._scroll.settle(self._column, (*self._headings, *self.rows))
        self._roving.set_members(self.rows)

    def _make_row(self, state: RowState) -> RowCard:
        row = RowCard(state)
        row.clicked.connect(lambda _on=False, key=state.key: self._presenter.choose(key))
        row.opened.connect(self._presenter.turn)
        return row

    def _on_row_move(self, row: QWidget) -> None:
        if isinstance(row, RowCard):
            self._scroll.keep_visible(row)
            self._presenter.choose(row.state.key)
