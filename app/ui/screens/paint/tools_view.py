"""The tools: what the brush does, how large and strong it is, what painting starts from.

And the zoom: how large the canvas is seen, which part of it, and the box in its corner.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QButtonGroup, QSizePolicy, QWidget

from app.core.painting.stroke import Brush, Tool
from app.core.text import tr
from app.ui.screens.paint.screen import PaintPresenter
from app.ui.screens.paint.state import LARGEST, SMALLEST, PaintState, head_words
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.widgets.accessibility import Roving
from app.ui.widgets.buttons import Button, Do, IconButton, Pressable, button_look, name_step
from app.ui.widgets.choices import LabelledSlider
from app.ui.widgets.fields import ListField, Toggle
from app.ui.widgets.labels import Text, draw_sign
from app.ui.widgets.layouts import column, row
from app.ui.widgets.lists import Entry, ListPopup
from app.ui.widgets.paint import MIDDLE, RIGHT, PaintedWidget, box, mix, put_text
from app.ui.widgets.surfaces import Divider, Scroll, Surface

_TOOLS: Final = (
    (Tool.BRIGHTER, tr("Brighter"), "B", tr("here the face should get more light")),
    (Tool.DARKER, tr("Darker"), "D", tr("here the face should get less light")),
    (Tool.IGNORE, tr("Ignore"), "I", tr("here it does not matter")),
    (Tool.RESTORE, tr("Restore"), "R", tr("back to what painting started from")),
)
"""Tool, its name, key and what it does."""

_SLIDERS: Final = (
    ("diameter", tr("Size"), SMALLEST, LARGEST, 64.0, 2.0, 1.0, "px"),
    ("strength", tr("Strength"), 5.0, 100.0, 30.0, 5.0, 100.0, "%"),
    ("softness", tr("Softness"), 0.0, 100.0, 70.0, 5.0, 100.0, "%"),
)
"""Field of the brush, name, least, most, first value, step, how many of its units make 1, unit."""

_START_WIDTH: Final = 280


class _ToolButton(Pressable):
    """One tool: sign, name and its key; in narrow windows the sign alone."""

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
    """The four tools: one stop for Tab, arrows choose."""

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
    """Size, strength and softness."""

    def __init__(self, presenter: PaintPresenter, across: bool) -> None:
        super().__init__()
        self._sliders: dict[str, tuple[LabelledSlider, float]] = {}
        for field, name, least, most, first, step, parts, unit in _SLIDERS:
            words = "{:.0f} " + unit
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
        """Show the brush's numbers."""
        for field, (slider, parts) in self._sliders.items():
            slider.set_value(parts * getattr(brush, field))


def _change(presenter: PaintPresenter, field: str, parts: float, value: float) -> None:
    presenter.tools.change(**{field: value / parts})


class _Common(Surface):
    """What both layouts of the tools have in common; `sliders` have no place yet."""

    _clear: Button | IconButton

    def __init__(
        self, presenter: PaintPresenter, compact: bool, mirror: Pressable, pressure: Pressable
    ) -> None:
        super().__init__("panel", ("right",), tr("Tools"))
        self._presenter = presenter
        self._tools = _Tools(presenter, compact)
        self._undo = IconButton("undo", tr("Undo"), shortcut="Ctrl Z", do=presenter.undo)
        self._redo = IconButton("redo", tr("Redo"), shortcut="Ctrl Shift Z", do=presenter.redo)
        self.sliders = BrushSliders(presenter, across=compact)
        self._switches = {"mirror": mirror, "pen_pressure": pressure}
        for field, switch in self._switches.items():
            switch.clicked.connect(lambda on, field=field: presenter.tools.change(**{field: on}))
        self._last: PaintState | None = None

    def show_state(self, state: PaintState) -> None:
        """Show brush, start and history, as far as they are others than before."""
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

    def show_starts(self, state: PaintState) -> None:
        """Show what can be started from, and what was."""
        raise NotImplementedError


class ToolColumn(_Common):
    """The tools with their words, 232 wide."""

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

    def show_starts(self, state: PaintState) -> None:
        """Show what can be started from, and what was."""
        self._start.set_items(state.starts)
        self._start.box.set_available(bool(state.starts), state.notice)
        if state.starts:
            self._start.choose(state.start)


class ToolStrip(_Common):
    """The tools as icons, 64 wide."""

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

    def show_starts(self, state: PaintState) -> None:
        """Show what can be started from, and what was."""
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


_SIDE: Final = 36
_WIDE: Final = 44
_LEAST_ZOOM: Final = 0.5
_MOST_ZOOM: Final = 8.0
"""Logical pixels per canvas pixel."""

_SHOWN_HEIGHT: Final = 0.95  # of the picture: crown to neck; the shoulders may be cut off
_SHOWN_WIDTH: Final = 0.75
_ABOVE: Final = 0.06  # of the height, over the crown


@dataclass(frozen=True, slots=True)
class Viewing:
    """A mapping from canvas to widget.

    Attributes:
        zoom: Logical pixels per canvas pixel.
        left, top: Where the canvas has its upper left corner, logical pixels of the widget.
    """

    zoom: float = 1.0
    left: float = 0.0
    top: float = 0.0

    def to_canvas(self, x: float, y: float) -> tuple[float, float]:
        """Canvas pixel under a point of the widget."""
        return (x - self.left) / self.zoom, (y - self.top) / self.zoom

    def to_widget(self, x: float, y: float) -> tuple[float, float]:
        """Point of the widget where a canvas pixel lies."""
        return self.left + x * self.zoom, self.top + y * self.zoom

    def moved(self, dx: float, dy: float) -> Viewing:
        """Return it shifted by logical pixels."""
        return replace(self, left=self.left + dx, top=self.top + dy)

    def zoomed(self, zoom: float, x: float, y: float) -> Viewing:
        """Return it at another zoom; what lies under a point of the widget stays there."""
        new_zoom = min(max(zoom, _LEAST_ZOOM), _MOST_ZOOM)
        at = self.to_canvas(x, y)
        return Viewing(new_zoom, x - at[0] * new_zoom, y - at[1] * new_zoom)

    def within(self, width: float, height: float, size: int) -> Viewing:
        """Return it shifted so that the middle of the widget lies on the canvas."""
        x, y = self.to_canvas(width / 2, height / 2)
        dx, dy = x - min(max(x, 0.0), size), y - min(max(y, 0.0), size)
        return self.moved(dx * self.zoom, dy * self.zoom)


def fitting(width: float, height: float, size: int) -> Viewing:
    """Show the head as large as it fits, in steps of 10 %.

    The widget's width and height are logical pixels, `size` is the side of the canvas.
    """
    room = min(height / (size * _SHOWN_HEIGHT), width / (size * _SHOWN_WIDTH))
    zoom = min(max(int(room * 10 + 1e-9) / 10, _LEAST_ZOOM), _MOST_ZOOM)
    return Viewing(zoom, (width - size * zoom) / 2, height * _ABOVE)


class _OnTag(Pressable):
    """A button on the dark plate, whatever the theme."""

    def __init__(self, name: str, shortcut: str, do: Do, icon: str = "") -> None:
        super().__init__(name, do=do)
        self.set_tip(name, shortcut)
        self._icon = icon
        self.preferred_size = (_SIDE if icon else _WIDE, _SIDE)
        self.setFixedSize(self.sizeHint())

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        if self.hovered() or self.isDown():
            fill = mix(t.c.tag, t.c.ontag, 0.24 if self.isDown() else 0.14)
            edge = px(2)
            box(painter, self.rect().adjusted(edge, edge, -edge, -edge), px(6), fill)
        if self._icon:
            draw_icon(painter, self._icon, self.rect(), px(20), t.c.ontag)
        else:
            put_text(painter, self.rect(), self.text(), t.font(12), t.c.ontag, MIDDLE)


class ZoomBox(PaintedWidget):
    """How large the canvas is shown, and from where the head is seen."""

    stepped = Signal(int)
    fitted = Signal()
    turned = Signal(int)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        step, turn = self.stepped.emit, self.turned.emit
        self._words = _OnTag(tr("Fit the head"), "0", lambda: self.fitted.emit())
        self._yaw = _OnTag(tr("See the head from the front"), "", lambda: turn(0))
        row(
            _OnTag(tr("Turn the head to its right"), ",", lambda: turn(-1), "chevron-left"),
            self._yaw,
            _OnTag(tr("Turn the head to its left"), ".", lambda: turn(1), "chevron-right"),
            8,
            _OnTag(tr("Zoom out"), "−", lambda: step(-1), "minus"),
            self._words,
            _OnTag(tr("Zoom in"), "+", lambda: step(1), "plus"),
            into=self,
        )
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.set_yaw(0.0)
        self.adjustSize()

    def set_yaw(self, yaw_deg: float) -> None:
        """Show how far the face is turned from the lens."""
        self._yaw.setText(f"{abs(yaw_deg):.0f}°")
        self._yaw.setAccessibleDescription(head_words(yaw_deg))
        self._yaw.update()

    def set_zoom(self, zoom: float) -> None:
        """Show how large the canvas is: logical pixels per canvas pixel."""
        words = f"{round(100 * zoom)} %"
        if words != self._words.text():
            self._words.setText(words)
            self._words.setAccessibleDescription(tr("Zoom {percent}", percent=words))
            self._words.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the plate."""
        box(painter, self.rect(), px(8), t.c.tag)
