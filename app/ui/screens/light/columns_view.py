"""The columns: which lamp, how near, and for which styles; and the chosen style with it."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QPainter, QPen, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QVBoxLayout, QWidget

from app.core.text import tr
from app.ui.plots.head_views import AboveView, SideView
from app.ui.plots.lamps import LampPlot
from app.ui.plots.sky_map import SkyMap
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.light.state import (
    DISTANCES_M,
    LampDetailState,
    LampState,
    LightState,
    RowState,
    Section,
)
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import Roving, describe
from app.ui.widgets.buttons import Button, IconButton, Size
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.dialogs import Term
from app.ui.widgets.displays import Picture, draw_meter
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, grid, row, stacked
from app.ui.widgets.paint import MIDDLE, RIGHT, STALE, PaintedWidget, put_text, text_width
from app.ui.widgets.surfaces import Card, Menu, OutlineBox, Scroll, Surface
from app.words.phrases.quantities import metres

HEIGHT: Final = 76
"""Of a row, logical pixels at scale 1."""

PICTURE: Final = 56
"""Side of its picture."""

_PAD: Final = 8
_ARROW: Final = 16
_LONGEST: Final = tr("{share} power", share="1/256")


class RowCard(Card):
    """A style with its match without and with the lamp."""

    preferred_size = (280, HEIGHT)

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
            painter.setOpacity(STALE)
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


_LAMP_MARGIN: Final = 16
_NO_LAMP: Final = ("", tr("Choose a lamp"), tr("phone, panel, flash or own"), "bulb")


class LampColumn(Surface):
    """Lamp, distance, reach and the list of styles."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__("panel", ("right",), tr("Lamp and styles"))
        self._presenter = presenter
        self._lamp: LampState | None = None
        self._sections: tuple[Section, ...] = ()
        self._busy = False
        self._last_key = ""
        self.rows: list[RowCard] = []
        self._headings: list[_Heading] = []
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
        self.distance.setToolTip(tr("How far the lamp is from the middle of the head"))
        self.distance.changed.connect(lambda stop: presenter.move_away(round(stop)))
        self.arm = Toggle(tr("Within arm’s reach only"), do=presenter.set_arm)
        self.floor = Toggle(tr("Stay above floor level"), do=presenter.set_floor)
        self.more = IconButton("more", tr("More about this lamp"), kind="quiet", do=self._open_menu)
        self._bright = Text("", 12, role="dim", wrap=True)
        self.correct = Button(tr("Correct…"), kind="quiet", size="small", do=presenter.scale.ask)
        self.correct.setAccessibleName(tr("Correct how bright it is here"))
        self._fixed = Text("", 12, role="dim", wrap=True)
        # In line with the field, which is higher.
        lamp = row((self.lamp, 1), column(..., self.more, 8, gap=None), gap=4)
        bright = row((self._bright, 1, Qt.AlignmentFlag.AlignVCenter), self.correct, gap=4)
        fields = (self.distance, self._fixed, 4, self.arm, self.floor)
        return column(lamp, 12, *fields, 4, bright, 4)

    def show_state(self, state: LightState) -> None:
        """Show what changed."""
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
                # Once the rows have their places.
                QTimer.singleShot(0, self, self._show_chosen)

    def _show_chosen(self) -> None:
        selected = next((row for row in self.rows if row.state.chosen), None)
        if selected is None or self._compact:
            return
        if selected is self.rows[0]:
            # With its title, and what is said above it.
            self._scroll.verticalScrollBar().setValue(0)
        else:
            self._scroll.keep_visible(selected)

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

    def _on_row_move(self, row: QWidget) -> None:
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


_TABS: Final = (("above", tr("From above")), ("side", tr("From the side")))
_WIDEST: Final = 480
_HEIGHT_OF_VIEWS: Final = 404 / 300
_WIDEST_OF_ALL: Final = 1200
_MAP: Final = (164, 106)  # height of the map with the words below it, and in a small window
_MAP_SHARE: Final = 0.23  # of the width, where there is more room


class _Number(PaintedWidget):
    """The number of a step in a ring."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self._number = str(number)
        side = px(32)
        self.setFixedSize(side, side)
        self.setAccessibleName(tr("Step {number}", number=number))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(t.c.text, t.line_width + 0.5))
        radius = self.width() / 2.0 - 1.5
        painter.drawEllipse(QPointF(self.rect().toRectF().center()), radius, radius)
        put_text(painter, self.rect(), self._number, t.font(16, 600), t.c.text, MIDDLE)


class Middle(QWidget):
    """Steps, drawings and map."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        size = 16 if compact else 20
        self._turn = Text("", size, 600, wrap=True)
        self._turn_line = Text("", 14, role="dim", wrap=not compact, elide=compact)
        self._hold = Text("", size, 600, wrap=True)
        self._hold_line = Text("", 12 if compact else 14, role="dim", wrap=True)
        tall: Size = "small" if compact else "normal"
        self.go = Button(tr("Turn first"), "turn", kind="primary", size=tall, do=presenter.turn)
        self.go.set_tip(tr("Go to the turn, then hold the lamp"), "T")
        self.above, self.side, self.map = AboveView(), SideView(), SkyMap()
        for plot in self.plots:
            plot.moved.connect(presenter.hold_at)
            plot.home_asked.connect(presenter.go_best)
            plot.power_asked.connect(presenter.step_power)
        # One stop for Tab: the map is in sight in every layout.
        self.above.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.side.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._map_title = Text(tr("Where this lamp works at this turn"), 12, 600, "dim", elide=True)
        self._map_words = Text("", 12, role="dim", elide=True)
        # Where there is no room for both, the tool tip has the second.
        self._map_words.setVisible(False)
        margin = 16 if compact else _MARGIN
        inside = QWidget()
        inside.setMaximumWidth(px(_WIDEST_OF_ALL))
        whole = (..., (inside, 1000), ...)
        row(*whole, into=self, gap=None, margins=(margin, 16, margin, 8))
        title = row((self._map_title, 1), 8, self._map_words, gap=None)
        column(self._steps(), 12, (self._views(), 1000), 12, title, 4, self.map, ..., into=inside)

    @property
    def plots(self) -> tuple[LampPlot, LampPlot, LampPlot]:
        """All three on which the lamp can be moved."""
        return self.above, self.side, self.map

    def _steps(self) -> QGridLayout:
        t = theme()
        grid = QGridLayout()
        grid.setHorizontalSpacing(px(12 if self._compact else 16))
        grid.setVerticalSpacing(0)
        grid.setColumnStretch(1, 1)
        top = Qt.AlignmentFlag.AlignTop
        grid.addWidget(_Number(1), 0, 0, 2, 1, top)
        grid.addWidget(self._turn, 0, 1, top)
        rows, columns = (1, 2) if self._compact else (2, 1)
        grid.addWidget(self.go, 0, 2, rows, 1, top)
        grid.addWidget(self._turn_line, 1, 1, 1, columns, top)
        grid.setRowMinimumHeight(2, px(12))
        grid.addWidget(_Number(2), 3, 0, top)
        hold = QWidget()
        column(self._hold, self._hold_line, ..., into=hold)
        # Words grow and shrink while the lamp is moved; the drawings must not jump.
        size, lines = (16, 3) if self._compact else (20, 2)
        rest = 2 * t.line_height(12) if self._compact else t.line_height(14)
        hold.setMinimumHeight(lines * t.line_height(size) + rest)
        grid.addWidget(hold, 3, 1, 1, 2)
        return grid

    def _views(self) -> QWidget:
        whole = QWidget()
        if not self._compact:
            for view in (self.above, self.side):
                view.setMaximumWidth(px(_WIDEST))
            row(..., (self.above, 100), (self.side, 100), ..., into=whole, gap=16)
            whole.setMaximumHeight(round(px(_WIDEST) * _HEIGHT_OF_VIEWS))
            return whole
        self.tabs = SegmentedChoice(_TABS, name=tr("Drawing"))
        stack = stacked(self.above, self.side)
        self.tabs.chosen.connect(lambda key: stack.setCurrentIndex(int(key == "side")))
        column(self.tabs, (stack, 1), into=whole, gap=8)
        return whole

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Let the map keep its proportions as it grows."""
        super().resizeEvent(event)
        wide = min(self.width() - 2 * px(_MARGIN), px(_WIDEST_OF_ALL))
        least = px(_MAP[1] if self._compact else _MAP[0])
        share = 0.0 if self._compact else _MAP_SHARE
        self.map.setFixedHeight(max(least, round(wide * share)))

    def show_state(self, state: LightState) -> None:
        """Show where to turn and where to hold the lamp."""
        hold = state.hold
        self._turn.set_text(hold.turn)
        self._turn_line.set_text(hold.turn_line)
        self._hold.set_text(hold.hold)
        self._hold_line.set_text(hold.hold_line)
        self.go.set_text(hold.go, hold.go_icon)
        self.go.set_available(hold.turn_works)
        for plot in self.plots:
            plot.show_heads(state.heads)
        self.map.show_sky(state.sky)
        self._map_title.set_text(hold.map_title)
        self._map_words.set_text(state.sky.words)
        self._map_words.setVisible(not self._compact)
        if self._compact:
            self._map_title.setToolTip(state.sky.words)


_MARGIN: Final = 24
_GAP: Final = 8
_SHAPE: Final = 176 / 160
_ROWS: Final = 4


def portrait_size(width: int, compact: bool) -> QSize:
    """Size of each portrait in a column of some width, logical pixels; 160 x 176 in 376."""
    margin = px(16 if compact else _MARGIN)
    inner = (width - 2 * margin - px(_GAP)) // 2
    return QSize(inner, round(inner * (1.0 if compact else _SHAPE)))


class _MatchTile(OutlineBox):
    """Match without and with the lamp where it is held now."""

    def __init__(self, compact: bool) -> None:
        super().__init__("raised", "none")
        t = theme()
        self._before = Text("", 20 if compact else 28, role="dim")
        self._arrow = Icon("arrow-right", 16 if compact else 20, "dim")
        self._after = Text("", 28 if compact else 36, 700)
        self._icon = Icon("check", 16, "ok")
        self._verdict = Text("", 12, wrap=True)
        if compact:
            self._verdict.setMinimumHeight(2 * t.line_height(12))
        numbers = row(self._before, self._arrow, self._after, ..., gap=8)
        verdict = row((self._icon, 0, Qt.AlignmentFlag.AlignTop), (self._verdict, 1), gap=6)
        match = Term("match", tr("Match"), (14, 400, "dim"))
        column(..., match, numbers, verdict, ..., into=self, gap=4, margins=(12, 8, 8, 8))

    def show_state(self, state: LampDetailState) -> None:
        self._before.set_text(state.before)
        self._after.set_text(state.after)
        self._arrow.setVisible(bool(state.after))
        inside = state.verdict == "in"
        self._icon.setVisible(bool(state.verdict))
        self._icon.set("check" if inside else "not-possible", "ok" if inside else "text")
        self._verdict.set_role("ok" if inside else "text")
        self._verdict.set_text(state.verdict_words)
        values = {"before": state.before, "after": state.after, "verdict": state.verdict_words}
        self.setAccessibleName(
            tr("Match without the lamp {before}, with it {after}, {verdict}", **values)
            if state.after
            else tr("Match without the lamp {before}", **values)
        )


class DetailColumn(Surface):
    """Everything about the chosen style with the lamp."""

    laid = Signal(QSize)
    """Portraits have another size, logical pixels."""

    def __init__(self, presenter: LightPresenter, compact: bool) -> None:
        super().__init__("panel", ("left",), tr("Chosen style with the lamp"))
        t = theme()
        self._compact = compact
        margin = px(16 if compact else _MARGIN)
        self._title = Text("", 20, 600, elide=True)
        self._side = Text("", 14, role="dim", elide=True)
        self.target = Picture(tr("Target"))
        self.with_lamp = Picture(tr("Picture with the lamp"))
        self.without = Picture(tr("Picture without the lamp"))
        self.tile = _MatchTile(compact)
        pictures = (self.target, self.with_lamp, self.without, self.tile)
        self.own = Button(tr("Capture a lamp of your own"), "plus", do=presenter.lamps.begin)
        inside = QWidget()
        power, best = self._power_row(presenter), self._best_box(presenter)
        picture_grid = grid(*pictures, across=2, gap=(_GAP, _GAP))
        lower = (power, best, 12, self._numbers(), ...)
        inner = column(self._title, self._side, 12, picture_grid, 12, *lower, into=inside)
        inner.setContentsMargins(margin - t.line_width, px(16), margin, px(8))
        foot = row((self.own, 1), gap=None)
        foot.setContentsMargins(margin - t.line_width, 0, margin, 0)
        scroll = Scroll(inside, name=tr("About the chosen style"))
        whole = column((scroll, 1), foot, into=self, gap=None)
        whole.setContentsMargins(t.line_width, 0, 0, px(16))

    def _power_row(self, presenter: LightPresenter) -> QWidget:
        self.power = QWidget()
        self._power_words = Text("", 14, elide=True)
        self.weaker = IconButton("minus", tr("Turn the lamp down"), size="small", shortcut="PgDn")
        self.stronger = IconButton("plus", tr("Turn the lamp up"), size="small", shortcut="PgUp")
        self.weaker.clicked.connect(lambda: presenter.step_power(-1))
        self.stronger.clicked.connect(lambda: presenter.step_power(1))
        power = Text(tr("Power"), 14, role="dim")
        line = (power, (self._power_words, 1), self.weaker, self.stronger)
        row(*line, into=self.power, gap=8, margins=(0, 0, 0, 12))
        return self.power

    def _best_box(self, presenter: LightPresenter) -> OutlineBox:
        t = theme()
        frame = OutlineBox("none", "ctl")
        self._best = Text("", 14, 600)
        self._best_line = Text("", 14, role="dim", wrap=True)
        self._best_line.setMinimumHeight(2 * t.line_height(14))
        self.back = Button(tr("Back to the best place"), size="small", do=presenter.go_best)
        self.back.set_tip(tr("Hold the lamp at its best place"), "Home")
        title = row(Icon("ring", 16), (self._best, 1), gap=8)
        back = row(self.back, ..., gap=None)
        column(title, self._best_line, 4, back, into=frame, gap=4, margins=12)
        return frame

    def _numbers(self) -> QGridLayout:
        self._rows = [(Text("", 14, role="dim"), Text("", 14, elide=True)) for _ in range(_ROWS)]
        cells = [text for line in self._rows for text in line]
        return grid(*cells, across=2, gap=(16, 4), stretched=1)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give pictures their proportions."""
        super().resizeEvent(event)
        size = portrait_size(self.width(), self._compact)
        for widget in (self.target, self.with_lamp, self.without, self.tile):
            widget.setFixedSize(size)
        self.laid.emit(size)

    def show_state(self, state: LampDetailState) -> None:
        """Show a style with the lamp somewhere."""
        self._title.set_text(state.title)
        self._side.set_text(state.side)
        rows = (
            (self.target, state.target, tr("Target")),
            (self.with_lamp, state.with_lamp, tr("With the lamp")),
            (self.without, state.without, state.without_tag),
        )
        for picture, array, tag in rows:
            picture.set_picture(array)
            picture.set_tag(tag if array is not None else "")
        self.tile.show_state(state)
        self.power.setVisible(bool(state.power))
        self._power_words.set_text(state.power)
        self.weaker.set_available(state.weaker, tr("It cannot be turned down any more."))
        self.stronger.set_available(state.stronger, tr("It is at full power."))
        self._best.set_text(state.best_title)
        self._best_line.set_text(state.best_line or tr("The lamp is there."))
        self.back.set_available(not state.at_best, tr("The lamp is there already."))
        for number, (label, value) in enumerate(self._rows):
            words = state.numbers[number] if number < len(state.numbers) else ("", "")
            label.set_text(words[0])
            value.set_text(words[1])
