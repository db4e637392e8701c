"""The Paint screen: tools at the left, canvas in the middle, the live answer at the right.

The live column shows what the strokes come to in this place.
"""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QPainter, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QVBoxLayout, QWidget

from app.core.painting.canvas import Canvas, Region
from app.core.painting.library import EXPORT_ENDING
from app.core.text import tr
from app.ui.plots.match_circle import PolarPlot
from app.ui.plots.weights import WeightLegend, WeightPanorama, WeightScale
from app.ui.presenters.model import COMPUTING
from app.ui.screens.paint.canvas_view import PaintCanvas
from app.ui.screens.paint.screen import PaintPresenter
from app.ui.screens.paint.state import CanvasMode, FileWish, LiveState, NameWish, PaintState
from app.ui.screens.paint.tools_view import ToolColumn, ToolStrip
from app.ui.theme import Theme, px, theme
from app.ui.widgets.buttons import Button, Do, IconButton, Pressable
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.dialogs import LineSheet, ask_file, ask_target
from app.ui.widgets.displays import Meter, Picture
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, column, row
from app.ui.widgets.messages import StaleVeil
from app.ui.widgets.paint import put_text, text_width
from app.ui.widgets.surfaces import Menu, Room, Scroll, Surface

_ICONS: Final = {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}
_PORTRAIT: Final = (200, 232)
_SMALL_PORTRAIT: Final = (120, 140)
_PLOT: Final = (176, 120)  # as designed, and in a low window


class _Numbers(QWidget):
    """Turn and match in figures, or a sentence why there are none.

    `score`: match with its meter, where it stands elsewhere than below the turn.
    """

    def __init__(self, compact: bool, presenter: PaintPresenter) -> None:
        super().__init__()
        t = theme()
        self._turn = Text("", 48, 700, "amber")
        self._icon = Icon("clockwise", 20)
        self._direction = Text("", 14 if compact else 16, 600, elide=True)
        self._match = Text("", 28, 600)
        self._meter = Meter()
        self._origin = Text("", 12, role="dim", wrap=True)
        self._sentence = Text("", 14, wrap=True)
        self._probe = Button(tr("Go to Probe"), size="small", do=presenter.measure)
        # On the first line of a direction that takes two.
        beside = QVBoxLayout()
        beside.addSpacing((t.line_height(14 if compact else 16) - px(20)) // 2)
        add(beside, self._icon, ...)
        way = row(beside, self._direction, ..., gap=4)
        number = row(self._match, Text(tr("of 100"), 14, role="dim"), ..., gap=8)
        turn = (Text(tr("Turn"), 14, role="dim"), self._turn, way, ...)
        match = (Text(tr("Match"), 14, role="dim"), number, self._meter, 4, self._origin)
        self._apart = compact
        self._figures, self.score = QWidget(), QWidget()
        column(*turn, *(() if compact else match), into=self._figures)
        if compact:
            column(*match, into=self.score)
        self._filler = QWidget()
        probe = (self._probe, 0, Qt.AlignmentFlag.AlignLeft)
        whole = ((self._figures, 1), self._sentence, probe, (self._filler, 1))
        column(*whole, into=self, gap=8)

    def show_state(self, state: LiveState) -> None:
        has_words = bool(state.sentence)
        self._figures.setVisible(not has_words)
        # Without a place of its own it would open as a window.
        if self._apart:
            self.score.setVisible(not has_words)
        self._sentence.setVisible(has_words)
        self._filler.setVisible(has_words)
        self._probe.setVisible(state.offers_probe)
        self._sentence.set_text(state.sentence)
        self._turn.set_text(state.turn)
        self._icon.setVisible(state.way in _ICONS)
        self._icon.set(_ICONS.get(state.way, "clockwise"))
        self._direction.set_text(state.direction)
        self._match.set_text(state.match)
        self._meter.set(state.match_value, state.limit)
        self._origin.set_text(state.origin)


class LiveColumn(Surface):
    """Picture, turn, match, panorama, plot, and saving.

    `laid`, Signal(QSize): size of the portrait, logical pixels.
    """

    laid = Signal(QSize)

    def __init__(self, compact: bool, presenter: PaintPresenter) -> None:
        super().__init__("panel", ("left",), tr("Here, live"))
        t = theme()
        self._compact = compact
        self._actions = presenter.files.actions
        self._state: LiveState | None = None
        self._save_shown: tuple[str, bool, str] | None = None
        self._margin = px(16 if compact else 24)
        self.setFixedWidth(px(296 if compact else 392))
        self._picture = Picture(tr("The sitter at the best turn"))
        self._picture.setFixedSize(*(px(n) for n in (_SMALL_PORTRAIT if compact else _PORTRAIT)))
        self._numbers = _Numbers(compact, presenter)
        wide = 264 if compact else 344
        self._panorama = WeightPanorama(
            size=(wide, wide // 2), sitter=tr("Sitter faces"), behind=""
        )
        self._panorama.setFixedSize(self._panorama.sizeHint())
        # It shows where the best turn leads; there is nothing to drag here.
        self._panorama.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._panorama.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._place = QWidget()
        self._plot: PolarPlot | None = None
        self._good = Text("", 12, role="dim", wrap=True)
        self._save = Button(tr("Save as my style"), "save", "primary", "main")
        self._save.clicked.connect(presenter.files.ask_save)
        self._more = IconButton("more", tr("More"), size="main", do=self._open_menu)
        self._upper = QWidget()
        head = row(
            Text(tr("Here, live"), 20, 600),
            ...,
            Text(tr("follows every stroke"), 12, role="dim", elide=True),
            gap=8,
        )
        inner = column(
            *(head, 8, row(self._picture, self._numbers, gap=12 if compact else 16)),
            *((8, self._numbers.score) if compact else ()),
            *(16, self._place, ...),
            into=self._upper,
        )
        inner.setContentsMargins(self._margin - t.line_width, px(16), self._margin, 0)
        self._fill_place()
        foot = row((self._save, 1), self._more, gap=8)
        foot.setContentsMargins(self._margin - t.line_width, 0, self._margin, 0)
        scroll = Scroll(self._upper)
        self.veil = StaleVeil(scroll, COMPUTING)
        self._outer = column((scroll, 1), foot, into=self, gap=8)
        self._outer.setContentsMargins(t.line_width, 0, 0, px(16 if compact else 24))

    def _fill_place(self) -> None:
        """Lay out what there is only with light."""
        title = Text(tr("What it asks of this place"), 12, 600, "dim")
        whole = column(title, 6, self._panorama, 8, WeightLegend(), 8, into=self._place)
        if self._compact:
            whole.addWidget(self._good)
            return
        plot = PolarPlot(size=_PLOT[0])
        plot.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        words = column(..., Text(tr("Match by turn"), 14, role="dim"), self._good, ..., gap=8)
        whole.addLayout(row(plot, (words, 1), gap=16))
        self._plot = plot

    def show_state(self, state: PaintState) -> None:
        """Show what the strokes come to, and whether they can be saved."""
        self._show_save(state)
        live = state.live
        if live is self._state:
            return
        before, self._state = self._state or LiveState(), live
        self.veil.cover(live.stale)
        self._picture.set_picture(live.picture)
        self._picture.set_tag(live.picture_tag if live.picture is not None else "")
        self._numbers.show_state(live)
        if self._place.isHidden() == (live.panorama is not None):
            self._place.setVisible(live.panorama is not None)
            self._fit_plot()
        self._panorama.set_picture(live.panorama, live.front)
        if live.weights is not before.weights:
            self._panorama.set_target(live.weights)
        self._panorama.set_turn(live.turn_deg, live.turn_deg)
        # Without the plot there is no ring to speak of.
        self._good.set_text(f"{live.good} {live.dashed}".strip() if self._plot else live.good)
        if self._plot is not None and live.curve is not before.curve:
            best = live.turn_deg if live.curve else None
            self._plot.set_data(live.curve, live.limit, live.arc, best, live.peaks)

    def _show_save(self, state: PaintState) -> None:
        now = (state.save_words, state.saving, state.save_why)
        if now == self._save_shown:
            return
        self._save_shown = now
        self._save.set_text(state.save_words)
        if state.saving != self._save.busy:
            self._save.set_busy(tr("Saving…") if state.saving else None)
        self._save.set_available(state.saving or not state.save_why, state.save_why)

    def _open_menu(self) -> None:
        menu = Menu(self._more, tr("More"))
        for action in self._actions():
            why = "" if action.enabled() else tr("Save it first")
            keys = action.shortcut.split(";")[0].replace("+", " ")
            menu.add(action.words, action.run, action.icon, keys, why)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.drop(self._more)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Tell how large the portrait is."""
        super().resizeEvent(event)
        self._fit_plot()
        self.laid.emit(self._picture.size())

    def _fit_plot(self) -> None:
        """Let the plot give way in a low window, so that nothing scrolls."""
        if self._plot is None:
            return
        most, least = (px(side) for side in _PLOT)
        self._plot.take_side(most)
        around = self._outer.contentsMargins()
        room = self.height() - around.bottom() - self._outer.spacing() - self._save.height()
        self._plot.take_side(max(most - max(self._upper.sizeHint().height() - room, 0), least))


_TITLES: Final[dict[NameWish, tuple[str, str]]] = {
    "save": (tr("Save as my style"), tr("Save")),
    "save-as": (tr("Save as a new style"), tr("Save")),
    "rename": (tr("Rename the style"), tr("Rename")),
}


_MODES: Final = (
    (CanvasMode.WEIGHTS.value, tr("Weights")),
    (CanvasMode.TARGET.value, tr("Target")),
    (CanvasMode.HERE.value, tr("Here")),
)
_LEAST: Final = (496, 400)  # of the middle
_STYLE_FILES: Final = tr("Turnlight styles") + f" (*{EXPORT_ENDING})"


class _Link(Pressable):
    """Words that lead back."""

    def __init__(self, text: str, name: str, shortcut: str, do: Do) -> None:
        super().__init__(name, do=do)
        self.set_tip(name, shortcut)
        self.setText(text)
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def sizeHint(self) -> QSize:
        t = theme()
        return QSize(text_width(t.font(14), self.text()), px(32))

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        ink = t.c.text if self.hovered() or self.isDown() else t.c.dim
        put_text(painter, self.rect(), self.text(), t.font(14), ink)
        if self.hovered() or t.contrast:
            low = (self.height() + px(18)) // 2
            painter.fillRect(0, low, self.width(), px(1), ink)


class _Crumbs(QWidget):
    """Where one is: "Styles > My Rembrandt  not saved yet", and what the canvas shows."""

    def __init__(self, presenter: PaintPresenter) -> None:
        super().__init__()
        self.setFixedHeight(px(40))
        link = _Link(tr("Styles"), tr("Back to styles"), "Esc", do=presenter.back)
        self._title = Text("", 16, 600, elide=True)
        self._status = Text("", 14, role="dim", elide=True)
        self._mode = SegmentedChoice(_MODES, tr("The canvas shows"))
        self._mode.chosen.connect(lambda key: presenter.show(CanvasMode(key)))
        where = (link, Icon("chevron-right", 16, "dim"), self._title, self._status)
        row(*where, ..., self._mode, into=self, gap=8)

    def show_state(self, state: PaintState) -> None:
        self._title.set_text(state.title)
        self._status.set_text(state.status)
        if self._mode.key != state.mode.value:
            self._mode.choose(state.mode.value)


class PaintScreen(QWidget):
    """The view of `app.ui.screens.paint.screen.PaintPresenter`."""

    def __init__(self, presenter: PaintPresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self._compact = compact
        self._sheet: LineSheet | None = None
        self.setAccessibleName(tr("Paint"))
        self.tools: ToolColumn | ToolStrip = (
            ToolStrip(presenter) if compact else ToolColumn(presenter)
        )
        self.crumbs = _Crumbs(presenter)
        self.canvas = PaintCanvas()
        self.live = LiveColumn(compact, presenter)
        row(self.tools, (Room(self._middle(), *_LEAST), 1), self.live, into=self)
        self.canvas.pressed.connect(presenter.press)
        self.canvas.drawn.connect(presenter.draw)
        self.canvas.lifted.connect(presenter.lift)
        self.canvas.dabbed.connect(presenter.dab)
        self.canvas.head_turned.connect(presenter.turn_head)
        self.live.laid.connect(self._portrait_laid)

    def _middle(self) -> QWidget:
        compact = self._compact
        middle = QWidget()
        side, foot, below = (16, 12, 8) if compact else (24, 24, 26)
        column(
            *(self.crumbs, 8, (self.canvas, 1), below, WeightScale()),
            *((8, self.tools.sliders) if compact else ()),
            into=middle,
            margins=(side, 8, side, foot),
        )
        return middle

    def show_state(self, state: PaintState) -> None:
        """Show it; see `PaintState`."""
        self.tools.show_state(state)
        self.crumbs.show_state(state)
        self.canvas.show_state(state)
        self.live.show_state(state)
        if self._sheet is not None:
            self._sheet.show_busy(state.saving)

    def canvas_changed(self, canvas: Canvas, regions: tuple[Region, ...] | None) -> None:
        """Show what is painted."""
        self.canvas.canvas_changed(canvas, regions)

    def ask_name(self, wish: NameWish, title: str) -> None:
        """Ask for a name in a sheet over the window."""
        if self._sheet is None:
            words, button = _TITLES[wish]
            sheet = LineSheet(self.window(), words, tr("Name"), button, title, tr("My Rembrandt"))
            sheet.taken.connect(partial(self._presenter.files.named, wish))
            sheet.closed.connect(self._sheet_closed)
            # It lies over the window, not in this screen, and would outlive it.
            self.destroyed.connect(sheet.deleteLater)
            self._sheet = sheet
            sheet.open(sheet.field.edit)

    def show_trouble(self, sentence: str) -> None:
        """Say beside the name why it cannot be taken; empty: it was."""
        if self._sheet is not None:
            self._sheet.say(sentence)

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file and hand it to the presenter."""
        files = self._presenter.files
        if what == "export":
            path = ask_target(self, tr("Export style"), suggested, _STYLE_FILES)
        else:
            path = ask_file(self, tr("Import style"), _STYLE_FILES)
        if path is not None:
            (files.export if what == "export" else files.import_style)(path)

    def _sheet_closed(self) -> None:
        sheet, self._sheet = self._sheet, None
        if sheet is not None:
            sheet.deleteLater()

    def _portrait_laid(self, size: QSize) -> None:
        # Logical pixels do on any screen: the head's own picture is less than half as fine.
        self._presenter.sized(size.height(), size.width())

    def showEvent(self, event: QShowEvent) -> None:
        """Give the keyboard to the canvas, unless somebody else has it."""
        super().showEvent(event)
        focus = QApplication.focusWidget()
        if focus is None or not focus.isVisible():
            self.canvas.setFocus(Qt.FocusReason.OtherFocusReason)
