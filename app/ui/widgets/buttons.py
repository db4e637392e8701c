"""Text buttons, icon buttons and chips, and the look that they share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from PySide6.QtCore import QEvent, QPoint, QRect, QRectF, QSize, Qt, Signal, SignalInstance
from PySide6.QtGui import QColor, QFont, QHelpEvent, QKeyEvent, QKeySequence, QPainter
from PySide6.QtWidgets import QAbstractButton, QSizePolicy

from app.core.base.visible_text import visible
from app.core.text import tr
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.theme.style import show_tip
from app.ui.widgets.accessibility import describe, set_available
from app.ui.widgets.displays import Beat, draw_ring
from app.ui.widgets.paint import Paints, box, hover_fill, mix, put_text, selected_edge, text_width

_CHIP_HEIGHT: Final = 32
_CHIP_PADDING: Final = 13
_CHIP_ICON: Final = 16
_GAP: Final = 8


Kind: TypeAlias = Literal["outlined", "primary", "quiet"]
"""Kinds of button. Outlined is the default, primary is amber, and quiet has no border."""

Size: TypeAlias = Literal["normal", "main", "small"]
"""Button sizes, whose heights are 40 pixels for normal, 48 for main and 32 for small."""

Do: TypeAlias = Callable[..., object] | Signal | SignalInstance | None
"""A callable that takes no arguments, or anything else that `connect` accepts."""

_HEIGHT: Final[dict[Size, int]] = {"normal": 40, "main": 48, "small": 32}
_FONT: Final[dict[Size, int]] = {"normal": 14, "main": 16, "small": 13}
_ICON: Final[dict[Size, int]] = {"normal": 20, "main": 20, "small": 16}
_PADDING: Final[dict[Size, int]] = {"normal": 16, "main": 16, "small": 13}

_ARROWS: Final = frozenset({Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down})


@dataclass(frozen=True, slots=True)
class Look:
    """The colours and the border width of a control in one state.

    A part whose colour is None is not painted.
    """

    fill: QColor | None
    edge: QColor | None
    ink: QColor
    width: int


class Pressable(Paints, QAbstractButton):
    """The base class of buttons, which call `do` when pressed.

    Subclasses paint the buttons.
    """

    selected = False
    """Whether this is the selected button in its group, regardless of whether it is pressed."""

    def __init__(self, name: str, tip: str | None = None, do: Do = None) -> None:
        super().__init__()
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        describe(self, name, tip=tip)
        if do is not None:
            self.clicked.connect(do)

    def setText(self, text: str) -> None:
        """Change the text. Any "&" appears literally and does not create a shortcut."""
        super().setText(visible(text))
        self.setShortcut(QKeySequence())

    def set_available(self, available: bool, why: str = "") -> None:
        """Enable the button, or disable it and state the reason in its tooltip."""
        set_available(self, available, why)

    def set_tip(self, tip: str, shortcut: str = "") -> None:
        """Change the tooltip, but keep the accessible name."""
        describe(self, self.accessibleName(), shortcut, tip)

    def set_selected(self, selected: bool) -> None:
        """Set whether this button is the selected one."""
        if selected != self.selected:
            self.selected = selected
            self.setAccessibleDescription(tr("selected") if selected else "")
            self.update()

    def hovered(self) -> bool:
        """Return whether the mouse is over the button while the button is enabled."""
        return self.underMouse() and self.isEnabled()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Press the button on Enter as well as on Space.

        The arrow keys are left to the button's group.
        """
        if event.key() in _ARROWS:
            # Otherwise, Qt would move the focus to a neighbour of its own choice.
            event.ignore()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            self.click()
        else:
            super().keyPressEvent(event)

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle and the corner radius of the focus ring."""
        return self.rect(), px(8)


def _primary_look(t: Theme, button: Pressable) -> Look:
    c = t.c
    fill = mix(c.amberfill, c.ontag, 0.22) if button.hovered() else c.amberfill
    edge = c.onamber if button.isDown() or t.contrast else None
    return Look(fill, edge, c.onamber, selected_edge(t) if button.isDown() else t.line_width)


def button_look(button: Pressable, kind: Kind = "outlined") -> Look:
    """Return the look of a button in its current state."""
    t = theme()
    c = t.c
    if not button.isEnabled():
        edge = None if kind == "quiet" else (c.dis if t.contrast else c.line)
        return Look(None, edge, c.dis, t.line_width)
    if kind == "primary":
        return _primary_look(t, button)
    if button.isChecked():
        if t.contrast:
            return Look(c.text, c.text, c.panel, t.line_width)
        return Look(c.raised, c.text, c.text, selected_edge(t))
    fill = hover_fill(t) if button.hovered() or button.isDown() else None
    if button.isDown():
        return Look(fill, c.ctl, c.text, selected_edge(t))
    return Look(fill, None if kind == "quiet" else c.ctl, c.text, t.line_width)


class Button(Pressable):
    """A button with text, and optionally with an icon before or after the text."""

    def __init__(
        self,
        text: str,
        icon: str = "",
        kind: Kind = "outlined",
        size: Size = "normal",
        trailing: str = "",
        checkable: bool = False,
        do: Do = None,
    ) -> None:
        super().__init__(text, tip="", do=do)
        self.kind: Kind = kind
        self._size: Size = size
        self._icon = icon
        self._trailing = trailing
        self._busy: str | None = None
        self._last_size = QSize()
        self._beat = Beat(self)
        self.setCheckable(checkable)
        self.setText(text)
        self.setFont(theme().font(_FONT[size], 600))
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def set_text(self, text: str, icon: str | None = None) -> None:
        """Change the text. The icon before it also changes unless `icon` is None."""
        if text != self.text() or icon not in (None, self._icon):
            self._icon = self._icon if icon is None else icon
            self.setText(text)
            self.setAccessibleName(text)
            self.updateGeometry()
            self.update()

    def set_busy(self, label: str | None) -> None:
        """Show a label such as "Saving…" with a spinner, and ignore presses.

        If the label is None, the button becomes usable again.
        """
        if label is not None and self._busy is None:
            self._last_size = self.size() if self.isVisible() else self.sizeHint()
        self._busy = label
        self.setAccessibleDescription(label or "")
        self._beat.run(label is not None)
        self.updateGeometry()
        self.update()

    @property
    def busy(self) -> bool:
        """Whether the button's action is in progress."""
        return self._busy is not None

    def hitButton(self, pos: QPoint) -> bool:
        """Ignore clicks while the button is busy."""
        return not self.busy and super().hitButton(pos)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Ignore Space and Enter while the button is busy."""
        if self.busy and event.key() in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter):
            return
        super().keyPressEvent(event)

    def sizeHint(self) -> QSize:
        """Return the size required by the icons and the text, at the button's height."""
        if self._busy is not None and not self._last_size.isEmpty():
            return self._last_size
        size = self._size
        width = text_width(self.font(), self.text()) + 2 * px(_PADDING[size])
        width += sum(px(_ICON[size] + 8) for each in (self._icon, self._trailing) if each)
        return QSize(width, px(_HEIGHT[size]))

    def minimumSizeHint(self) -> QSize:
        """Return the size of the full text, which is cut off only if the width is fixed."""
        return self.sizeHint()

    def room(self) -> int:
        """Return the width left for the text, in pixels."""
        icons = bool(self._icon or self.busy) + bool(self._trailing and not self.busy)
        return max(self.width() - 2 * px(8) - icons * px(_ICON[self._size] + 8), 0)

    def whole_tip(self) -> str:
        """Return the tooltip, which begins with the full text if the button cuts it off."""
        cut = text_width(self.font(), self.text()) > self.room()
        return f"{self.text()}\n{self.toolTip()}".rstrip() if cut else self.toolTip()

    def event(self, event: QEvent) -> bool:
        """Show the full tooltip."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            show_tip(event.globalPos(), self.whole_tip(), self)
            return True
        return super().event(event)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the button in the current theme."""
        look = button_look(self, self.kind)
        box(painter, self.rect(), px(8), look.fill, look.edge, look.width)
        label = self.text() if self._busy is None else self._busy
        self._paint_content(painter, label, look.ink, self.font())

    def _paint_content(self, painter: QPainter, label: str, ink: QColor, font: QFont) -> None:
        """Paint the icon, the text and the second icon as one centred group."""
        side, gap = px(_ICON[self._size]), px(8) if label else 0
        lead = side + gap if self._icon or self.busy else 0
        trail = side + gap if self._trailing and not self.busy else 0
        words = min(text_width(font, label), self.room())
        x = round((self.width() - lead - words - trail) / 2)
        spot = QRectF(x, 0, side, self.height())
        if self.busy:
            small = px(16)
            spot = QRectF(x + (side - small) / 2, (self.height() - small) / 2, small, small)
            draw_ring(painter, spot, ink, self._beat.phase_deg)
        elif self._icon:
            draw_icon(painter, self._icon, spot, side, ink)
        put_text(painter, QRect(x + lead, 0, words + 1, self.height()), label, font, ink)
        if trail:
            spot = QRectF(x + lead + words + gap, 0, side, self.height())
            draw_icon(painter, self._trailing, spot, px(16), ink)


class IconButton(Pressable):
    """A square button that contains only an icon, which its tooltip explains."""

    def __init__(
        self,
        icon: str,
        name: str,
        checkable: bool = False,
        kind: Kind = "outlined",
        size: Size = "normal",
        shortcut: str = "",
        do: Do = None,
    ) -> None:
        super().__init__(name, do=do)
        describe(self, name, shortcut)
        side = px(_HEIGHT[size])
        self._icon = icon
        self._kind: Kind = kind
        self._size: Size = size
        self.preferred_size = (_HEIGHT[size], _HEIGHT[size])
        self.setCheckable(checkable)
        self.setMinimumSize(side, side)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def set_icon(self, icon: str) -> None:
        """Change the icon."""
        if icon != self._icon:
            self._icon = icon
            self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the button in the current theme."""
        look = button_look(self, self._kind)
        box(painter, self.rect(), px(8), look.fill, look.edge, look.width)
        draw_icon(painter, self._icon, self.rect(), px(_ICON[self._size]), look.ink)


_STEPS: Final = {
    "undo": (tr("Undo"), tr("Undo {step}"), tr("There is nothing to undo."), "Ctrl+Z"),
    "redo": (tr("Redo"), tr("Redo {step}"), tr("There is nothing to redo."), "Ctrl+Shift+Z"),
}


def name_step(button: IconButton, verb: Literal["undo", "redo"], what: str) -> None:
    """Set the tooltip of an undo or redo button, such as "Undo delete My Rembrandt"."""
    bare, whole, nothing, shortcut = _STEPS[verb]
    button.set_tip(whole.format(step=what) if what else bare, shortcut)
    button.set_available(bool(what), nothing)


class Chip(Pressable):
    """A pressable chip that contains an icon and text."""

    def __init__(self, icon: str, text: str, menu: bool = False, do: Do = None) -> None:
        super().__init__(text, tip="", do=do)
        self._icon = icon
        self._warning = ""
        self._menu = menu
        self.setText(text)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def set(self, icon: str, text: str, warning: str = "") -> None:
        """Change the icon, the text and the warning that follows the text, if there is one."""
        if (icon, text, warning) == (self._icon, self.text(), self._warning):
            return
        self._icon, self._warning = icon, warning
        self.setText(text)
        self._tell()

    def _tell(self) -> None:
        words = f"{self.text()}. {self._warning}" if self._warning else self.text()
        describe(self, words, tip="")
        self.updateGeometry()
        self.update()

    def _pieces(self) -> list[tuple[str, str]]:
        """Return the icons and texts from left to right, as (icon or "", text or "") pairs."""
        pieces = [(self._icon, "")] if self._icon else []
        if self.text():
            pieces.append(("", self.text()))
        if self._warning:
            pieces += [("warning", ""), ("", self._warning)]
        if self._menu:
            pieces.append(("chevron-down", ""))
        return pieces

    def _width(self, words: str) -> int:
        return text_width(theme().font(13), words) if words else px(_CHIP_ICON)

    def sizeHint(self) -> QSize:
        """Return the size required by the icons and the text."""
        pieces = self._pieces()
        inner = sum(self._width(words) for _icon, words in pieces)
        inner += px(_GAP) * max(len(pieces) - 1, 0)
        height = px(_CHIP_HEIGHT)
        return QSize(max(inner + 2 * px(_CHIP_PADDING), height), height)

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size."""
        return self.sizeHint()

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle and the corner radius of the focus ring."""
        return self.rect(), self.height() // 2

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the chip in the current theme."""
        look = button_look(self)
        box(painter, self.rect(), self.height() / 2, look.fill, look.edge, look.width)
        x = float(px(_CHIP_PADDING))
        for name, words in self._pieces():
            width = self._width(words)
            area = QRectF(x, 0, width, self.height())
            if words:
                put_text(painter, area, words, t.font(13), look.ink)
            else:
                draw_icon(painter, name, area, px(_CHIP_ICON), look.ink)
            x += width + px(_GAP)
