"""The tools: what the brush does, how large and strong it is, what painting starts from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from app.core.painting.stroke import Tool
from app.ui.screens.paint.brush import LARGEST, SMALLEST
from app.ui.theme import theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton, Pressable, button_look, name_step
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text, draw_sign
from app.ui.widgets.lists import Entry, ListPopup
from app.ui.widgets.paint import RIGHT, box, put_text
from app.ui.widgets.surfaces import Divider, Scroll, Surface

if TYPE_CHECKING:
    from app.core.painting.stroke import Brush
    from app.ui.screens.paint.state import PaintState

_TOOLS: Final = (
    (Tool.BRIGHTER, "Brighter", "B"),
    (Tool.DARKER, "Darker", "D"),
    (Tool.IGNORE, "Ignore", "I"),
    (Tool.RESTORE, "Restore", "R"),
)
_TIPS: Final = {
    Tool.BRIGHTER: "Brighter: here the face should get more light",
    Tool.DARKER: "Darker: here the face should get less light",
    Tool.IGNORE: "Ignore: here it does not matter",
    Tool.RESTORE: "Restore: back to what painting started from",
}
_DEFAULTS: Final = (64.0, 30.0, 70.0)
_START_WIDTH: Final = 280


class _ToolButton(Pressable):
    """One tool: sign, name and its key; in narrow windows the sign alone."""

    def __init__(self, tool: Tool, name: str, key: str, compact: bool) -> None:
        super().__init__(name)
        self.set_tip(_TIPS[tool], key)
        self.tool = tool
        self._key = key
        self._compact = compact
        self.setCheckable(True)
        self.setText(name)
        across = QSizePolicy.Policy.Fixed if compact else QSizePolicy.Policy.Expanding
        self.setSizePolicy(across, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        """Give the size as designed."""
        t = theme()
        return QSize(t.px(40 if self._compact else 120), t.px(40))

    def minimumSizeHint(self) -> QSize:
        """Give the smallest useful size."""
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        t = theme()
        painter = QPainter(self)
        look = button_look(self, "quiet")
        box(painter, self.rect(), t.px(8), look.fill, look.edge, look.width)
        side = t.px(20)
        left = (self.width() - side) // 2 if self._compact else t.px(12)
        spot = QRectF(left, (self.height() - side) // 2, side, side)
        if self.tool in (Tool.BRIGHTER, Tool.DARKER):
            draw_sign(painter, spot, "plus" if self.tool is Tool.BRIGHTER else "minus")
        else:
            draw_icon(painter, self.tool.value, spot, side, look.ink)
        if self._compact:
            return
        area = QRectF(t.px(44), 0, self.width() - t.px(44 + 12), self.height())
        weight = 600 if self.isChecked() else 400
        put_text(painter, area, self.text(), t.font(14, weight), look.ink)
        dim = look.ink if t.contrast or not self.isEnabled() else t.c.dim
        put_text(painter, area, self._key, t.font(12), dim, RIGHT)


class _Tools(QWidget):
    """The four tools: one stop for Tab, arrows choose."""

    chosen = Signal(object)

    def __init__(self, compact: bool) -> None:
        super().__init__()
        self.setAccessibleName("Tool")
        self._group = QButtonGroup(self)
        self._buttons: dict[Tool, _ToolButton] = {}
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme().px(4) if compact else 0)
        for tool, name, key in _TOOLS:
            button = _ToolButton(tool, name, key, compact)
            button.clicked.connect(lambda _on=False, tool=tool: self.chosen.emit(tool))
            self._group.addButton(button)
            self._buttons[tool] = button
            column.addWidget(button)
        self._roving = Roving(self)
        self._roving.set_members(list(self._buttons.values()))
        self._roving.moved.connect(self._moved)

    def show_tool(self, tool: Tool) -> None:
        self._buttons[tool].setChecked(True)
        self._roving.set_stop(self._buttons[tool])

    def _moved(self, button: QWidget) -> None:
        if isinstance(button, _ToolButton):
            self.chosen.emit(button.tool)


class BrushSliders(QWidget):
    """Size, strength and softness.

    Attributes
    ----------
    size_changed, strength_changed, softness_changed : Signal(float)
        Canvas pixels, and shares from 0 to 1.
    """

    size_changed = Signal(float)
    strength_changed = Signal(float)
    softness_changed = Signal(float)

    def __init__(self, across: bool) -> None:
        super().__init__()
        size, strength, softness = _DEFAULTS
        self._size = LabelledSlider("Size", SMALLEST, LARGEST, size, 2, lambda v: f"{v:.0f} px")
        self._strength = LabelledSlider("Strength", 5, 100, strength, 5, _percent)
        self._softness = LabelledSlider("Softness", 0, 100, softness, 5, _percent)
        self._size.changed.connect(self.size_changed)
        self._strength.changed.connect(lambda value: self.strength_changed.emit(value / 100))
        self._softness.changed.connect(lambda value: self.softness_changed.emit(value / 100))
        self._size.setToolTip("Size ([ and ])")
        t = theme()
        row = QHBoxLayout(self) if across else QVBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(t.px(24 if across else 12))
        for slider in (self._size, self._strength, self._softness):
            row.addWidget(slider)

    def show_brush(self, brush: Brush) -> None:
        """Show the brush's numbers."""
        self._size.set_value(brush.diameter)
        self._strength.set_value(100 * brush.strength)
        self._softness.set_value(100 * brush.softness)


def _percent(value: float) -> str:
    return f"{value:.0f} %"


class _Common(Surface):
    """What both layouts of the tools have in common."""

    tool_chosen = Signal(object)
    mirror_switched = Signal(bool)
    pressure_switched = Signal(bool)
    start_chosen = Signal(str)
    undo_asked = Signal()
    redo_asked = Signal()
    clear_asked = Signal()

    def __init__(self, compact: bool) -> None:
        super().__init__("panel", ("right",))
        self.setAccessibleName("Tools")
        self._tools = _Tools(compact)
        self._tools.chosen.connect(self.tool_chosen)
        self._undo = IconButton("undo", "Undo", shortcut="Ctrl Z")
        self._redo = IconButton("redo", "Redo", shortcut="Ctrl Shift Z")
        self._undo.clicked.connect(self.undo_asked)
        self._redo.clicked.connect(self.redo_asked)
        self._last: PaintState | None = None

    def show_state(self, state: PaintState) -> None:
        """Show brush, start and history, as far as they are others than before."""
        last, self._last = self._last, state
        if last is None or state.brush != last.brush:
            self._tools.show_tool(state.brush.tool)
            self.show_brush(state.brush)
        if last is None or (state.starts, state.start) != (last.starts, last.start):
            self.show_starts(state)
        now = (state.undo, state.redo, state.can_clear)
        if last is None or now != (last.undo, last.redo, last.can_clear):
            name_step(self._undo, "Undo", state.undo, "Ctrl Z")
            name_step(self._redo, "Redo", state.redo, "Ctrl Shift Z")
            self.show_clear(state.can_clear)

    def show_brush(self, brush: Brush) -> None:
        """Show size, strength and the like."""
        raise NotImplementedError

    def show_starts(self, state: PaintState) -> None:
        """Show what can be started from, and what was."""
        raise NotImplementedError

    def show_clear(self, works: bool) -> None:
        """Show whether there are strokes to clear."""
        raise NotImplementedError


class ToolColumn(_Common):
    """The tools with their words, 232 wide."""

    def __init__(self) -> None:
        super().__init__(compact=False)
        t = theme()
        self.setFixedWidth(t.px(232))
        self.sliders = BrushSliders(across=False)
        self._mirror = Toggle("Mirror", "mirror")
        self._pressure = Toggle("Pen pressure", "pen")
        self._start = ListField("Start from")
        self._clear = Button("Clear strokes")
        self._mirror.switched.connect(self.mirror_switched)
        self._pressure.switched.connect(self.pressure_switched)
        self._start.chosen.connect(self.start_chosen)
        self._clear.clicked.connect(self.clear_asked)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, t.line_width, t.px(16))
        outer.setSpacing(t.px(8))
        outer.addWidget(Scroll(self._upper()), 1)
        outer.addLayout(self._foot())

    def _upper(self) -> QWidget:
        t = theme()
        upper = QWidget()
        upper.setProperty("focusHost", True)
        column = QVBoxLayout(upper)
        column.setContentsMargins(t.px(16), t.px(16), t.px(16) - t.line_width, 0)
        column.setSpacing(0)
        column.addWidget(Text("Tool", 12, 600, "dim"))
        column.addSpacing(t.px(6))
        column.addWidget(self._tools)
        column.addSpacing(t.px(16))
        column.addWidget(self.sliders)
        column.addSpacing(t.px(16))
        column.addWidget(Divider())
        column.addSpacing(t.px(12))
        column.addWidget(self._mirror)
        column.addWidget(self._pressure)
        column.addSpacing(t.px(12))
        column.addWidget(Divider())
        column.addSpacing(t.px(12))
        column.addWidget(self._start)
        column.addStretch(1)
        return upper

    def _foot(self) -> QVBoxLayout:
        t = theme()
        pair = QHBoxLayout()
        pair.setSpacing(t.px(8))
        for button in (self._undo, self._redo):
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            pair.addWidget(button)
        foot = QVBoxLayout()
        foot.setContentsMargins(t.px(16), 0, t.px(16) - t.line_width, 0)
        foot.setSpacing(t.px(8))
        foot.addLayout(pair)
        foot.addWidget(self._clear)
        return foot

    def show_brush(self, brush: Brush) -> None:
        """Show size, strength and the like."""
        self.sliders.show_brush(brush)
        self._mirror.set_on(brush.mirror)
        self._pressure.set_on(brush.pen_pressure)

    def show_starts(self, state: PaintState) -> None:
        """Show what can be started from, and what was."""
        self._start.set_items(state.starts)
        self._start.box.set_available(bool(state.starts), state.notice)
        if state.starts:
            self._start.choose(state.start)

    def show_clear(self, works: bool) -> None:
        """Show whether there are strokes to clear."""
        self._clear.set_available(works, "Nothing painted yet")


class ToolStrip(_Common):
    """The tools as icons, 64 wide."""

    def __init__(self) -> None:
        super().__init__(compact=True)
        t = theme()
        self.setFixedWidth(t.px(64))
        self._mirror = IconButton("mirror", "Mirror", checkable=True, kind="quiet", shortcut="M")
        self._pressure = IconButton(
            "pen", "Pen pressure", checkable=True, kind="quiet", shortcut="P"
        )
        self._start = IconButton("person", "Start from", kind="quiet")
        self._clear = IconButton("trash", "Clear strokes", kind="quiet")
        self._popup = ListPopup(self._start, "Start from")
        self._entries: list[Entry] = []
        self._chosen = ""
        self._mirror.clicked.connect(self.mirror_switched)
        self._pressure.clicked.connect(self.pressure_switched)
        self._start.clicked.connect(self._open_starts)
        self._popup.chosen.connect(self._start_picked)
        self._clear.clicked.connect(self.clear_asked)
        inner = QWidget()
        column = QVBoxLayout(inner)
        column.setContentsMargins(0, t.px(8), 0, t.px(8))
        column.setSpacing(t.px(4))
        middle = Qt.AlignmentFlag.AlignHCenter
        column.addWidget(self._tools, 0, middle)
        for group in ((self._mirror, self._pressure), (self._start,)):
            column.addSpacing(t.px(4))
            column.addWidget(Divider())
            column.addSpacing(t.px(4))
            for button in group:
                column.addWidget(button, 0, middle)
        column.addStretch(1)
        for button in (self._undo, self._redo, self._clear):
            column.addWidget(button, 0, middle)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, t.line_width, 0)
        outer.addWidget(Scroll(inner))

    def show_brush(self, brush: Brush) -> None:
        """Show mirror and pen pressure."""
        self._mirror.setChecked(brush.mirror)
        self._pressure.setChecked(brush.pen_pressure)

    def show_starts(self, state: PaintState) -> None:
        """Show what can be started from, and what was."""
        self._entries = [Entry(*entry) for entry in state.starts]
        self._chosen = state.start
        words = next((entry.text for entry in self._entries if entry.key == state.start), "")
        self._start.set_tip(f"Start from: {words}" if words else "Start from")
        self._start.set_available(bool(state.starts), state.notice)

    def show_clear(self, works: bool) -> None:
        """Show whether there are strokes to clear."""
        self._clear.set_available(works, "Nothing painted yet")

    def _open_starts(self) -> None:
        self._popup.drop(self._start, self._entries, self._chosen, theme().px(_START_WIDTH))

    def _start_picked(self, key: str) -> None:
        if key != self._chosen:
            self.start_chosen.emit(key)
