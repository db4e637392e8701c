"""The left side: tools, panorama, lamps or recent places, age of the light, and where to drop."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from PySide6.QtCore import QCoreApplication, QEvent, QRect, QRectF, Qt, QTimer
from PySide6.QtGui import QFontMetricsF, QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.core.text import tr
from app.ui.plots.panorama import PanoramaView, SceneLamp
from app.ui.presenters.places_list import PlacesListRow
from app.ui.screens.probe.screen import ProbePresenter
from app.ui.screens.probe.state import LAYERS, DistantSign, LampRow, Live, ProbeState, RoughCard
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import OwnKeys, Roving
from app.ui.widgets.buttons import Button, IconButton, Pressable, button_look
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, boxed, clear, column, row, stacked
from app.ui.widgets.lists import Cell, Column, TableHead, TableRow
from app.ui.widgets.messages import Empty
from app.ui.widgets.paint import MIDDLE, PaintedWidget, box, faint, put_text, text_width
from app.ui.widgets.surfaces import Card, OutlineBox, Scroll
from app.words.phrases.quantities import ev_words

_CARDS: Final = 3
_FILLS: Final = {
    "wait": ("panel", "text"),
    "act": ("amberfill", "onamber"),
    "move": ("ok", "raised"),
}
_CAPTION: Final = 0.2  # of the height
_LARGEST: Final = 400
_BAR: Final = 16


class _Face(PaintedWidget):
    """The words of the sign, as large as they can be, on a colour that says the same."""

    least = (240, 160)

    def __init__(self) -> None:
        super().__init__()
        self._sign = DistantSign()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_sign(self, sign: DistantSign) -> None:
        if sign != self._sign:
            self._sign = sign
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        sign = self._sign
        fill, ink = (getattr(t.c, name) for name in _FILLS[sign.kind])
        box(painter, self.rect(), px(8), fill, t.c.line, t.line_width)
        room = QRectF(self.rect()).adjusted(px(24), px(16), -px(24), -px(16))
        caption = QRectF(room)
        caption.setTop(room.bottom() - _CAPTION * min(room.height(), px(_LARGEST)))
        if sign.fraction is not None:
            bar = QRectF(room.left(), caption.top() - px(_BAR), room.width(), px(_BAR))
            box(painter, bar, bar.height() / 2, faint(ink, 0.25))
            bar.setWidth(max(bar.width() * sign.fraction, bar.height()))
            box(painter, bar, bar.height() / 2, ink)
        under = t.font(_fitting(sign.caption, caption), 600)
        put_text(painter, caption, sign.caption, under, ink, MIDDLE)
        room.setBottom(caption.top() - (px(_BAR + 8) if sign.fraction is not None else 0))
        if sign.kind == "move":
            side = int(min(room.height() * 0.4, room.width() * 0.4))
            spot = QRect(int(room.center().x() - side / 2), int(room.top()), side, side)
            draw_icon(painter, "check", spot, side, ink)
            room.setTop(room.top() + side)
        put_text(painter, room, sign.big, t.font(_fitting(sign.big, room), 700), ink, MIDDLE)


def _fitting(words: str, room: QRectF) -> int:
    """Find the largest type in which words fit, before the theme's scale."""
    t = theme()
    width = QFontMetricsF(t.font(100, 700)).horizontalAdvance(words)
    most = 0.98 * min(room.width() / max(width, 1.0), room.height() / (1.25 * t.px(100)))
    return int(min(max(100.0 * most, 12.0), _LARGEST))


class CaptureSign(QWidget):
    """Read from three metres during a capture, over what was metered: the first panorama."""

    def __init__(self) -> None:
        super().__init__()
        self._face = _Face()
        self.picture = Picture(tr("What was metered"))
        self.picture.set_tag(tr("Metered"))
        column((self._face, 1), self.picture, into=self, gap=8, margins=16)
        self.picture.hide()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave the larger part to the words."""
        super().resizeEvent(event)
        self.picture.setFixedHeight(min((self.width() - px(32)) // 2, self.height() * 9 // 20))

    def show_sign(self, sign: DistantSign) -> None:
        """Show it."""
        self._face.show_sign(sign)
        self.picture.set_picture(sign.picture)
        self.picture.setVisible(sign.picture is not None)
        self.setAccessibleName(sign.big)
        self.setAccessibleDescription(sign.caption)


class _RoughView(OutlineBox):
    """One style by the preview: what it is, how far to turn, and how sure that is."""

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
    """The best styles by the live preview, or why there are none."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        self.message = Text("", 14, 600, wrap=True)
        self._icon = Icon("eye", 20)
        self.views: list[_RoughView] = []
        line = row((self._icon, 0, Qt.AlignmentFlag.AlignTop), (self.message, 1), gap=8)
        self._compact, self._cards = compact, row(gap=8)
        column(line, self._cards, ..., into=self, gap=8)
        # Its stack is no higher for what is seldom in front.
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Ignored)
        self.setAccessibleName(tr("Best styles here, roughly"))

    def show_live(self, live: Live) -> None:
        """Show them."""
        self.message.set_text(live.message)
        self._icon.set(*(("warning", "err") if live.trouble else ("eye", "text")))
        if not self.views:  # they are seldom wanted: the screen comes sooner without them
            self.views = [_RoughView(self._compact) for _ in range(_CARDS)]
            add(self._cards, *((view, 1) for view in self.views))
        for number, view in enumerate(self.views):
            view.setVisible(number < len(live.cards))
            if number < len(live.cards):
                view.show_card(live.cards[number])


class _WayButton(Pressable):
    """A way to begin: an icon, what it is, and what it needs."""

    def __init__(
        self, title: str, words: str, icon: str, do: Callable[[], None], compact: bool
    ) -> None:
        super().__init__(title, tip=words, do=do)
        self.setAccessibleDescription(words)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        middle = Qt.AlignmentFlag.AlignHCenter
        self.drawing = Icon(icon, 40 if compact else 56)
        self._name = Text(title, 14 if compact else 16, 600, wrap=True, align=middle)
        self.more = Text(words, 12, role="dim", wrap=True, align=middle)
        self._primary = False
        for text in (self._name, self.more):
            text.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        picture, edge = (self.drawing, 0, middle), 16 if compact else 20
        column(picture, edge // 2, self._name, self.more, ..., into=self, gap=4, margins=edge)

    def set_primary(self, primary: bool) -> None:
        """Mark it as the main button, or not."""
        if primary != self._primary:
            self._primary = primary
            self.drawing.set(self.drawing.name, "onamber" if primary else "text")
            self._name.set_role("onamber" if primary else "text")
            self.more.set_role("onamber" if primary else "dim")
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        look = button_look(self, "primary" if self._primary else "outlined")
        fill = look.fill or t.c.raised
        box(painter, self.rect(), px(8), fill, look.edge or t.c.line, look.width)


class Start(QWidget):
    """One sentence that says what the program does, and three ways to begin."""

    def __init__(
        self,
        demo: Callable[[], None],
        files: Callable[[], None],
        camera: Callable[[], None],
        compact: bool,
    ) -> None:
        super().__init__()
        middle = Qt.AlignmentFlag.AlignHCenter
        title = tr("How far to turn for Rembrandt light, here.")
        what = tr(
            "Turnlight measures the light of a place and tells how far to turn "
            "your sitter for each studio style."
        )
        self.ways = (
            _WayButton(tr("Try it in 10 seconds"), tr("A demo place, no camera needed"), "play",
            demo,
                 compact),
            _WayButton(tr("Open a panorama or photos"), tr("Or drop them anywhere in this window"),
                 "folder", files, compact),
            _WayButton(tr("Connect a camera"), tr("A Ricoh Theta, by its Wi-Fi"), "theta", camera,
                 compact),
        )  # fmt: skip
        sentence = Text(title, 20 if compact else 28, 700, wrap=True, align=middle)
        self._more = Text(what, 14, role="dim", wrap=True, align=middle)
        ways = row(*((way, 1) for way in self.ways), gap=12)
        side = 16 if compact else 32
        column(..., sentence, self._more, side // 2, ways, ..., into=self, gap=8, margins=side)
        self.setAccessibleName(title)
        self.setAccessibleDescription(what)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say less where there is little room."""
        super().resizeEvent(event)
        for part in (self._more, *(part for way in self.ways for part in (way.drawing, way.more))):
            part.setVisible(self.height() >= px(330))


_HIGH: Final = 64
_PICTURE: Final = (80, 48)
_LEAST: Final = 240
_WIDEST_ROW: Final = 304


class _Tile(Card):
    """One place: small picture, name, and when it was made or what is missing."""

    preferred_size = (_WIDEST_ROW, _HIGH)

    def __init__(self, row: PlacesListRow) -> None:
        self._second = row.detail if row.unfinished is not None else row.time
        values = {"name": row.name, "detail": self._second}
        super().__init__(
            tr("Finish {name}, {detail}", **values)
            if row.unfinished
            else tr("Open {name}, {detail}", **values)
        )
        self.row = row
        self.setToolTip(f"{row.name}\n{self._second}")
        self.setFixedHeight(px(_HIGH))
        self.setMinimumWidth(px(120))
        self.setMaximumWidth(px(_WIDEST_ROW))
        self._picture = picture = Picture(tr("Picture of {name}", name=row.name), 4)
        picture.setParent(self)
        picture.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        picture.set_picture(row.thumbnail)
        wide, high = (px(side) for side in _PICTURE)
        picture.setGeometry(px(8), (px(_HIGH) - high) // 2, wide, high)

    def paint_content(self, painter: QPainter) -> None:
        t = theme()
        left, middle = self._picture.geometry().right() + 1 + px(8), self.height() // 2
        name = QRect(left, middle - px(20), self.width() - left - px(8), px(20))
        put_text(painter, name, self.row.name, t.font(14, 600), t.c.text)
        put_text(painter, name.translated(0, px(20)), self._second, t.font(12), t.c.dim)


class RecentPlaces(QWidget):
    """Tiles of recent places under a heading, hidden when there are none.

    `open_place` takes the folder of the place that is chosen.
    """

    def __init__(self, open_place: Callable[[Path], None]) -> None:
        super().__init__()
        self._open_place = open_place
        self.tiles: list[_Tile] = []
        self._title = Text(tr("Recent places"), 12, 600, "dim")
        self._line = row(gap=8)
        self._roving = Roving(self)
        column(self._title, self._line, ..., into=self, gap=6, margins=(0, 8, 0, 0))
        self._title.hide()

    def show_rows(self, rows: tuple[PlacesListRow, ...]) -> None:
        """Show as many as there is room for."""
        clear(self._line)
        self.tiles = [_Tile(row) for row in rows]
        for tile in self.tiles:
            tile.clicked.connect(lambda _on=False, row=tile.row: self._open_place(row.folder))
            self._line.addWidget(tile, 1)
        self._line.addStretch()
        self._title.setVisible(bool(rows))
        self._fit()
        # Messages that lie over the window make way.
        QCoreApplication.postEvent(self.window(), QEvent(QEvent.Type.LayoutRequest))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out what would have too little room for its words."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        room = max((self.width() + px(8)) // px(_LEAST + 8), 1)
        for number, tile in enumerate(self.tiles):
            tile.setVisible(number < room)
        self._roving.set_members(self.tiles[:room])


_ROOMY = 800  # wide enough for icons beside the words
_LAYERS = (
    ("clipped", tr("Clipped"), "hatch", tr("Hatch what was too bright for every frame")),
    ("lamps", tr("Lamps"), "bulb", tr("Letter the lamps")),
    ("grid", tr("Grid"), "grid", tr("Draw a grid of directions")),
)


class PanoramaTools(QWidget):
    """One line of 32."""

    def __init__(self, presenter: ProbePresenter, panorama: PanoramaView, compact: bool) -> None:
        super().__init__()
        t = theme()
        self.setFixedHeight(px(32))
        self.whole = IconButton("hand", tr("Show the whole panorama"), size="small")
        self.whole.set_tip(tr("Drag to look around; press to show it whole"), "0")
        self.out = IconButton("minus", tr("Zoom out"), size="small", shortcut="−")
        self.near = IconButton("plus", tr("Zoom in"), size="small", shortcut="+")
        self.percent = Text("100 %", align=Qt.AlignmentFlag.AlignHCenter)
        self.percent.setFixedWidth(text_width(t.font(14), "800 %") + px(8))
        self.exposure = LabelledSlider(
            tr("Exposure"), -6.0, 6.0, 0.0, 0.1, partial(ev_words, tenths=True), inline=True
        )
        self.exposure.setToolTip(tr("How bright it is shown; a double click resets it"))
        self.exposure.setMaximumWidth(px(296))
        if not compact:
            self.exposure.setMinimumWidth(px(200))
        self.layers: dict[str, Button | IconButton] = {}
        self._there: bool | None = None
        near = (self.whole, self.out, self.percent, self.near, 8, Icon("sun", 20, "dim"))
        line = row(*near, (self.exposure, 1), into=self, gap=8)
        line.addStretch(0 if compact else 1)
        for key, words, icon, tip in _LAYERS:
            kind, first = (IconButton, (icon, words)) if compact else (Button, (words, icon))
            self.layers[key] = button = kind(*first, checkable=True, size="small")
            button.set_tip(tip)
            button.clicked.connect(lambda on, key=key: presenter.show_layer(key, on))
            line.addWidget(button)
        self.whole.clicked.connect(panorama.fit)
        self.out.clicked.connect(lambda: panorama.zoom_by(-1.0))
        self.near.clicked.connect(lambda: panorama.zoom_by(1.0))
        self.exposure.changed.connect(presenter.expose)
        panorama.zoom_changed.connect(lambda z: self.percent.set_text(f"{round(100 * z)} %"))
        Roving(self).set_members([self.whole, self.out, self.near])
        Roving(self).set_members(list(self.layers.values()))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out the icons beside words where there is little room."""
        super().resizeEvent(event)
        roomy = self.width() >= px(_ROOMY)
        for key, words, icon, _ in _LAYERS:
            button = self.layers[key]
            if isinstance(button, Button):
                button.set_text(words, icon if roomy else "")

    def show_state(self, state: ProbeState) -> None:
        """Show exposure and layers."""
        self.exposure.set_value(state.exposure_ev)
        for key, button in self.layers.items():
            button.setChecked(key in state.layers)
        there = state.picture is not None and state.live is None
        if there == self._there:
            return
        self._there = there
        for widget in (self.whole, self.out, self.near, *self.layers.values()):
            widget.set_available(there, tr("There is no panorama yet."))
        self.exposure.setEnabled(there)


_WIDEST: Final = 1200
_ROW: Final = 44
_DROP: Final = tr("Drop a panorama, photos, a film or a folder")
_DROP_SHORT: Final = tr("Drop files here")
_FULL: Final = (
    Column(tr("Lamps found"), 160),
    Column(tr("Where")),
    Column(tr("Azimuth"), 84),
    Column(tr("Elevation"), 88),
    Column(tr("Share of the light"), 120),
    Column("", 92),
)
_COMPACT: Final = (
    Column(tr("Lamps found")),
    Column(tr("Azimuth"), 68),
    Column(tr("Elevation"), 80),
    Column(tr("Share"), 128),
    Column("", 96),
)


class _WholeRows(Scroll):
    """Shows whole rows only."""

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out what would be part of a row."""
        high = px(_ROW)
        self.setViewportMargins(0, 0, 0, self.height() % high if self.height() > high else 0)
        super().resizeEvent(event)


class LightColumn(QWidget):
    """Everything about the light that is there."""

    def __init__(
        self,
        presenter: ProbePresenter,
        compact: bool,
        ask_files: Callable[[], None],
        ask_folder: Callable[[], None],
    ) -> None:
        super().__init__()
        self._presenter = presenter
        self._ask_files, self._ask_folder = ask_files, ask_folder
        self._compact = compact
        self._state: ProbeState | None = None
        self._columns = _COMPACT if compact else _FULL
        self.panorama = PanoramaView()
        self.panorama.marker_released.connect(presenter.move_marker)
        self.tools = PanoramaTools(presenter, self.panorama, compact)
        OwnKeys(self.panorama.grip)
        self.empty = Empty("", icon="probe")
        self.start = Start(presenter.open_demo, ask_files, presenter.cameras.connect, compact)
        side, top, gap = (16, 12, 8) if compact else (24, 16, 12)
        self._side = px(side)
        self._body = column(
            self.tools,
            gap,
            (self._well(), 1),
            8,
            (self._below(), 0 if compact else 1),
            gap,
            self._age_line(),
            gap,
            self._drop_row(),
            into=self,
            margins=(side, top, side, top),
        )

    def _well(self) -> QWidget:
        frame = OutlineBox("panel", "line")
        column(self.empty, into=frame, gap=None)
        begin = OutlineBox("panel", "line")
        column(self.start, into=begin, gap=None)
        self.preview = Picture(tr("Live preview"))
        self._stack = stacked(frame, self.panorama, begin, self.preview)
        self._stack.setMaximumWidth(px(_WIDEST))
        return self._stack

    def resizeEvent(self, event: object) -> None:
        """Give the panorama as much height as its width asks for."""
        self._give_height()

    def _give_height(self) -> None:
        self._keep_to_panorama()
        margins = self._body.contentsMargins()
        width = min(self.width() - margins.left() - margins.right(), px(_WIDEST))
        most = self._most_height()
        # The ways to begin have all the room to themselves.
        height = most if self._stack.currentIndex() == 2 else self.panorama.heightForWidth(width)
        self._stack.setFixedHeight(max(min(height, most), px(120)))

    def _keep_to_panorama(self) -> None:
        """Let nothing here become wider than the panorama may; all keep one left and right edge."""
        free = max(self.width() - self.widest(), 0)
        left = free // 2 if free > 2 * self._side else 0
        margins = self._body.contentsMargins()
        margins.setLeft(self._side + left)
        margins.setRight(self._side + free - left)
        self._body.setContentsMargins(margins)

    def widest(self) -> int:
        """Width beyond which nothing here grows."""
        return px(_WIDEST) + 2 * self._side

    def _most_height(self) -> int:
        """Leave room for the rest, with two rows of lamps."""
        margins = self._body.contentsMargins()
        lower = 88 if self._lower.currentIndex() < 2 else 160
        lower = -28 if self._lower.isHidden() else lower  # nor a scale
        rest = 32 + 12 + 8 + 28 + lower + 12 + 20 + 12 + (40 if self._compact else 56)
        return self.height() - margins.top() - margins.bottom() - px(rest)

    def _below(self) -> QWidget:
        """Stack the table of lamps, the recent places, and what the live preview tells."""
        self.recent = RecentPlaces(self._presenter.places.open)
        self.rough = RoughCards(self._compact)
        self._lower = stacked(self._table(), self.recent, self.rough)
        return self._lower

    def _table(self) -> QWidget:
        self._note = Text("", role="dim")
        self._note.setFixedHeight(px(_ROW))
        self._rows = column(self._note, ...)
        self.lamps: list[TableRow] = []
        head = row(TableHead(self._columns), gap=None)
        scroll = _WholeRows(boxed(self._rows), name=tr("Lamps found"))
        # The head keeps its columns over those of the rows, which make way for the bar.
        scroll.bar_changed.connect(lambda width: head.setContentsMargins(0, 0, width, 0))
        return boxed(column(head, (scroll, 1)))

    def _age_line(self) -> QWidget:
        self._age_icon = Icon("clock", 16, "dim")
        self._age = Text("", 14, role="dim", elide=True)
        line = boxed(row(self._age_icon, (self._age, 1), gap=8))
        line.setFixedHeight(px(20))
        return line

    def _drop_row(self) -> QWidget:
        height = px(40 if self._compact else 56)
        self._zone = OutlineBox("none", "ctl", dashed=True)
        self._drop = Text("", 14, role="dim", elide=True)
        self._drop_icon = Icon("folder", 20, "dim")
        margins = (20, 0, 16, 0)
        row(self._drop_icon, (self._drop, 1), into=self._zone, gap=12, margins=margins)
        self.open_button = Button(tr("Open files…"), do=self._ask_files)
        self.open_button.set_tip(tr("Open panoramas, brackets or photographs"), "Ctrl O")
        self.watch_button = Button(tr("Watch a folder…"), do=self._watch)
        self.watch_button.set_tip(tr("Brackets that arrive in a folder become places"))
        line = boxed(row((self._zone, 1), self.open_button, self.watch_button, gap=8))
        for widget in (line, self.open_button, self.watch_button):
            widget.setFixedHeight(height)
        return line

    def _watch(self) -> None:
        if self._state is not None and self._state.watching:
            self._presenter.watching.stop()
        else:
            self._ask_folder()

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""
        before, self._state = self._state, state
        self.tools.show_state(state)
        self._show_panorama(state, before)
        if before is None or state.lamps != before.lamps or state.lamps_note != before.lamps_note:
            self._show_lamps(state.lamps, state.lamps_note)
        self._age.set_text(state.age)
        self._age.set_role("text" if state.age_old else "dim")
        self._age_icon.set(*(("warning", "text") if state.age_old else ("clock", "dim")))
        self._age_icon.setVisible(bool(state.age))
        if before is None or state.watching != before.watching:
            self._show_watching(state.watching)

    def _show_panorama(self, state: ProbeState, before: ProbeState | None) -> None:
        panorama = self.panorama
        live = state.live
        page = 1 if state.picture is not None else 0 if state.opening else 2
        self._stack.setCurrentIndex(page if live is None else 3)
        if live is not None:
            self.preview.set_picture(live.picture)
            self.rough.show_live(live)
        if state.running is not None and (before is None or before.running is None):
            # While the camera exposes: then the picture shows as soon as it is there.
            QTimer.singleShot(0, panorama, panorama.make_ready)
        self.start.ways[0].set_primary(not state.can_capture)
        self.empty.set(tr("Opening {name}…", name=state.opening))
        if before is None or state.recent != before.recent:
            self.recent.show_rows(state.recent)
        lower = 2 if live is not None else 0 if state.picture is not None else 1
        nothing = lower == 1 and not state.recent
        if (lower, nothing) != (self._lower.currentIndex(), self._lower.isHidden()):
            self._lower.setCurrentIndex(lower)
            self._lower.setVisible(not nothing)
            self._give_height()
        # The front first: a new picture of the same spot must not be seen at the old one.
        if before is None or state.front_deg != before.front_deg:
            had_picture = before is not None and before.picture is not None
            panorama.set_front(state.front_deg, glide=had_picture)
        panorama.set_picture(state.picture)
        if before is None or state.findings is not before.findings:
            findings = state.findings
            panorama.set_clipped(None if findings is None else findings.clipped)
            panorama.set_lamps(
                [SceneLamp(row.letter, row.azimuth_deg, row.elevation_deg) for row in state.lamps]
            )
        if before is None or state.layers != before.layers:
            panorama.set_shown(**{layer: layer in state.layers for layer in LAYERS})
        if before is None or state.marker_words != before.marker_words:
            panorama.set_marker_words(state.marker_words)

    def _show_lamps(self, lamps: tuple[LampRow, ...], note: str) -> None:
        while len(self.lamps) > len(lamps):
            row = self.lamps.pop()
            row.hide()
            row.deleteLater()
        while len(self.lamps) < len(lamps):
            row = TableRow(self._columns, self._cells(lamps[len(self.lamps)]))
            # It only tells: nothing is chosen by it.
            row.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            row.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            self.lamps.append(row)
            self._rows.insertWidget(self._rows.count() - 1, row)
        for row, lamp in zip(self.lamps, lamps, strict=True):
            row.set(self._cells(lamp))
            row.setAccessibleName(lamp.spoken)
        self._note.say(note)

    def _cells(self, lamp: LampRow) -> tuple[Cell, ...]:
        where = () if self._compact else (Cell(lamp.where),)
        return (
            Cell(lamp.name, letter=lamp.letter, strong=True),
            *where,
            Cell(lamp.azimuth),
            Cell(lamp.elevation),
            Cell(lamp.share),
            Cell(tr("clipped"), "hatch") if lamp.clipped else Cell(""),
        )

    def _show_watching(self, folder: str) -> None:
        idle = _DROP_SHORT if self._compact else _DROP
        watching = tr("Watching {folder}: a bracket that arrives opens here", folder=folder)
        self._drop.set_text(watching if folder else idle)
        self._drop_icon.set("eye" if folder else "folder")
        self.watch_button.set_text(tr("Stop watching") if folder else tr("Watch a folder…"))
