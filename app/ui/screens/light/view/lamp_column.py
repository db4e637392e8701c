"""The left column: which lamp, how near, within what reach, and what it does for the styles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.core.second_light.placements import metres
from app.ui.screens.light.state import DISTANCES_M, LampState
from app.ui.screens.light.view.row import RowCard
from app.ui.theme import theme
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text
from app.ui.widgets.surfaces import Menu, Scroll, Surface

if TYPE_CHECKING:
    from app.ui.screens.light.presenter import LightPresenter
    from app.ui.screens.light.state import LightState, Section

_MARGIN: Final = 16
_NO_LAMP: Final = ("", "Choose a lamp", "phone, panel, flash or your own", "bulb")


class LampColumn(Surface):
    """Lamp, distance, reach and the list of styles."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__("panel", ("right",))
        self._presenter = presenter
        self._lamp: LampState | None = None
        self._sections: tuple[Section, ...] = ()
        self._busy = False
        self._seen = ""
        self.rows: list[RowCard] = []
        self.setAccessibleName("Lamp and styles")
        self._compact = compact
        t = theme()
        inside = QWidget()
        column = QVBoxLayout(inside)
        margin = t.px(_MARGIN)
        column.setContentsMargins(margin, t.px(8), margin, t.px(16))
        column.setSpacing(0)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, t.px(8), t.line_width, 0)
        whole.setSpacing(0)
        fields = QVBoxLayout()
        fields.setContentsMargins(*((0, 0, 0, 0) if compact else (margin, t.px(8), margin, 0)))
        fields.setSpacing(0)
        self._make_fields(fields)
        (column if compact else whole).addLayout(fields)
        self._note = Text("", 14, role="dim", wrap=True)
        self._closer = Button("", size="small")
        self._closer.clicked.connect(presenter.come_closer)
        foot = QHBoxLayout()
        foot.setContentsMargins(0, t.px(8), 0, 0)
        foot.addWidget(self._closer)
        foot.addStretch(1)
        column.addWidget(self._note)
        column.addLayout(foot)
        self._list = QVBoxLayout()
        self._list.setSpacing(t.px(8))
        column.addLayout(self._list)
        column.addStretch(1)
        self._roving = Roving(self)
        self._roving.moved.connect(self._moved)
        self._scroll = Scroll(inside)
        self._scroll.setAccessibleName("Styles with this lamp")
        self._column = column
        self._scroll.bar_changed.connect(self._make_way)
        whole.addWidget(self._scroll, 1)
        self._note.hide()
        self._closer.hide()

    def _make_fields(self, column: QVBoxLayout) -> None:
        t, presenter = theme(), self._presenter
        self.lamp = ListField("Your lamp", (_NO_LAMP,), icon="bulb")
        self.lamp.chosen.connect(lambda key: presenter.take_lamp(key) if key else None)
        self.distance = LabelledSlider(
            "Distance" if self._compact else "From the middle of the head",
            0.0,
            float(len(DISTANCES_M) - 1),
            0.0,
            1.0,
            lambda stop: metres(DISTANCES_M[round(stop)]),
        )
        self.distance.setToolTip("How far the lamp is from the middle of the head")
        self.distance.changed.connect(lambda stop: presenter.move_away(round(stop)))
        self.arm = Toggle("Within arm’s reach only")
        self.arm.switched.connect(presenter.set_arm)
        self.floor = Toggle("Not through the floor")
        self.floor.switched.connect(presenter.set_floor)
        self.more = IconButton("more", "More about this lamp", kind="quiet")
        self.more.clicked.connect(self._open_menu)
        self._bright = Text("", 12, role="dim", wrap=True)
        self.correct = Button("Correct…", kind="quiet", size="small")
        self.correct.setAccessibleName("Correct how bright it is here")
        self.correct.clicked.connect(presenter.scale.ask)
        self._fixed = Text("", 12, role="dim", wrap=True)
        lamp = QHBoxLayout()
        lamp.setSpacing(t.px(4))
        lamp.addWidget(self.lamp, 1)
        beside = QVBoxLayout()
        beside.addStretch(1)
        beside.addWidget(self.more)
        beside.addSpacing(t.px(8))  # in line with the field, which is higher
        lamp.addLayout(beside)
        column.addLayout(lamp)
        column.addSpacing(t.px(12))
        column.addWidget(self.distance)
        column.addWidget(self._fixed)
        column.addSpacing(t.px(4))
        column.addWidget(self.arm)
        column.addWidget(self.floor)
        column.addSpacing(t.px(4))
        bright = QHBoxLayout()
        bright.setSpacing(t.px(4))
        bright.addWidget(self._bright, 1, Qt.AlignmentFlag.AlignVCenter)
        bright.addWidget(self.correct)
        column.addLayout(bright)
        column.addSpacing(t.px(4))

    def show_state(self, state: LightState) -> None:
        """Show what changed."""
        self._show_lamp(state.lamp)
        self._note.set_text(state.note)
        self._note.setVisible(bool(state.note))
        self._closer.set_text(state.note_action)
        self._closer.setVisible(bool(state.note_action))
        if state.sections is not self._sections or state.busy != self._busy:
            self._busy = state.busy
            self._show_sections(state.sections)

    def _show_lamp(self, lamp: LampState) -> None:
        if lamp == self._lamp:
            return
        self._lamp = lamp
        self.lamp.set_items(lamp.items if lamp.key else (_NO_LAMP, *lamp.items))
        self.lamp.choose(lamp.key)
        self.distance.set_value(float(lamp.distance))
        self.distance.setEnabled(bool(lamp.key) and not lamp.distance_fixed)
        self._fixed.set_text(lamp.distance_fixed)
        self._fixed.setVisible(bool(lamp.distance_fixed))
        self.arm.set_on(lamp.arm)
        self.floor.set_on(lamp.floor)
        self._bright.set_text(lamp.brightness)
        for widget in (self._bright, self.correct):
            widget.setVisible(bool(lamp.brightness))
        self.more.setVisible(lamp.own)

    def _open_menu(self) -> None:
        menu = Menu(self, "More about this lamp")
        for action in self._presenter.keeping.actions():
            menu.add(action.words, action.run, action.icon)
        menu.drop(self.more)

    def _show_sections(self, sections: tuple[Section, ...]) -> None:
        known = {row.state.key: row for row in self.rows}
        same = [[row.key for row in part.rows] for part in sections] == [
            [row.key for row in part.rows] for part in self._sections
        ]
        titles = [(part.title, part.count) for part in sections]
        if same and titles == [(part.title, part.count) for part in self._sections]:
            for part in sections:
                for row in part.rows:
                    known[row.key].show_state(row, self._busy)
        else:
            self._rebuild(sections)
        self._sections = sections
        chosen = next((row for row in self.rows if row.state.chosen), None)
        if chosen is not None:
            self._roving.set_stop(chosen)
            if chosen.state.key != self._seen:
                self._seen = chosen.state.key
                # Once the rows have their places.
                QTimer.singleShot(0, self, self._show_chosen)

    def _show_chosen(self) -> None:
        chosen = next((row for row in self.rows if row.state.chosen), None)
        if chosen is None or self._compact:
            return
        if chosen is self.rows[0]:
            # With its title, and what is said above it.
            self._scroll.verticalScrollBar().setValue(0)
        else:
            self._scroll.keep_visible(chosen)

    def _rebuild(self, sections: tuple[Section, ...]) -> None:
        focused = next((row.state.key for row in self.rows if row.hasFocus()), "")
        while (item := self._list.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        self.rows = []
        for part in sections:
            self._list.addWidget(_Heading(part.title, part.count))
            for state in part.rows:
                row = RowCard(state)
                row.show_state(state, self._busy)
                row.clicked.connect(lambda _on=False, key=state.key: self._presenter.choose(key))
                row.opened.connect(self._presenter.turn)
                self._list.addWidget(row)
                self.rows.append(row)
        self._roving.set_members(self.rows)
        again = next((row for row in self.rows if row.state.key == focused), None)
        if again is not None:
            again.setFocus()

    def _moved(self, row: QWidget) -> None:
        if isinstance(row, RowCard):
            self._scroll.keep_visible(row)
            self._presenter.choose(row.state.key)

    def _make_way(self, width: int) -> None:
        """Let the bar lie in the margin."""
        around = self._column.contentsMargins()
        around.setRight(max(theme().px(_MARGIN) - width, theme().px(4)))
        self._column.setContentsMargins(around)


class _Heading(QWidget):
    """The title of a part of the list, and how many there are."""

    def __init__(self, title: str, count: str) -> None:
        super().__init__()
        row = QHBoxLayout(self)
        row.setContentsMargins(0, theme().px(8), 0, 0)
        row.addWidget(Text(title, 14, 600, elide=True), 1)
        row.addWidget(Text(count, 14, role="dim"))
