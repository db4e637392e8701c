"""The cards in the gallery.

Each card is painted in one pass, because a window can show twenty of them.

`CompareSheet` shows several styles side by side. `TurnWords` shows the turn in large figures with
its direction, and `Facts` shows the numbers beside the turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPen, QPixmap, QResizeEvent
from PySide6.QtWidgets import QWidget

from app.core.portrait.gallery_portraits import CLOSE_SHAPE
from app.core.text import tr
from app.ui.presenters.window_model import NO_LIGHT
from app.ui.screens.styles.cards import CardState
from app.ui.screens.styles.detail import DetailState
from app.ui.theme import Theme, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import describe
from app.ui.widgets.buttons import Button, Pressable
from app.ui.widgets.dialogs import KeysSheet, Term, show_folder
from app.ui.widgets.displays import Picture, to_image
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import boxed, column, grid, row
from app.ui.widgets.paint import RIGHT, STALE, box, put_text, text_width
from app.ui.widgets.surfaces import Card, OutlineBox
from app.words.phrases.turns import turn_words

NO_TURNS: Final = tr("Measure a place to see the turns.")
_EDGE: Final = 3  # margin around the pictures
_PAD: Final = 8
_GAP: Final = 2
_RADIUS: Final = 6
_BELOW: Final = 46  # height of the text below the pictures
_SWITCH: Final = (56, 24)
_WAYS: Final = {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}


def picture_size(card: int) -> QSize:
    """Return the size of each of the two pictures on a card, in logical pixels."""
    t = theme()
    wide = (card - 2 * t.px(_EDGE) - t.px(_GAP)) // 2
    return QSize(wide, round(wide * CLOSE_SHAPE))


def card_size(wide: int) -> QSize:
    """Return the size of a card of this width in logical pixels. Faces fill over half the card."""
    return QSize(wide, picture_size(wide).height() + theme().px(_EDGE) + theme().px(_BELOW))


class StyleCard(Card):
    """A card with a style's target and its picture here, its name, turn, grade and reason."""

    marked = Signal()
    """Emitted on Ctrl+click or Space, to mark or unmark the style for comparison."""
    switched = Signal()
    """Emitted to show the other side of the style."""

    def __init__(self, state: CardState) -> None:
        super().__init__(state.spoken)
        self.state = state
        self._ready: tuple[tuple[Any, ...], QPixmap] | None = None
        self.switch = SideSwitch()
        self.switch.setParent(self)
        self.switch.clicked.connect(self.switched)
        self._tell()

    def show_state(self, state: CardState) -> None:
        """Show the state of the card."""
        self.set_selected(state.chosen)
        if state != self.state:
            self.state = state
            self._tell()
            self.update()

    def click(self) -> None:
        """Open the style on Enter, as a double click does."""
        self.opened.emit()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Mark the style on a click with Ctrl held."""
        if event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.marked.emit()
        else:
            super().mousePressEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Mark the style on Space."""
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            self.marked.emit()
        else:
            super().keyPressEvent(event)

    def _tell(self) -> None:
        state = self.state
        words = tr("{card}, marked", card=state.spoken) if state.marked else state.spoken
        describe(self, words, tip=state.tip)
        self.switch.show_side(state)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the switch in the corner of the target."""
        super().resizeEvent(event)
        t = theme()
        wide, high = (t.px(side) for side in _SWITCH)
        edge = t.px(_EDGE) + t.px(4)
        bottom = t.px(_EDGE) + picture_size(self.width()).height() - t.px(4)
        self.switch.setGeometry(edge, bottom - high, wide, high)

    def paint_content(self, painter: QPainter) -> None:
        """Paint the pictures and the text."""
        t = theme()
        edge, pad = t.px(_EDGE), t.px(_PAD)
        high = picture_size(self.width()).height()
        painter.setOpacity(STALE if self.state.stale else 1.0)
        dpr = painter.deviceTransform().m11()
        pixmap = self._pictures(self.width() - 2 * edge, high, dpr)
        painter.drawPixmap(QPointF(edge, edge), pixmap)
        top, wide = edge + high, self.width() - 2 * pad
        self._paint_name(painter, QRect(pad, top + t.px(2), wide, t.px(22)))
        self._paint_line(painter, QRect(pad, top + t.px(23), wide, t.px(16)))
        state = self.state
        painter.setOpacity(1.0)
        if state.marked:
            side = t.px(24)
            spot = QRectF(self.width() - side - t.px(8), t.px(8), side, side)
            box(painter, spot, side / 2, t.c.amberfill, t.c.onamber, t.px(2))
            draw_icon(painter, "check", spot, t.px(16), t.c.onamber)

    def _paint_name(self, painter: QPainter, area: QRect) -> None:
        t, state = theme(), self.state
        room, side = QRect(area), t.px(16)
        if state.turn:
            font = t.font(16, 700)
            put_text(painter, area, state.turn, font, t.c.amber, RIGHT)
            left = area.right() + 1 - text_width(font, state.turn)
            if state.way in _WAYS:
                left -= side + t.px(5)
                spot = QRect(left, area.top(), side, area.height())
                draw_icon(painter, _WAYS[state.way], spot, side, t.c.amber)
            room.setRight(left - t.px(4))
        ink = t.c.text if state.in_reach else t.c.dim
        put_text(painter, room, state.title, t.font(14, 600), ink)

    def _paint_line(self, painter: QPainter, area: QRect) -> None:
        t, state = theme(), self.state
        room, font, line = QRect(area), t.font(12), state.line
        if state.word:
            strong = t.font(12, 600)
            put_text(painter, area, state.word, strong, t.c.text if state.in_reach else t.c.dim)
            room.setLeft(area.left() + text_width(strong, state.word) + t.px(6))
        if state.brief and text_width(font, line) > room.width():
            line = state.brief
        put_text(painter, room, line, font, t.c.dim)

    def _pictures(self, wide: int, high: int, dpr: float) -> QPixmap:
        """Return both pictures, with rounded outer corners, at the screen's resolution."""
        key = (wide, high, dpr, self.state.version, self.state.swapped, theme().name)
        if self._ready is not None and self._ready[0] == key:
            return self._ready[1]
        t = theme()
        pixmap = QPixmap(round(wide * dpr), round(high * dpr))
        pixmap.setDevicePixelRatio(dpr)
        pixmap.fill(Qt.GlobalColor.transparent)
        each = (wide - t.px(_GAP)) / 2
        painter = QPainter(pixmap)
        box(painter, QRectF(0, 0, wide, high), t.px(_RADIUS), t.c.well)
        # Paint into the well's shape, because clipping would leave jagged corners.
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceIn)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        for number, picture in enumerate((self.state.target, self.state.here)):
            _put(painter, QRectF(number * (each + t.px(_GAP)), 0, each, high), picture)
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_Clear)
        painter.fillRect(QRectF(each, 0, t.px(_GAP), high), Qt.GlobalColor.transparent)
        painter.end()
        self._ready = (key, pixmap)
        return pixmap


def _put(painter: QPainter, area: QRectF, picture: NDArray[Any] | None) -> None:
    """Draw a picture into a rectangle, cropping it around the centre to the aspect ratio."""
    if picture is None:
        return
    image = to_image(picture)
    scale = max(area.width() / image.width(), area.height() / image.height())
    wide, high = area.width() / scale, area.height() / scale
    part = QRectF((image.width() - wide) / 2, (image.height() - high) / 2, wide, high)
    painter.drawImage(area, image, part)


class SideSwitch(Pressable):
    """A switch between the two sides of a style: two discs, each lit as its picture is.

    The keyboard reaches it by the shortcut of the screen, since the cards are one Tab stop.
    """

    preferred_size = _SWITCH

    def __init__(self) -> None:
        super().__init__(tr("Show the other side"))
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._look = ("", False)

    def show_side(self, state: CardState) -> None:
        """Show which side the card shows, or hide the switch if there is no other side."""
        self.setVisible(bool(state.other))
        if state.other:
            describe(self, state.other_words, "X")
        if (state.side, state.stale) != self._look:
            self._look = state.side, state.stale
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint both discs, on the left the one that is lit from camera left."""
        half, (lit_side, is_stale) = self.width() / 2, self._look
        painter.setOpacity(STALE if is_stale else 1.0)
        box(painter, self.rect(), t.px(6), t.c.tag)
        for number, side in enumerate(("right", "left")):
            area = QRectF(number * half, 0, half, self.height())
            ink, gap = t.c.ontag, t.px(2)
            if side == lit_side:
                box(painter, area.adjusted(gap, gap, -gap, -gap), t.px(4), t.c.ontag)
                ink = t.c.tag
            disc = QRectF(0, 0, t.px(13), t.px(13))
            disc.moveCenter(area.center())
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(QPen(ink, t.line_width))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(disc)
            painter.setBrush(ink)
            painter.drawPie(disc, 90 * 16, 180 * 16 if side == "right" else -180 * 16)


class PaintCard(Card):
    """The card for painting a new style."""

    def __init__(self) -> None:
        super().__init__(tr("Paint a new style"), dashed=True)
        title = Text(tr("Paint a new style"), 14, 600, elide=True)
        head = row(Icon("brush", 20), (title, 1), gap=10)
        words = tr("Show where the face should be brighter and darker.")
        more = Text(words, 12, role="dim", wrap=True)
        column(..., head, more, ..., into=self, gap=8, margins=16)
        self.setAccessibleDescription(words)


class DamagedCard(OutlineBox):
    """The card for a style that cannot be read."""

    def __init__(self, state: CardState) -> None:
        super().__init__()
        describe(self, state.spoken, tip=state.tip)
        title = Text(state.title, 14, 600, elide=True)
        head = row(Icon("warning", 20), (title, 1), gap=8)
        line = Text(state.line, 12, role="dim", wrap=True)
        self.button = Button(tr("Show file"), "folder", size="small")
        if state.damaged is not None:
            folder = state.damaged.parent
            self.button.clicked.connect(lambda: show_folder(folder))
        button = (self.button, 0, Qt.AlignmentFlag.AlignLeft)
        column(head, line, ..., button, into=self, gap=4, margins=(12, 8, 12, 8))


class HeldKey(QObject):
    """Reports whether the S key is down while a widget or any of its children has the focus."""

    held = Signal(bool)

    def __init__(self, widget: QWidget) -> None:
        super().__init__(widget)
        widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Follow the key, and report its release even when the key event would be missed."""
        kind, down = event.type(), QEvent.Type.KeyPress
        if kind in (QEvent.Type.Hide, QEvent.Type.WindowDeactivate):
            self.held.emit(False)
        elif isinstance(event, QKeyEvent) and kind in (down, QEvent.Type.KeyRelease):
            plain = not (event.modifiers() or event.isAutoRepeat())
            if event.key() == Qt.Key.Key_S and plain:
                self.held.emit(kind == down)
        return False


class _ComparedStyle(QWidget):
    """A style in the comparison, with its target above its picture here, its turn and direction."""

    def __init__(self, state: DetailState, size: QSize) -> None:
        super().__init__()
        self.setAccessibleName(f"{state.title}, {state.side}")
        self.pictures = Picture(tr("Target")), Picture(tr("Picture here"))
        here = state.here, state.here_tag, state.here_exposed
        self._sides = (state.target, state.target_tag, ""), here
        for picture in self.pictures:
            picture.setFixedSize(size)
        turn = turn_words(state.needle) if state.in_reach else tr("Not here")
        numbers = [tr("Match {match}", match=state.match)]
        numbers += [tr("Contrast {contrast}", contrast=state.contrast)] if state.contrast else []
        self.button = Button(state.main_words)
        words = (
            Text(state.title, 16, 600, elide=True),
            Text(state.side, 12, role="dim", wrap=True),
            4,
            Text(turn, 16, 700, "amber" if state.in_reach else "text", elide=True),
            Text("\n".join(numbers), 12, wrap=True),
            Text(state.verdict or state.reason, 12, role="dim", wrap=True),
        )
        column(*self.pictures, column(*words), ..., self.button, into=self, gap=8)
        self.setFixedWidth(size.width())
        self.swap(False)

    def swap(self, swapped: bool) -> None:
        """Swap the target and the picture here."""
        sides = self._sides[:: -1 if swapped else 1]
        for picture, (pixels, tag, exposed) in zip(self.pictures, sides, strict=True):
            picture.set_picture(pixels)
            picture.set_tag(tag)
            picture.set_tag(exposed, "tr")


class CompareSheet(KeysSheet):
    """Two to four styles side by side, in pictures with the same size, crop and exposure."""

    opened = Signal(str)

    def __init__(self, host: QWidget, states: Sequence[DetailState]) -> None:
        t, size = theme(), compared_size(host, len(states))
        wide = (size.width() + t.px(16)) * len(states) + t.px(32)
        super().__init__(host, tr("Compare"), round(wide / t.scale))
        parts = [_ComparedStyle(state, size) for state in states]
        for part, state in zip(parts, states, strict=True):
            part.button.clicked.connect(lambda _on=False, key=state.key: self.opened.emit(key))
            HeldKey(self).held.connect(part.swap)
        self.body.addLayout(row(*parts, gap=16))


def compared_size(host: QWidget, count: int) -> QSize:
    """Return the size of each picture in a comparison of styles, in logical pixels."""
    t = theme()
    across = (host.width() - t.px(2 * 24 + 2 * 24 + 16 * (count - 1))) // count
    side = max(min(across, (host.height() - t.px(376)) // 2), t.px(96))
    return QSize(min(across, round(1.35 * side)), side)


_LABEL: Final = 50
_NUMBER: Final = 60  # height of the turn with its direction and clock position
_VERDICT: Final = 44  # height of the verdict in its place
_BESIDE: Final = 52  # height of the text beside the number: two lines of a reason
_FACTS: Final = (
    ("good_from", tr("Good")),
    ("quality", tr("C")),
    ("match", tr("Match")),
    ("contrast", tr("Contrast")),
    ("ratio", tr("Ratio")),
)


class TurnWords(QWidget):
    """The turn, its direction and its clock position, and what is soft or missing at the place."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        t = theme()
        self._compact = compact
        self._turn = Text("", 36 if compact else 48, 700, "amber")
        self._icon = Icon("clockwise", 20 if compact else 28, "text" if compact else "amber")
        self._direction = Term("turn", look=(14 if compact else 16, 600, "text"))
        self._clock = Term("clock", look=(12 if compact else 14, 400, "dim"))
        self._out = Icon("not-possible", 20)
        self._reason = Text("", 12 if compact else 14, role="dim", wrap=True)
        icon = [self._icon] if compact else []
        way = row(*icon, self._out, (self._direction, 1), gap=6)
        if compact:
            words = column(..., way, self._clock, self._reason, ...)
            row(self._turn, (words, 1), into=self, gap=12)
            self.setFixedHeight(t.px(_BESIDE))
        else:
            words = column(..., way, self._clock, ...)
            self._number = boxed(row(self._turn, self._icon, (words, 1), gap=12))
            column(self._number, self._reason, into=self, gap=4)

    def show_state(self, state: DetailState) -> None:
        """Show the turn at the needle, or the reason why there is no turn."""
        out, probe = bool(state.verdict), state.main == "probe"
        self._turn.say("" if out else state.turn)
        self._icon.setVisible(state.way in _WAYS and not out)
        self._icon.set(_WAYS.get(state.way, "clockwise"))
        self._out.setVisible(out)
        if not self._compact:
            # A text that comes and goes with the needle must not move what is below.
            self._number.setFixedHeight(theme().px(_VERDICT if out or probe else _NUMBER))
        direction = tr("Not here") if out else state.direction
        self._direction.say(NO_LIGHT if probe else direction, "grade" if out else "turn")
        self._direction.setVisible(bool(self._direction.text()))
        aside = out and not state.at_best
        self._clock.say(turn_words(state.needle) if aside else "" if out else state.clock)
        reason = NO_TURNS if probe else state.reason
        self._reason.set_text(reason)
        has_room = not self._compact or probe or (out and not aside)
        self._reason.setVisible(bool(reason) and has_room)


def _value(key: str) -> Text:
    weight = 400 if key in ("good_from", "ratio") else 600
    return Text("", 12 if key == "contrast" else 14, weight, elide=True)


class Facts(QWidget):
    """The tolerance arc, the match, the contrast and the lighting ratio."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        self._rows = {key: (Term(key, label), _value(key)) for key, label in _FACTS}
        self._short = Text("", 12, role="dim", elide=True)
        self._verdict = Text("", 12, role="dim", wrap=True)
        cells = [part for line in self._rows.values() for part in line]
        across, gap = (1, 2) if compact else (2, 4)
        facts = grid(*cells, across=across, gap=(4, gap), stretched=across - 1)
        if not compact:
            facts.setColumnMinimumWidth(0, theme().px(_LABEL))
        column(facts, self._short, self._verdict, ..., into=self, gap=gap)

    def show_state(self, state: DetailState) -> None:
        """Show the numbers at the needle's turn, omitting those that are empty."""
        for key, (name, value) in self._rows.items():
            words = str(getattr(state, key))
            value.say(words)
            name.setVisible(bool(words))
        self._short.set_text(state.ratio_short)
        self._short.setVisible(bool(state.ratio_short) and not self._compact)
        self._verdict.say("" if self._compact else state.verdict)
        for widget in (*self._rows["ratio"], self._short):
            _describe(widget, state.ratio_tip)
        for widget in self._rows["good_from"]:
            _describe(widget, state.caution)


def _describe(widget: QWidget, words: str) -> None:
    """Set a widget's tooltip and its description for screen readers."""
    if widget.accessibleDescription() != words:
        widget.setToolTip(words)
        widget.setAccessibleDescription(words)
