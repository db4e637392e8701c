"""The view of the Paint screen: from left to right, the tools, the canvas and the live column."""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QPainter, QShowEvent
from PySide6.QtWidgets import QApplication, QWidget

from app.core.painting.canvas import Canvas, Region
from app.core.painting.user_styles import EXPORT_ENDING
from app.core.text import tr
from app.ui.plots.weights import WeightScale
from app.ui.screens.paint.canvas import CanvasMode
from app.ui.screens.paint.canvas_view import PaintCanvas
from app.ui.screens.paint.files import FileWish, NameWish
from app.ui.screens.paint.live_view import LiveColumn
from app.ui.screens.paint.screen import PaintPresenter, PaintState
from app.ui.screens.paint.tools_view import ToolColumn, ToolStrip
from app.ui.theme import Theme, px, theme
from app.ui.widgets.buttons import Do, Pressable
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.dialogs import LineSheet, ask_file, ask_target
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import put_text, text_width
from app.ui.widgets.surfaces import Room

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
_LEAST: Final = (496, 400)  # minimum size of the middle
_STYLE_FILES: Final = tr("Turnlight styles") + f" (*{EXPORT_ENDING})"


class _Link(Pressable):
    """A link in the breadcrumbs."""

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
    """The breadcrumbs ("Styles > My Rembrandt  not saved yet") and the choice of contents."""

    def __init__(self, presenter: PaintPresenter) -> None:
        super().__init__()
        self.setFixedHeight(px(40))
        link = _Link(tr("Styles"), tr("Back to styles"), "Esc", do=presenter.back)
        self._title = Text("", 16, 600, elide=True)
        self._status = Text("", 14, role="dim", elide=True)
        self._mode = SegmentedChoice(_MODES, tr("The canvas shows"))
        self._mode.chosen.connect(lambda key: presenter.look.show(CanvasMode(key)))
        where = (link, Icon("chevron-right", 16, "dim"), self._title, self._status)
        row(*where, ..., self._mode, into=self, gap=8)

    def show_state(self, state: PaintState) -> None:
        self._title.set_text(state.save.title)
        self._status.set_text(state.save.status)
        if self._mode.key != state.canvas.mode.value:
            self._mode.choose(state.canvas.mode.value)


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
        self.canvas.head_turned.connect(presenter.look.turn_head)
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
        """Show a `PaintState`."""
        self.tools.show_state(state.tools)
        self.crumbs.show_state(state)
        self.canvas.show_state(state.canvas)
        self.live.show_state(state.live, state.save)
        if self._sheet is not None:
            self._sheet.show_busy(state.save.busy)

    def canvas_changed(self, canvas: Canvas, regions: tuple[Region, ...] | None) -> None:
        """Show the canvas (see `PaintView.canvas_changed`)."""
        self.canvas.canvas_changed(canvas, regions)

    def ask_name(self, wish: NameWish, title: str) -> None:
        """Ask for a name in a sheet over the window."""
        if self._sheet is None:
            words, button = _TITLES[wish]
            sheet = LineSheet(self.window(), words, tr("Name"), button, title, tr("My Rembrandt"))
            sheet.taken.connect(partial(self._presenter.files.named, wish))
            sheet.closed.connect(self._sheet_closed)
            # The sheet is a child of the window and would outlive this screen.
            self.destroyed.connect(sheet.deleteLater)
            self._sheet = sheet
            sheet.open(sheet.field.edit)

    def show_trouble(self, sentence: str) -> None:
        """Show, beside the name, why it is invalid, or close the sheet if `sentence` is empty."""
        if self._sheet is not None:
            self._sheet.say(sentence)

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file, and pass it to the presenter."""
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
        # Logical pixels are enough, because the picture of the head has fewer than half as many.
        self._presenter.sized(size.height(), size.width())

    def showEvent(self, event: QShowEvent) -> None:
        """Focus the canvas, unless another widget has the focus."""
        super().showEvent(event)
        focus = QApplication.focusWidget()
        if focus is None or not focus.isVisible():
            self.canvas.setFocus(Qt.FocusReason.OtherFocusReason)
