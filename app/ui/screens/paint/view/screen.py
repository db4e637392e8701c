"""The Paint screen: tools at the left, canvas in the middle, the live answer at the right."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QPainter, QShowEvent
from PySide6.QtWidgets import QApplication, QWidget

from app.core.painting.canvas import Canvas, Region
from app.core.painting.library import EXPORT_ENDING
from app.core.painting.stroke import Brush
from app.core.text import tr
from app.ui.screens.paint.state import FileWish, NameWish, PaintState, Shown
from app.ui.screens.paint.view.canvas import PaintCanvas
from app.ui.screens.paint.view.live import LiveColumn
from app.ui.screens.paint.view.tools import BrushSliders, ToolColumn, ToolStrip
from app.ui.theme import Theme, theme
from app.ui.widgets.buttons import Pressable
from app.ui.widgets.choices import Segmented
from app.ui.widgets.dialogs import LineSheet, ask_file, ask_target
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import put_text, text_width
from app.ui.widgets.plots.weights import WeightScale
from app.ui.widgets.surfaces import Room

if TYPE_CHECKING:
    from app.ui.screens.paint.presenter import PaintPresenter


_TITLES: Final[dict[NameWish, tuple[str, str]]] = {
    "save": (tr("Save as my style"), tr("Save")),
    "save-as": (tr("Save as a new style"), tr("Save")),
    "rename": (tr("Rename the style"), tr("Rename")),
}


_SHOWN: Final = (
    (Shown.WEIGHTS.value, tr("Weights")),
    (Shown.TARGET.value, tr("Target")),
    (Shown.HERE.value, tr("Here")),
)
_LEAST: Final = (496, 400)  # of the middle
_STYLE_FILES: Final = tr("Turnlight styles") + f" (*{EXPORT_ENDING})"


class _Link(Pressable):
    """Words that lead back."""

    def __init__(self, text: str, name: str, shortcut: str) -> None:
        super().__init__(name)
        self.set_tip(name, shortcut)
        self.setText(text)
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def sizeHint(self) -> QSize:
        """Give the size of the words."""
        t = theme()
        return QSize(text_width(t.font(14), self.text()), t.px(32))

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size."""
        return self.sizeHint()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint it in the current theme."""
        ink = t.c.text if self.hovered() or self.isDown() else t.c.dim
        put_text(painter, self.rect(), self.text(), t.font(14), ink)
        if self.hovered() or t.contrast:
            low = (self.height() + t.px(18)) // 2
            painter.fillRect(0, low, self.width(), t.px(1), ink)


class _Crumbs(QWidget):
    """Where one is: "Styles > My Rembrandt  not saved yet", and what the canvas shows."""

    back_asked = Signal()
    chosen = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(theme().px(40))
        link = _Link(tr("Styles"), tr("Back to styles"), "Esc")
        link.clicked.connect(self.back_asked)
        self._title = Text("", 16, 600, elide=True)
        self._status = Text("", 14, role="dim", elide=True)
        self._shown = Segmented(_SHOWN, tr("The canvas shows"))
        self._shown.chosen.connect(lambda key: self.chosen.emit(Shown(key)))
        where = (link, Icon("chevron-right", 16, "dim"), self._title, self._status)
        row(*where, ..., self._shown, into=self, gap=8)

    def show_state(self, state: PaintState) -> None:
        self._title.set_text(state.title)
        self._status.set_text(state.status)
        if self._shown.key != state.shown.value:
            self._shown.choose(state.shown.value)


class PaintScreen(QWidget):
    """The view of `app.ui.screens.paint.presenter.PaintPresenter`."""

    def __init__(self, presenter: PaintPresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self._compact = compact
        self._sheet: LineSheet | None = None
        self.setAccessibleName(tr("Paint"))
        self.tools: ToolColumn | ToolStrip = (
            ToolStrip(presenter) if compact else ToolColumn(presenter)
        )
        self.sliders = (
            self.tools.sliders
            if isinstance(self.tools, ToolColumn)
            else BrushSliders(presenter, across=True)
        )
        self._brush: Brush | None = None
        self.crumbs = _Crumbs()
        self.canvas = PaintCanvas()
        self.live = LiveColumn(compact, presenter)
        row(self.tools, (Room(self._middle(), *_LEAST), 1), self.live, into=self)
        self._connect()

    def _middle(self) -> QWidget:
        compact = self._compact
        middle = QWidget()
        side, foot, below = (16, 12, 8) if compact else (24, 24, 26)
        column(
            *(self.crumbs, 8, (self.canvas, 1), below, WeightScale()),
            *((8, self.sliders) if compact else ()),
            into=middle,
            margins=(side, 8, side, foot),
        )
        return middle

    def _connect(self) -> None:
        presenter, canvas = self._presenter, self.canvas
        self.crumbs.back_asked.connect(presenter.back)
        self.crumbs.chosen.connect(presenter.show)
        canvas.pressed.connect(presenter.press)
        canvas.drawn.connect(presenter.draw)
        canvas.lifted.connect(presenter.lift)
        canvas.dabbed.connect(presenter.dab)
        self.live.laid.connect(self._portrait_laid)

    # -- what the presenter calls --------------------------------------------------------------

    def show_state(self, state: PaintState) -> None:
        """Show it; see `PaintState`."""
        self.tools.show_state(state)
        if self._compact and state.brush != self._brush:
            self._brush = state.brush
            self.sliders.show_brush(state.brush)
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

    # -- helpers -------------------------------------------------------------------------------

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
