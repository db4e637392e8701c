"""Toggles, and labelled fields with error messages for entering text or choosing from a list."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from PySide6.QtCore import QEvent, QObject, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QContextMenuEvent,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QLineEdit, QSizePolicy, QWidget

from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon
from app.ui.theme.style import dress_menu
from app.ui.widgets.accessibility import describe
from app.ui.widgets.buttons import Do, Pressable
from app.ui.widgets.labels import Icon, Text
from app.ui.widgets.layouts import add, column, row
from app.ui.widgets.lists import Entry, ListPopup
from app.ui.widgets.paint import box, hover_fill, put_text, selected_edge, text_width

_SWITCH: Final = (36, 20)
_KNOB: Final = 14
_ICON: Final = 20
_GAP: Final = 10


class Toggle(Pressable):
    """A row with a name at the left, and a switch of 36 x 20 pixels at the right."""

    switched = Signal(bool)

    def __init__(self, name: str, icon: str = "", do: Do = None) -> None:
        super().__init__(name, tip="", do=do)
        self._icon = icon
        self.setText(name)
        self.setCheckable(True)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self.clicked.connect(self.switched)

    def sizeHint(self) -> QSize:
        """Return the size required by the icon, the name and the switch."""
        t = theme()
        lead = px(_ICON + _GAP) if self._icon else 0
        width = lead + text_width(t.font(14), self.text()) + 2 * px(_GAP)
        return QSize(width + px(_SWITCH[0]), px(32))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size.

        At this size a long name is cut off, and the tooltip shows it in full.
        """
        hint = self.sizeHint()
        return QSize(min(hint.width(), px(160)), hint.height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show the full name in the tooltip if the name is shortened."""
        super().resizeEvent(event)
        if self.width() < self.sizeHint().width() and not self.toolTip():
            self.setToolTip(self.text())

    def _switch(self) -> QRect:
        width, height = px(_SWITCH[0]), px(_SWITCH[1])
        return QRect(self.width() - width, (self.height() - height) // 2, width, height)

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle of the switch and the corner radius of the focus ring."""
        switch = self._switch()
        return switch, switch.height() // 2

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the toggle in the current theme."""
        ink = t.c.text if self.isEnabled() else t.c.dis
        left = 0
        if self._icon:
            side = px(_ICON)
            draw_icon(painter, self._icon, QRect(0, 0, side, self.height()), side, ink)
            left = side + px(_GAP)
        room = self.width() - left - px(_SWITCH[0] + _GAP)
        put_text(painter, QRect(left, 0, room, self.height()), self.text(), t.font(14), ink)
        self._paint_switch(painter)

    def _paint_switch(self, painter: QPainter) -> None:
        t = theme()
        c, on = t.c, self.isEnabled()
        area = QRectF(self._switch())
        radius = area.height() / 2
        width = selected_edge(t) if self.isDown() else t.line_width
        gap = (area.height() - px(_KNOB)) / 2
        knob = QRectF(area.left() + gap, area.top() + gap, px(_KNOB), px(_KNOB))
        if self.isChecked():
            full = c.text if on else c.dis
            box(painter, area, radius, full, c.ctl if self.isDown() else full, width)
            knob.moveRight(area.right() - gap)
            ink = c.panel
        else:
            fill = hover_fill(t) if self.hovered() else None
            box(painter, area, radius, fill, c.ctl if on else c.dis, width)
            ink = c.ctl if on else c.dis
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink)
        painter.drawEllipse(knob)


_PADDING: Final = 12


class _LabelledField(QWidget):
    """A column that contains a label, a control and room for an error message."""

    def __init__(self, label: str) -> None:
        super().__init__()
        self._column = column(into=self, gap=4)
        self._label = Text(label, 12, 600, "dim", elide=True)
        if label:
            self._column.addWidget(self._label)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._error = IconLine(12, 4)

    def _hold(self, field: _LineInput | _Box) -> None:
        self._field = field
        self.setFocusProxy(field)
        add(self._column, field, self._error)

    def set_error(self, sentence: str) -> None:
        """Show an error below the field, or remove the error if `sentence` is empty."""
        self._error.say(sentence)
        self._field.wrong = bool(sentence)
        self._field.setAccessibleDescription(sentence)
        self._field.update()


def _draw_frame(painter: QPainter, field: _LineInput | _Box, pressed: bool = False) -> None:
    t, on = theme(), field.isEnabled()
    edge = t.c.err if field.wrong else t.c.ctl if on else t.c.line
    width = selected_edge(t) if field.wrong or pressed else t.line_width
    box(painter, field.rect(), px(8), t.c.raised if on else None, edge, width)


class _LineInput(QLineEdit):
    """A line edit that has the app's frame."""

    def __init__(self) -> None:
        super().__init__()
        t = theme()
        self.wrong = False
        self.icon = ""
        self.setFrame(False)
        self.setFont(t.font(14))
        self.setFixedHeight(px(40))
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        # The frame is painted below, and Qt paints nothing behind the text.
        colours = QPalette(self.palette())
        colours.setColor(QPalette.ColorRole.Base, Qt.GlobalColor.transparent)
        self.setPalette(colours)
        self.set_icon("")

    def set_icon(self, icon: str) -> None:
        self.icon = icon
        lead = px(_PADDING) + (px(28) if icon else 0)
        # QLineEdit reserves 2 px itself.
        self.setTextMargins(lead - 2, 0, px(_PADDING) - 2, 0)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Open the menu for copying and pasting, with the app's own look."""
        menu = self.createStandardContextMenu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dress_menu(menu)
        menu.popup(event.globalPos())

    def paintEvent(self, event: QPaintEvent) -> None:
        painter, c = QPainter(self), theme().c
        _draw_frame(painter, self)
        if self.icon:
            spot = QRect(px(_PADDING), 0, px(20), self.height())
            draw_icon(painter, self.icon, spot, px(20), c.dim if self.isEnabled() else c.dis)
        painter.end()
        super().paintEvent(event)


class TextField(_LabelledField):
    """A text field with a label."""

    changed = Signal(str)
    entered = Signal(str)

    def __init__(
        self, label: str, placeholder: str = "", icon: str = "", show_label: bool = True
    ) -> None:
        super().__init__(label if show_label else "")
        line = _LineInput()
        line.set_icon(icon)
        line.setPlaceholderText(placeholder)
        describe(line, label, tip="")
        line.textEdited.connect(self.changed)
        line.returnPressed.connect(lambda: self.entered.emit(line.text()))
        self.edit: QLineEdit = line
        self._hold(line)

    def text(self) -> str:
        """Return the text."""
        return self.edit.text()

    def set_text(self, text: str) -> None:
        """Change the text without emitting any signals."""
        if text != self.edit.text():
            self.edit.setText(text)


class IconLine(QWidget):
    """An icon beside a sentence. Both are hidden while the sentence is empty."""

    def __init__(self, size: int = 14, gap: int = 8) -> None:
        super().__init__()
        self._icon = Icon("error", 16)
        self._text = Text("", size, wrap=True)
        row((self._icon, 0, Qt.AlignmentFlag.AlignTop), (self._text, 1), into=self, gap=gap)
        self.hide()

    def say(self, sentence: str, icon: str = "error") -> None:
        """Show a sentence with an icon, in the error colour if the icon is "error"."""
        wrong = icon == "error"
        self._text.set_text(sentence)
        self._text.set_role("err" if wrong else "text")
        self._icon.set(icon or "info", "err" if wrong else "ok" if icon else "dim")
        self.setVisible(bool(sentence))

    def text(self) -> str:
        """Return the text."""
        return self._text.text()


class _Box(Pressable):
    """The part of a list field that is visible while its list is closed."""

    def __init__(self, name: str, icon: str) -> None:
        super().__init__(name, tip="")
        self._icon = icon
        self.entry = Entry("", "")
        self.two_lines = False
        self.wrong = False
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        t = theme()
        entry = self.entry
        words = max(text_width(t.font(14, 600), entry.text), text_width(t.font(12), entry.second))
        lead = px(36) if self._shown_icon() else 0
        return QSize(words + lead + px(2 * _PADDING + 28), px(56 if self.two_lines else 40))

    def minimumSizeHint(self) -> QSize:
        hint = self.sizeHint()
        return QSize(min(hint.width(), px(120)), hint.height())

    def _shown_icon(self) -> str:
        return self.entry.icon or self._icon

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        _draw_frame(painter, self, self.isDown() or self.hovered())
        ink = t.c.text if self.isEnabled() else t.c.dis
        area = self.rect().adjusted(px(_PADDING), 0, -px(_PADDING), 0)
        if icon := self._shown_icon():
            spot = QRect(area.left(), 0, px(24), self.height())
            draw_icon(painter, icon, spot, px(24), ink)
            area.setLeft(area.left() + px(34))
        spot = QRect(area.right() - px(16), 0, px(16), self.height())
        draw_icon(painter, "chevron-down", spot, px(16), ink)
        area.setRight(area.right() - px(24))
        self._paint_words(painter, QRectF(area))

    def _paint_words(self, painter: QPainter, area: QRectF) -> None:
        t = theme()
        on, entry = self.isEnabled(), self.entry
        ink = t.c.text if on else t.c.dis
        if not entry.second:
            put_text(painter, area, entry.text, t.font(14, 600), ink)
            return
        middle = area.center().y()
        first = QRectF(area.left(), middle - px(18), area.width(), px(20))
        below = QRectF(area.left(), middle + px(2), area.width(), px(16))
        put_text(painter, first, entry.text, t.font(14, 600), ink)
        put_text(painter, below, entry.second, t.font(12), t.c.dim if on else t.c.dis)


class ListField(_LabelledField):
    """A field that shows the current choice and opens a list.

    The arrow keys change the choice without opening the list, and Space, Enter and Alt+Down open
    the list. Each item is (key, text), optionally followed by a second line and an icon. If there
    is a second line, the field is 56 pixels high.
    """

    chosen = Signal(str)

    def __init__(
        self,
        label: str,
        items: Sequence[tuple[str, ...]] = (),
        icon: str = "",
        show_label: bool = True,
    ) -> None:
        super().__init__(label if show_label else "")
        self._name = label
        self._entries: list[Entry] = []
        self.box = _Box(label, icon)
        self.box.clicked.connect(self.open_list)
        self.box.installEventFilter(self)
        self._popup = ListPopup(self.box, label)
        self._popup.chosen.connect(self._picked)
        self._hold(self.box)
        self.set_items(items)

    @property
    def key(self) -> str:
        """Key of the current choice, or an empty string while the list is empty."""
        return self.box.entry.key

    def set_items(self, items: Sequence[tuple[str, ...]]) -> None:
        """Change the items, keeping the current choice if its key is among them."""
        entries = [Entry(*item) for item in items]
        if entries == self._entries:
            return
        self._entries = entries
        self.box.two_lines = any(entry.second for entry in entries)
        keys = [entry.key for entry in entries]
        self._show(entries[keys.index(self.key) if self.key in keys else 0] if keys else None)

    def choose(self, key: str) -> None:
        """Select an entry without emitting a signal.

        Raises:
            KeyError: If there is no such entry.
        """
        for entry in self._entries:
            if entry.key == key:
                self._show(entry)
                return
        raise KeyError(key)

    def open_list(self) -> None:
        """Open the list."""
        if self._entries:
            self._popup.drop(self.box, self._entries, self.key)

    def _show(self, entry: Entry | None) -> None:
        self.box.entry = new_entry = entry or Entry("", "")
        words = ", ".join(part for part in (new_entry.text, new_entry.second) if part)
        describe(self.box, f"{self._name}: {words}" if words else self._name, tip="")
        self.box.updateGeometry()
        self.box.update()

    def _picked(self, key: str) -> None:
        self.box.setFocus(Qt.FocusReason.PopupFocusReason)
        if key != self.key:
            self.choose(key)
            self.chosen.emit(key)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        """Handle the arrow keys and the wheel while the list is closed."""
        if isinstance(event, QWheelEvent):
            # Scrolling the column must not change a field that happens to be under the mouse.
            event.ignore()
            return True
        if not isinstance(event, QKeyEvent) or event.type() != QKeyEvent.Type.KeyPress:
            return False
        if event.key() == Qt.Key.Key_F4 or (
            event.key() == Qt.Key.Key_Down and event.modifiers() & Qt.KeyboardModifier.AltModifier
        ):
            self.open_list()
            return True
        step = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}.get(Qt.Key(event.key()))
        if step is None or not self._entries:
            return False
        here = [entry.key for entry in self._entries].index(self.key)
        there = min(max(here + step, 0), len(self._entries) - 1)
        self._picked(self._entries[there].key)
        return True
