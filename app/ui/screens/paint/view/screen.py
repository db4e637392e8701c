"""The Paint screen: tools at the left, canvas in the middle, the live answer at the right."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QApplication, QHBoxLayout, QVBoxLayout, QWidget

from app.core.painting.library import EXPORT_ENDING
from app.ui.screens.paint.state import Shown
from app.ui.screens.paint.view.canvas import PaintCanvas
from app.ui.screens.paint.view.live import LiveColumn
from app.ui.screens.paint.view.tools import BrushSliders, ToolColumn, ToolStrip
from app.ui.theme import theme
from app.ui.widgets.buttons import Button, Pressable
from app.ui.widgets.choices import Segmented
from app.ui.widgets.dialogs import Sheet, ask_file, ask_target
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.paint import put_text, text_width
from app.ui.widgets.plots.weights import WeightScale
from app.ui.widgets.surfaces import Room

if TYPE_CHECKING:
    from PySide6.QtGui import QShowEvent

    from app.core.painting.canvas import Canvas, Region
    from app.core.painting.stroke import Brush
    from app.ui.screens.paint.presenter import PaintPresenter
    from app.ui.screens.paint.state import FileWish, NameWish, PaintState


_TITLES: Final[dict[NameWish, tuple[str, str]]] = {
    "save": ("Save as my style", "Save"),
    "save-as": ("Save as a new style", "Save"),
    "rename": ("Rename the style", "Rename"),
}


class NameSheet(Sheet):
    """A line for the name, and a button that takes it.

    Attributes
    ----------
    named : Signal(str, str)
        What the name was asked for, and the name.
    """

    named = Signal(str, str)

    def __init__(self, host: QWidget) -> None:
        super().__init__(host, "Save as my style", 440)
        self._wish: NameWish = "save"
        self._field = TextField("Name", "My Rembrandt")
        self._take = Button("Save", kind="primary")
        cancel = Button("Cancel")
        self.body.addWidget(self._field)
        self.add_button(cancel)
        self.add_button(self._take)
        cancel.clicked.connect(self.shut)
        self._field.entered.connect(lambda _text: self._answer())
        self._field.changed.connect(lambda _text: self._field.set_error(""))
        self._take.clicked.connect(self._answer)

    def ask(self, wish: NameWish, title: str) -> None:
        """Open it."""
        self._wish = wish
        words, button = _TITLES[wish]
        self.set_title(words)
        self._take.set_text(button)
        self._take.set_busy(None)
        self._field.set_error("")
        self._field.set_text(title)
        self._field.edit.selectAll()
        self.open(self._field.edit)

    def say(self, sentence: str) -> None:
        """Say why the name cannot be taken; nothing to say closes the sheet."""
        self._field.set_error(sentence)
        if not sentence:
            self.shut()

    def show_busy(self, saving: bool) -> None:
        """Show that the style is being written."""
        if saving != self._take.busy:
            self._take.set_busy("Saving…" if saving else None)

    def _answer(self) -> None:
        if not self._take.busy:
            self.named.emit(self._wish, self._field.text())

    def event(self, event: QEvent) -> bool:
        """Keep all keys here: none is a shortcut of the screen behind it."""
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)


_SHOWN: Final = (
    (Shown.WEIGHTS.value, "Weights"),
    (Shown.TARGET.value, "Target"),
    (Shown.HERE.value, "Here"),
)
_LEAST: Final = (496, 400)  # of the middle
_STYLE_FILES: Final = f"Turnlight styles (*{EXPORT_ENDING})"


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

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
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
        t = theme()
        self.setFixedHeight(t.px(40))
        link = _Link("Styles", "Back to styles", "Esc")
        link.clicked.connect(self.back_asked)
        self._title = Text("", 16, 600, elide=True)
        self._status = Text("", 14, role="dim", elide=True)
        self._shown = Segmented(_SHOWN, "The canvas shows")
        self._shown.chosen.connect(lambda key: self.chosen.emit(Shown(key)))
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(t.px(8))
        for widget in (link, Icon("chevron-right", 16, "dim"), self._title, self._status):
            row.addWidget(widget)
        row.addStretch(1)
        row.addWidget(self._shown)

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
        self._sheet: NameSheet | None = None
        self.setAccessibleName("Paint")
        self.tools: ToolColumn | ToolStrip = ToolStrip() if compact else ToolColumn()
        self.sliders = (
            self.tools.sliders if isinstance(self.tools, ToolColumn) else BrushSliders(across=True)
        )
        self._brush: Brush | None = None
        self.crumbs = _Crumbs()
        self.canvas = PaintCanvas()
        self.live = LiveColumn(compact, presenter.files.actions)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(self.tools)
        row.addWidget(Room(self._middle(), *_LEAST), 1)
        row.addWidget(self.live)
        self._connect()

    def _middle(self) -> QWidget:
        t = theme()
        middle = QWidget()
        side = t.px(16 if self._compact else 24)
        column = QVBoxLayout(middle)
        column.setContentsMargins(side, t.px(8), side, t.px(12 if self._compact else 24))
        column.setSpacing(0)
        column.addWidget(self.crumbs)
        column.addSpacing(t.px(8))
        column.addWidget(self.canvas, 1)
        column.addSpacing(t.px(8 if self._compact else 26))
        column.addWidget(WeightScale())
        if self._compact:
            column.addSpacing(t.px(8))
            column.addWidget(self.sliders)
        return middle

    def _connect(self) -> None:
        presenter, tools, canvas = self._presenter, self.tools, self.canvas
        box = presenter.tools
        tools.tool_chosen.connect(box.choose_tool)
        tools.mirror_switched.connect(box.set_mirror)
        tools.pressure_switched.connect(box.set_pen_pressure)
        tools.start_chosen.connect(presenter.choose_start)
        tools.undo_asked.connect(presenter.undo)
        tools.redo_asked.connect(presenter.redo)
        tools.clear_asked.connect(presenter.clear)
        self.sliders.size_changed.connect(box.set_size)
        self.sliders.strength_changed.connect(box.set_strength)
        self.sliders.softness_changed.connect(box.set_softness)
        self.crumbs.back_asked.connect(presenter.back)
        self.crumbs.chosen.connect(presenter.show)
        canvas.pressed.connect(presenter.press)
        canvas.drawn.connect(presenter.draw)
        canvas.lifted.connect(presenter.lift)
        canvas.dabbed.connect(presenter.dab)
        self.live.save_asked.connect(presenter.files.ask_save)
        self.live.probe_asked.connect(presenter.measure)
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
            sheet = NameSheet(self.window())
            sheet.named.connect(self._presenter.files.named)
            sheet.closed.connect(self._sheet_closed)
            # It lies over the window, not in this screen, and would outlive it.
            self.destroyed.connect(sheet.deleteLater)
            self._sheet = sheet
            sheet.ask(wish, title)

    def show_trouble(self, sentence: str) -> None:
        """Say beside the name why it cannot be taken; empty: it was."""
        if self._sheet is not None:
            self._sheet.say(sentence)

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file and hand it to the presenter."""
        files = self._presenter.files
        if what == "export":
            path = ask_target(self, "Export style", suggested, _STYLE_FILES)
        else:
            path = ask_file(self, "Import style", _STYLE_FILES)
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
