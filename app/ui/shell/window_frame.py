"""The frame around every screen: the top bar, the rail and the line at the foot.

This module also accepts dropped files and keeps the window on its screen.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Final

from PySide6.QtCore import QMargins, QMimeData, QPoint, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QPainter, QPen, QWindow
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from app.core.text import tr
from app.ui.presenters.undo_stack import UndoStack
from app.ui.presenters.window_frame import WHAT_TO_DROP, FrameState
from app.ui.screens.registry import ScreenSpec
from app.ui.shell.jobs import JobLine
from app.ui.theme import Theme, px, theme
from app.ui.theme.icons import draw_icon, icon_pixmap
from app.ui.widgets.accessibility import Roving, describe
from app.ui.widgets.buttons import Button, Chip, Do, IconButton, Kind, Pressable, name_step
from app.ui.widgets.dialogs import path_of
from app.ui.widgets.displays import Bar
from app.ui.widgets.labels import KeyHint, Text
from app.ui.widgets.layouts import clear, column, row
from app.ui.widgets.paint import MIDDLE, PaintedWidget, box, faint, hover_fill, put_text, text_width
from app.ui.widgets.surfaces import Surface

PLACES: Final = "places"
SETTINGS: Final = "settings"

_STEP: Final = {False: (88, 80), True: (72, 64)}  # normal, and compact without a note
_BAR: Final = 4
_FOOT: Final = (
    (PLACES, tr("Places"), tr("Places you have measured"), PLACES),
    (SETTINGS, tr("Settings"), tr("Settings"), SETTINGS),
)


class _RailButton(Pressable):
    """A button on the rail, with an icon above its label.

    The button for the current screen also has a bar on its left.
    """

    def __init__(self, title: str, tip: str, icon: str, shortcut: str, compact: bool) -> None:
        super().__init__(title)
        self._icon = icon
        self._done = False
        self._note = ""
        self._margin = px(4 if compact else 8)
        self.setText(title)
        self.setCheckable(True)
        self._compact = compact
        self.setFixedSize(*map(px, _STEP[compact]))
        self.set_tip(tip, shortcut)

    def set_state(self, done: bool, note: str, words: str) -> None:
        """Set whether the step is marked as done, and show the choice that the user made there."""
        self._done, self._note = done, "" if self._compact else note
        self.setAccessibleName(tr("{step}, done", step=self.text()) if done else self.text())
        self.setAccessibleDescription(words)
        self.setToolTip(f"{self.property('tip')}\n{words}" if words else self.property("tip"))
        self.update()

    def nextCheckState(self) -> None:
        """Leave it to the window to change the state of the button."""

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the rectangle behind the icon and the label."""
        return self._box(), px(8)

    def _box(self) -> QRect:
        return self.rect().adjusted(self._margin, 0, -self._margin, 0)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        inverted = t.contrast and self.isChecked()
        if self.isChecked():
            box(painter, self._box(), px(8), t.c.text if inverted else t.c.raised)
            painter.fillRect(QRect(0, px(8), px(_BAR), self.height() - px(16)), t.c.sel)
        elif self.hovered():
            box(painter, self._box(), px(8), hover_fill(t))
        ink = t.c.panel if inverted else (t.c.text if self.isChecked() else t.c.dim)
        side = px(24)
        middle = self.rect().center().x()
        face = QRect(middle - side // 2, px(9 if self._note or self._compact else 17), side, side)
        draw_icon(painter, self._icon, face, side, ink)
        label = QRect(0, face.bottom() + px(6), self.width(), px(16))
        put_text(painter, label, self.text(), t.font(12, 500), ink, MIDDLE)
        if self._note:
            note = label.adjusted(self._margin, px(18), -self._margin, px(18))
            put_text(painter, note, self._note, t.font(12, 600), ink, MIDDLE)
        if self._done:
            small = px(14)
            mark = QRect(face.right() + px(3), face.top() - px(4), small, small)
            draw_icon(painter, "check", mark, small, t.c.panel if inverted else t.c.ok)


class Rail(Surface):
    """The steps, with buttons for places and settings at the foot.

    The rail is a single Tab stop, and the arrow keys move the focus within it.

    Attributes:
        choose: Called with the key of a screen, `PLACES` or `SETTINGS`.
    """

    def __init__(
        self, compact: bool, screens: Sequence[ScreenSpec], choose: Callable[[str], None]
    ) -> None:
        super().__init__("panel", ("right",), tr("Steps"))
        self.setFixedWidth(px(_STEP[compact][0]))
        self._buttons: dict[str, _RailButton] = {}
        lines = column(into=self, gap=8, margins=(0, 64 if compact else 72, 0, 8))
        steps = [(spec.key, spec.title, spec.tip, spec.icon) for spec in screens]
        for number, (key, title, tip, icon) in enumerate([*steps, *_FOOT], start=1):
            if key == PLACES:
                lines.addStretch(1)
            shortcut = f"Ctrl+{number}" if number <= len(steps) else ""
            button = _RailButton(title, tip, icon, shortcut, compact)
            button.clicked.connect(lambda _=False, key=key: choose(key))
            lines.addWidget(button)
            self._buttons[key] = button
        self._roving = Roving(self)
        self._roving.set_members(list(self._buttons.values()))

    def show_steps(
        self, current: str, done: Collection[str], notes: Mapping[str, tuple[str, str]]
    ) -> None:
        """Mark the current screen and the completed steps, and show the notes of the steps."""
        for key, button in self._buttons.items():
            button.setChecked(key == current)
            button.set_state(key in done, *notes.get(key, ("", "")))

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the rail."""
        super().paint_on(painter, t)
        size = px(40)
        spot = QRect((self.width() - t.line_width - size) // 2, px(12), size, size)
        draw_icon(painter, "logo", spot, size, t.c.text)


_MOST_HINTS = 4


class JobLineBar(Surface):
    """The bar that shows the progress of the visible job.

    Attributes:
        cancel: Called with the key of the running job.
    """

    def __init__(
        self, compact: bool, cancel: Callable[[str], None], show_messages: Callable[[], None]
    ) -> None:
        super().__init__("panel", ("top",))
        self._compact = compact
        self._key = ""
        self.setFixedHeight(px(32 if compact else 40))
        self._mark = QLabel()
        self._mark.setFixedSize(px(16), px(16))
        self._words = Text("", 12, elide=True)
        self._words.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self._bar = Bar()
        self._time_left = Text("", 12, role="dim")
        # The line is lower in the compact layout, where an outline would touch its border.
        kind: Kind = "quiet" if compact else "outlined"
        self._cancel = Button(tr("Cancel"), "", kind, "small", do=lambda: cancel(self._key))
        self._hints = QWidget()
        self._hint_row = row(into=self._hints, gap=16)
        self._bell = Button("", "bell", kind="quiet", size="small", do=show_messages)
        parts = (self._mark, self._words, self._bar, self._time_left, self._cancel)
        row(*parts, ..., self._hints, self._bell, into=self, gap=8, margins=(24, 0, 24, 0))
        self.show_unread(0)
        self.show_job(None)

    def show_job(self, job: JobLine | None, stopped_above: bool = False) -> None:
        """Show the running job, or the last message again if `job` is None."""
        running = job is not None
        for widget in (self._bar, self._time_left):
            widget.setVisible(running)
        self._cancel.setVisible(running and not stopped_above)
        self._mark.setVisible(not running and bool(self._words.text()))
        if job is not None:
            self._key = job.key
            self._words.set_text(job.message or job.title)
            self._time_left.set_text(f"{round(100 * job.fraction)}%")
            self._bar.set(job.fraction)
            self._bar.setAccessibleName(f"{job.title}: {round(100 * job.fraction)}%")
            self._cancel.setAccessibleName(tr("Cancel: {title}", title=job.title))

    def show_idle(self, words: str, icon: str = "check") -> None:
        """Show the most recent result."""
        t = theme()
        colour = {"check": t.c.ok, "error": t.c.err}.get(icon, t.c.dim)
        self._mark.setPixmap(icon_pixmap(icon, px(16), colour, self.devicePixelRatioF()))
        self._words.set_text(words)
        self.show_job(None)

    def show_unread(self, count: int) -> None:
        """Show the number of unread messages beside the bell."""
        self._bell.set_text(str(count) if count else "")
        name = tr("Messages, {count} unread", count=count) if count else tr("Messages")
        describe(self._bell, name, tip=name)

    def show_hints(self, hints: Sequence[tuple[str, str]]) -> None:
        """Show up to four shortcuts of the current screen."""
        clear(self._hint_row)
        for keys, words in hints[: _MOST_HINTS // (2 if self._compact else 1)]:
            self._hint_row.addWidget(KeyHint(keys, words))


_FRAME: Final = QMargins(4, 32, 4, 4)
"""Size of the title bar and borders on common desktops, used until their actual size is known."""


def fitted(rect: QRect, room: QRect) -> QRect:
    """Shrink a rectangle to the available area, given in the same pixels, and move it inside."""
    size = rect.size().boundedTo(room.size())
    left = min(max(rect.left(), room.left()), room.left() + room.width() - size.width())
    top = min(max(rect.top(), room.top()), room.top() + room.height() - size.height())
    return QRect(left, top, size.width(), size.height())


def room_for(window: QWidget) -> QRect:
    """Return the area available for a window's content on its screen.

    The area is in logical pixels and excludes the window's frame.
    """
    return window.screen().availableGeometry().marginsRemoved(_frame_of(window))


def fit_on_screen(window: QWidget, smallest: QSize) -> None:
    """Fit a window to its screen, making the window smaller than `smallest` only if necessary."""
    if window.isMaximized() or window.isFullScreen():
        return
    room = room_for(window)
    window.setMinimumSize(smallest.boundedTo(room.size()))
    rect = fitted(window.geometry(), room)
    if rect != window.geometry():
        window.setGeometry(rect)


def _frame_of(window: QWidget) -> QMargins:
    handle: QWindow | None = window.windowHandle()
    margins = QMargins() if handle is None else handle.frameMargins()
    return _FRAME if margins.isNull() else margins


_MOST_FILES: Final = 500


def dropped_paths(data: QMimeData) -> list[Path]:
    """Return the paths of those dropped files that are on this computer."""
    urls = data.urls()[:_MOST_FILES]
    return [path_of(url) for url in urls if url.isLocalFile()]


class DropVeil(PaintedWidget):
    """A veil that covers the window while files are dragged over it."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._words = WHAT_TO_DROP
        self.setAccessibleName(WHAT_TO_DROP)

    def set_words(self, words: str) -> None:
        """Set the text that describes which files can be dropped."""
        self._words = words or WHAT_TO_DROP
        self.setAccessibleName(self._words)
        self.update()

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the veil."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), faint(t.c.bg, 0.92))
        inset = px(24)
        box = QRectF(self.rect()).adjusted(inset, inset, -inset, -inset)
        pen = QPen(t.c.sel, px(2))
        pen.setStyle(Qt.PenStyle.DashLine)
        painter.setPen(pen)
        painter.drawRoundedRect(box, px(8), px(8))
        size = px(24)
        icon = icon_pixmap("folder", size, t.c.text, self.devicePixelRatioF())
        painter.drawPixmap(
            round(box.center().x() - size / 2), round(box.center().y() - px(36)), icon
        )
        painter.setPen(t.c.text)
        painter.setFont(t.font(20, 600))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, self._words)


class _PlaceButton(Pressable):
    """A button that opens the list of places and shows the place's name, its time and a chevron."""

    def __init__(self, do: Do) -> None:
        super().__init__(tr("Places you have measured"), do=do)
        self._place = ""
        self._time = ""
        self.set_tip(tr("Places you have measured"), "Ctrl+P")
        self.setFixedHeight(px(32))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_place(self, place: str, time: str) -> None:
        self._place, self._time = place, time
        self.setAccessibleName(
            tr("Place: {place}, {time}", place=place, time=time)
            if time
            else tr("Place: {place}", place=place)
        )
        self.update()

    def _parts(self) -> tuple[QRect, QRect, QRect]:
        """Return the rectangles of the name, the time and the chevron.

        A long name is shortened.
        """
        t = theme()
        high, gap, mark = self.height(), px(16), px(16)
        time = text_width(t.font(14), self._time)
        behind = (gap + time if self._time else 0) + px(8) + mark
        name = min(text_width(t.font(16, 600), self._place), max(self.width() - behind, 0))
        after = name + (gap + time if self._time else 0)
        return (
            QRect(0, 0, name, high),
            QRect(name + gap, 0, time, high),
            QRect(after + px(8), (high - mark) // 2, mark, mark),
        )

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the area of the text, excluding the empty space after it."""
        last = self._parts()[2]
        return QRect(0, 0, last.right() + 1, self.height()), px(6)

    def hitButton(self, pos: QPoint) -> bool:
        """Accept clicks on the text only."""
        return self.focus_shape()[0].contains(pos)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        name, time, mark = self._parts()
        put_text(painter, name, self._place, t.font(16, 600), t.c.text)
        put_text(painter, time, self._time, t.font(14), t.c.dim)
        draw_icon(painter, "chevron-down", mark, px(16), t.c.text if self.hovered() else t.c.dim)


class TopBar(Surface):
    """The top bar (see `Window.asked` for the overlays that it opens)."""

    def __init__(self, compact: bool, undo: UndoStack, ask: Callable[..., None]) -> None:
        super().__init__("panel", ("bottom",))
        self._ask = ask
        self._compact = compact
        self.setFixedHeight(px(48 if compact else 56))
        self._place = _PlaceButton(lambda: ask("places"))
        self._undo = IconButton("undo", tr("Undo"), kind="quiet", do=undo.undo)
        self._redo = IconButton("redo", tr("Redo"), kind="quiet", do=undo.redo)
        find = IconButton("search", tr("Find anything"), kind="quiet", shortcut="Ctrl+K")
        find.clicked.connect(lambda: ask("find"))
        self._sitter = Chip("person", "", menu=not compact, do=self._ask_sitter)
        self._camera = Chip("theta", "", do=lambda: ask("camera"))
        chips = (8, self._sitter, self._camera)
        parts = ((self._place, 1), self._undo, self._redo, find, *chips)
        row(*parts, into=self, gap=8, margins=(24, 0, 24, 0))

    def show_state(self, state: FrameState) -> None:
        """Show the place, the sitter, the camera and the undo steps."""
        self._place.show_place(state.place, state.time)
        self._sitter.set("person", "" if self._compact else state.sitter)
        self._sitter.setAccessibleName(tr("Sitter: {sitter}", sitter=state.sitter or tr("loading")))
        self._sitter.setToolTip(tr("Sitter: {sitter}", sitter=state.sitter))
        words = state.camera_short if self._compact else state.camera
        self._camera.set("theta", words, warning=state.camera_warning)
        self._camera.setAccessibleName(tr("Camera: {camera}", camera=state.camera))
        self._camera.setToolTip(tr("Camera: {camera}", camera=state.camera))
        name_step(self._undo, "undo", state.undo)
        name_step(self._redo, "redo", state.redo)

    def _ask_sitter(self) -> None:
        self._ask("sitter", self._sitter.mapToGlobal(QPoint(0, self._sitter.height())))
