"""The tool column: the tools, the brush's size and strength, the starting point and undo."""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QButtonGroup, QSizePolicy, QWidget

from app.core.painting.stroke import Brush, Tool
from app.core.text import tr
from app.ui.screens.paint.screen import PaintPresenter
from app.ui.screens.paint.tools import LARGEST, SMALLEST, ToolsState
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, IconButton, Pressable, button_look, name_step
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text, draw_sign
from app.ui.widgets.layouts import column, row
from app.ui.widgets.lists import Entry, ListPopup
from app.ui.widgets.paint import RIGHT, box, put_text
from app.ui.widgets.surfaces import Divider, Scroll, Surface

_TOOLS: Final = (
    (Tool.BRIGHTER, tr("Brighter"), "B", tr("more light on this part of the face")),
    (Tool.DARKER, tr("Darker"), "D", tr("less light on this part of the face")),
    (Tool.IGNORE, tr("Ignore"), "I", tr("light on this part does not matter")),
    (Tool.RESTORE, tr("Restore"), "R", tr("back to the starting point")),
)
"""Each tool, with its name, its key and its effect."""

_SLIDERS: Final = (
    ("diameter", tr("Size"), SMALLEST, LARGEST, 64.0, 2.0, 1.0, " px"),
    ("strength", tr("Strength"), 5.0, 100.0, 30.0, 5.0, 100.0, "%"),
    ("softness", tr("Softness"), 0.0, 100.0, 70.0, 5.0, 100.0, "%"),
)
"""For each slider, the brush's field, the name, the minimum, the maximum, the initial value, the
step, the number of displayed units per 1 of the field, and the unit.
"""

_START_WIDTH: Final = 280


class _ToolButton(Pressable):
    """A tool with its sign, its name and its key, or with only the sign in narrow windows."""

    def __init__(self, tool: Tool, name: str, key: str, does: str, compact: bool) -> None:
        super().__init__(name)
        self.set_tip(f"{name}: {does}", key)
        self.tool = tool
        self._key = key
        self._compact = compact
        self.preferred_size = self.least = (40 if compact else 120, 40)
        self.setCheckable(True)
        self.setText(name)
        across = QSizePolicy.Policy.Fixed if compact else QSizePolicy.Policy.Expanding
        self.setSizePolicy(across, QSizePolicy.Policy.Fixed)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        look = button_look(self, "quiet")
        box(painter, self.rect(), px(8), look.fill, look.edge, look.width)
        side = px(20)
        left = (self.width() - side) // 2 if self._compact else px(12)
        spot = QRectF(left, (self.height() - side) // 2, side, side)
        if self.tool in (Tool.BRIGHTER, Tool.DARKER):
            draw_sign(painter, spot, "plus" if self.tool is Tool.BRIGHTER else "minus")
        else:
            draw_icon(painter, self.tool.value, spot, side, look.ink)
        if self._compact:
            return
        area = QRectF(px(44), 0, self.width() - px(44 + 12), self.height())
        weight = 600 if self.isChecked() else 400
        put_text(painter, area, self.text(), t.font(14, weight), look.ink)
        dim = look.ink if t.contrast or not self.isEnabled() else t.c.dim
        put_text(painter, area, self._key, t.font(12), dim, RIGHT)


class _Tools(QWidget):
    """The four tools. They form a single Tab stop, with arrow keys to move between them."""

    def __init__(self, presenter: PaintPresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self.setAccessibleName(tr("Tool"))
        self._group = QButtonGroup(self)
        self._buttons: dict[Tool, _ToolButton] = {}
        for tool, name, key, does in _TOOLS:
            button = self._buttons[tool] = _ToolButton(tool, name, key, does, compact)
            button.clicked.connect(lambda _on=False, tool=tool: self._choose(tool))
            self._group.addButton(button)
        column(*self._buttons.values(), into=self, gap=4 if compact else 0)
        self._roving = Roving(self)
        self._roving.set_members(list(self._buttons.values()))
        self._roving.moved.connect(self._on_move)

    def show_tool(self, tool: Tool) -> None:
        self._buttons[tool].setChecked(True)
        self._roving.set_stop(self._buttons[tool])

    def _choose(self, tool: Tool) -> None:
        self._presenter.tools.change(tool=tool)

    def _on_move(self, button: QWidget) -> None:
        if isinstance(button, _ToolButton):
            self._choose(button.tool)


class BrushSliders(QWidget):
    """The sliders for size, strength and softness."""

    def __init__(self, presenter: PaintPresenter, across: bool) -> None:
        super().__init__()
        self._sliders: dict[str, tuple[LabelledSlider, float]] = {}
        for field, name, least, most, first, step, parts, unit in _SLIDERS:
            words = "{:.0f}" + unit
            slider = LabelledSlider(name, least, most, first, step, words.format)
            slider.changed.connect(partial(_change, presenter, field, parts))
            self._sliders[field] = (slider, parts)
        self._sliders["diameter"][0].setToolTip(tr("Size ([ and ])"))
        sliders = [slider for slider, _ in self._sliders.values()]
        if across:
            row(*sliders, into=self, gap=24)
        else:
            column(*sliders, into=self, gap=12)

    def show_brush(self, brush: Brush) -> None:
        """Show the values of the brush."""
        for field, (slider, parts) in self._sliders.items():
            slider.set_value(parts * getattr(brush, field))


def _change(presenter: PaintPresenter, field: str, parts: float, value: float) -> None:
    presenter.tools.change(**{field: value / parts})


class _Common(Surface):
    """The base class of both layouts of the tools. Each layout places `sliders` itself."""

    _clear: Button | IconButton

    def __init__(
        self, presenter: PaintPresenter, compact: bool, mirror: Pressable, pressure: Pressable
    ) -> None:
        super().__init__("panel", ("right",), tr("Tools"))
        self._presenter = presenter
        self._tools = _Tools(presenter, compact)
        self._undo = IconButton("undo", tr("Undo"), shortcut="Ctrl+Z", do=presenter.undo)
        self._redo = IconButton("redo", tr("Redo"), shortcut="Ctrl+Shift+Z", do=presenter.redo)
        self.sliders = BrushSliders(presenter, across=compact)
        self._switches = {"mirror": mirror, "pen_pressure": pressure}
        for field, switch in self._switches.items():
            switch.clicked.connect(lambda on, field=field: presenter.tools.change(**{field: on}))
        self._last: ToolsState | None = None

    def show_state(self, state: ToolsState) -> None:
        """Show any changes to the brush, the starting points and the history."""
        last, self._last = self._last, state
        if last is None or state.brush != last.brush:
            self._tools.show_tool(state.brush.tool)
            self.sliders.show_brush(state.brush)
            for field, switch in self._switches.items():
                switch.setChecked(getattr(state.brush, field))
        if last is None or (state.starts, state.start) != (last.starts, last.start):
            self.show_starts(state)
        now = (state.undo, state.redo, state.can_clear)
        if last is None or now != (last.undo, last.redo, last.can_clear):
            name_step(self._undo, "undo", state.undo)
            name_step(self._redo, "redo", state.redo)
            self._clear.set_available(state.can_clear, tr("Nothing painted yet"))

    def show_starts(self, state: ToolsState) -> None:
        """Show the starting points and the current one."""
        raise NotImplementedError


class ToolColumn(_Common):
    """The tools with labels, in a column 232 pixels wide."""

    def __init__(self, presenter: PaintPresenter) -> None:
        mirror, pressure = Toggle(tr("Mirror"), "mirror"), Toggle(tr("Pen pressure"), "pen")
        super().__init__(presenter, False, mirror, pressure)
        t = theme()
        self.setFixedWidth(px(232))
        self._start = ListField(tr("Start from"))
        self._clear = Button(tr("Clear strokes"), do=presenter.clear)
        self._start.chosen.connect(presenter.choose_start)
        for button in (self._undo, self._redo):
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        upper = QWidget()
        upper.setProperty("focusHost", True)
        tools = (Text(tr("Tool"), 12, 600, "dim"), 6, self._tools, 16, self.sliders, 16)
        toggles = (Divider(), 12, mirror, pressure, 12, Divider(), 12)
        inner = column(*tools, *toggles, self._start, ..., into=upper)
        foot = column(row(self._undo, self._redo, gap=8), self._clear, gap=8)
        side, edge = px(16), px(16) - t.line_width
        inner.setContentsMargins(side, side, edge, 0)
        foot.setContentsMargins(side, 0, edge, 0)
        outer = column((Scroll(upper), 1), foot, into=self, gap=8)
        outer.setContentsMargins(0, 0, t.line_width, side)

    def show_starts(self, state: ToolsState) -> None:
        """Show the starting points and the current one."""
        self._start.set_items(state.starts)
        self._start.box.set_available(bool(state.starts), state.notice)
        if state.starts:
            self._start.choose(state.start)


class ToolStrip(_Common):
    """The tools as icons, in a column 64 pixels wide."""

    def __init__(self, presenter: PaintPresenter) -> None:
        mirror = IconButton("mirror", tr("Mirror"), True, "quiet", shortcut="M")
        pressure = IconButton("pen", tr("Pen pressure"), True, "quiet", shortcut="P")
        super().__init__(presenter, True, mirror, pressure)
        t = theme()
        self.setFixedWidth(px(64))
        self._start = IconButton("person", tr("Start from"), kind="quiet", do=self._open_starts)
        self._clear = IconButton("trash", tr("Clear strokes"), kind="quiet", do=presenter.clear)
        self._popup = ListPopup(self._start, tr("Start from"))
        self._entries: list[Entry] = []
        self._last_start = ""
        self._popup.chosen.connect(self._start_picked)
        middle = Qt.AlignmentFlag.AlignHCenter
        inner = QWidget()
        column(
            (self._tools, 0, middle),
            *(4, Divider(), 4, (mirror, 0, middle), (pressure, 0, middle)),
            *(4, Divider(), 4, (self._start, 0, middle)),
            ...,
            *((button, 0, middle) for button in (self._undo, self._redo, self._clear)),
            into=inner,
            gap=4,
            margins=(0, 8, 0, 8),
        )
        column(Scroll(inner), into=self, gap=None).setContentsMargins(0, 0, t.line_width, 0)

    def show_starts(self, state: ToolsState) -> None:
        """Show the starting points and the current one."""
        self._entries = [Entry(*entry) for entry in state.starts]
        self._last_start = state.start
        words = next((entry.text for entry in self._entries if entry.key == state.start), "")
        self._start.set_tip(tr("Start from: {words}", words=words) if words else tr("Start from"))
        self._start.set_available(bool(state.starts), state.notice)

    def _open_starts(self) -> None:
        self._popup.drop(self._start, self._entries, self._last_start, px(_START_WIDTH))

    def _start_picked(self, key: str) -> None:
        if key != self._last_start:
            self._presenter.choose_start(key)
