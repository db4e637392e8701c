"""The left column: which lamp, how near, within what reach, and what it does for the styles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from app.core.text import tr
from app.core.text.quantities import metres
from app.ui.screens.light.state import DISTANCES_M, LampState, LightState, RowState, Section
from app.ui.theme import px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import Roving, describe
from app.ui.widgets.buttons import Button, IconButton
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.displays import Picture, draw_meter
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import RIGHT, put_text, text_width
from app.ui.widgets.surfaces import Card, Menu, Scroll, Surface

if TYPE_CHECKING:
    from app.ui.screens.light.presenter import LightPresenter


HEIGHT: Final = 76
"""Of a row, logical pixels at scale 1."""

PICTURE: Final = 56
"""Side of its picture."""

_PAD: Final = 8
_ARROW: Final = 16
_LONGEST: Final = tr("{share} power", share="1/256")
_STALE: Final = 0.42


class RowCard(Card):
    """A style with its match without and with the lamp."""

    wanted = (280, HEIGHT)

    def __init__(self, state: RowState) -> None:
        super().__init__(state.spoken)
        self.state = state
        self._stale = False
        self._picture = Picture("")
        self._picture.setParent(self)
        self._picture.set_picture(state.picture)
        self.setFixedHeight(px(HEIGHT))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.set_selected(state.chosen)
        self._tell()

    def show_state(self, state: RowState, stale: bool) -> None:
        """Show other numbers of the same style; `stale`: new ones are on their way."""
        if stale != self._stale:
            self._stale = stale
            self.update()
        self.set_selected(state.chosen)
        if state != self.state or state.picture is not self.state.picture:
            self.state = state
            self._picture.set_picture(state.picture)
            self._tell()
            self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Put the picture at the left."""
        super().resizeEvent(event)
        side = px(PICTURE)
        self._picture.setGeometry(px(_PAD), (self.height() - side) // 2, side, side)

    def paint_content(self, painter: QPainter) -> None:
        """Paint names, numbers and meter."""
        t, state = theme(), self.state
        if self._stale:
            painter.setOpacity(_STALE)
        left = px(_PAD + PICTURE + 10)
        right = self.width() - px(10)
        line = QRectF(left, px(10), right - left, px(20))
        line.setRight(self._numbers(painter, line) - px(8))
        put_text(painter, line, state.title, t.font(14, 600), t.c.text)
        below = QRectF(left, px(32), right - left, px(16))
        put_text(painter, below, state.line, t.font(12), t.c.dim)
        meter = QRectF(left, px(54), right - left, px(10))
        if state.power:
            font, place = t.font(12), QRectF(left, px(51), right - left, px(16))
            put_text(painter, place, state.power, font, t.c.dim, RIGHT)
            meter.setRight(right - text_width(font, _LONGEST) - px(8))
        draw_meter(painter, meter, state.after, state.limit, state.before)
        painter.setOpacity(1.0)

    def _numbers(self, painter: QPainter, line: QRectF) -> float:
        """Paint "29 → 63" at the right, and give where it begins."""
        t, state = theme(), self.state
        strong, plain = t.font(14, 700), t.font(14)
        after, before = str(state.after), str(state.before)
        right = line.right()
        put_text(painter, line, after, strong, t.c.text, RIGHT)
        right -= text_width(t.font(14, 700), "00") + px(6)
        side = px(_ARROW)
        spot = QRectF(right - side, line.top(), side, line.height())
        draw_icon(painter, "arrow-right", spot, side, t.c.dim)
        right -= side + px(6)
        place = QRectF(line.left(), line.top(), right - line.left(), line.height())
        put_text(painter, place, before, plain, t.c.dim, RIGHT)
        return right - text_width(plain, before)

    def _tell(self) -> None:
        describe(self, self.state.spoken, tip=f"{self.state.title}: {self.state.line}")


_MARGIN: Final = 16
_NO_LAMP: Final = ("", tr("Choose a lamp"), tr("phone, panel, flash or own"), "bulb")


class LampColumn(Surface):
    """Lamp, distance, reach and the list of styles."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__("panel", ("right",), tr("Lamp and styles"))
        self._presenter = presenter
        self._lamp: LampState | None = None
        self._sections: tuple[Section, ...] = ()
        self._busy = False
        self._seen = ""
        self.rows: list[RowCard] = []
        self._headings: list[_Heading] = []
        self._compact = compact
        fields = self._make_fields()
        self._note = Text("", 14, role="dim", wrap=True)
        self._closer = Button("", size="small", do=presenter.come_closer)
        closer = row(self._closer, ..., gap=None, margins=(0, 8, 0, 0))
        self._list = column(gap=8)
        inside = QWidget()
        around = (_MARGIN, 8, _MARGIN, 16)
        self._column = column(
            *((fields,) if compact else ()),
            *(self._note, closer, self._list, ...),
            into=inside,
            margins=around,
        )
        self._roving = Roving(self)
        self._roving.moved.connect(self._moved)
        self._scroll = Scroll(inside, name=tr("Styles with this lamp"))
        self._scroll.lend(self._column, px(_MARGIN), px(4))
        if not compact:
            fields.setContentsMargins(*(px(side) for side in (_MARGIN, 8, _MARGIN, 0)))
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
        self.distance.setToolTip(tr("How far the lamp is from the middle of the head"))
        self.distance.changed.connect(lambda stop: presenter.move_away(round(stop)))
        self.arm = Toggle(tr("Within arm’s reach only"), do=presenter.set_arm)
        self.floor = Toggle(tr("Not through the floor"), do=presenter.set_floor)
        self.more = IconButton("more", tr("More about this lamp"), kind="quiet", do=self._open_menu)
        self._bright = Text("", 12, role="dim", wrap=True)
        self.correct = Button(tr("Correct…"), kind="quiet", size="small", do=presenter.scale.ask)
        self.correct.setAccessibleName(tr("Correct how bright it is here"))
        self._fixed = Text("", 12, role="dim", wrap=True)
        # In line with the field, which is higher.
        lamp = row((self.lamp, 1), column(..., self.more, 8, gap=None), gap=4)
        words = (self._bright, 1, Qt.AlignmentFlag.AlignVCenter)
        bright = row(words, self.correct, gap=4)
        held = (self.distance, self._fixed, 4, self.arm, self.floor)
        return column(lamp, 12, *held, 4, bright, 4)

    def show_state(self, state: LightState) -> None:
        """Show what changed."""
        self._show_lamp(state.lamp)
        self._note.say(state.note)
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
        """Put rows into a new order; those that are there already are not made again."""
        rows = {row.state.key: row for row in self.rows}
        headings = {heading.title: heading for heading in self._headings}
        while self._list.takeAt(0) is not None:
            pass
        self.rows, self._headings = [], []
        for part in sections:
            heading = headings.pop(part.title, None) or _Heading(part.title)
            heading.count.say(part.count)
            self._headings.append(heading)
            self._list.addWidget(heading)
            heading.raise_()  # Read out in the order in which it is seen.
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

    def _moved(self, row: QWidget) -> None:
        if isinstance(row, RowCard):
            self._scroll.keep_visible(row)
            self._presenter.choose(row.state.key)


class _Heading(QWidget):
    """The title of a part of the list, and how many there are."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self.title = title
        self.count = Text("", 14, role="dim")
        words = (Text(title, 14, 600, elide=True), 1)
        row(words, self.count, into=self, gap=None, margins=(0, 8, 0, 0))
