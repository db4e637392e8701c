"""Sheets that open over the window for brief tasks, and the system's file dialogs."""

from __future__ import annotations

import os
import weakref
from pathlib import Path
from typing import ClassVar, Final, Literal, TypeAlias

import shiboken6
from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QSize, QStandardPaths, Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QFont, QHideEvent, QKeyEvent, QMouseEvent, QPainter
from PySide6.QtWidgets import QApplication, QFileDialog, QSizePolicy, QWidget

from app.core.base.native import path_from_library, path_in_url, url_of
from app.core.text import tr
from app.ui.theme import Theme, px, theme
from app.ui.widgets.accessibility import describe
from app.ui.widgets.buttons import Button, IconButton, Pressable
from app.ui.widgets.fields import TextField
from app.ui.widgets.labels import Role, Text
from app.ui.widgets.layouts import column, row
from app.ui.widgets.paint import PaintedWidget, faint, pen, put_text, text_width
from app.ui.widgets.surfaces import OutlineBox
from app.words.explanations import EXPLANATIONS

# A dialog belongs to the window, because a screen that is rebuilt while its dialog is open would
# destroy the dialog inside the dialog's own event loop.


def ask_files(asker: QWidget, title: str, filters: str) -> list[Path]:
    """Ask the user for existing files, and return an empty list if the user cancels."""
    names, _ = QFileDialog.getOpenFileNames(asker.window(), title, "", filters)
    return [path_from_library(name) for name in names]


def ask_file(asker: QWidget, title: str, filters: str) -> Path | None:
    """Ask the user for an existing file, and return None if the user cancels."""
    name, _ = QFileDialog.getOpenFileName(asker.window(), title, "", filters)
    return path_from_library(name) if name else None


def ask_folder(asker: QWidget, title: str, start: str = "") -> Path | None:
    """Ask the user for an existing folder, and return None if the user cancels."""
    name = QFileDialog.getExistingDirectory(asker.window(), title, start)
    return path_from_library(name) if name else None


def ask_target(asker: QWidget, title: str, suggested: str, filters: str) -> Path | None:
    """Ask the user for a new file or a file to overwrite, or return None if the user cancels.

    The dialog starts in the user's pictures folder.
    """
    pictures = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.PicturesLocation)
    start = str(Path(pictures) / suggested) if Path(pictures).is_dir() else suggested
    name, _ = QFileDialog.getSaveFileName(asker.window(), title, start, filters)
    return path_from_library(name) if name else None


def show_folder(folder: Path) -> None:
    """Show a folder in the system's file manager."""
    QDesktopServices.openUrl(QUrl.fromEncoded(url_of(folder)))


def path_of(url: QUrl) -> Path:
    """Return the path of a file URL, even if the file's name is not valid text."""
    if os.name == "nt":
        return Path(url.toLocalFile())
    return path_in_url(bytes(url.toEncoded().data()))


Side: TypeAlias = Literal["centre", "right", "top"]

_SCRIM: Final = 0.6
_MARGIN: Final = 24


class Sheet(PaintedWidget):
    """A panel with a title and a close button over a darkened window.

    A sheet opens only at the user's request. It appears in the centre, near the top, or as a column
    at the right edge. Esc or a click outside closes the sheet, Tab stays inside it, and closing it
    restores the previous focus. If `under` is given, the sheet appears below that button and does
    not darken the window. Changes in the window then remain visible.
    """

    closed = Signal()
    # Weak references, so that a sheet that closes with its window does not keep its screen alive.
    _open: ClassVar[list[weakref.ref[Sheet]]] = []

    @classmethod
    def over(cls, host: QWidget) -> list[Sheet]:
        """Return the open sheets of a window, with the topmost one last."""
        sheets = [one for one in (each() for each in cls._open) if one is not None]
        visible = [one for one in sheets if shiboken6.isValid(one) and not one.isHidden()]
        cls._open[:] = map(weakref.ref, visible)
        return [one for one in visible if one._host is host]

    def __init__(
        self,
        host: QWidget,
        title: str,
        width: int = 560,
        side: Side = "centre",
        under: QWidget | None = None,
    ) -> None:
        super().__init__(host)
        self._host, self._side, self._wide = host, side, px(width)
        self._back: QWidget | None = None
        self._under = under
        self.setAccessibleName(title)
        self.setProperty("focusHost", True)
        edge, radius = ("line", 0) if side == "right" else ("ctl", 8)
        self._panel = OutlineBox("panel", edge, radius=radius, parent=self)
        self._title = Text(title, 20, 600)
        self._close = IconButton("close", tr("Close"), kind="quiet", shortcut="Esc", do=self.shut)
        self.body = column(gap=16)
        self.foot = row(..., gap=8)
        head = row((self._title, 1), self._close, gap=None)
        whole = (head, (self.body, 1), self.foot)
        self._column = column(*whole, into=self._panel, gap=16, margins=(24, 16, 24, 24))
        host.installEventFilter(self)
        self.hide()

    def set_title(self, title: str) -> None:
        """Change the title."""
        self._title.set_text(title)
        self.setAccessibleName(title)

    def add_button(self, button: Button) -> None:
        """Add a button at the bottom, to the right of the existing ones."""
        self.foot.addWidget(button)

    def open(self, focus: QWidget | None = None) -> None:
        """Show the sheet on top of everything in the window."""
        self._back = self.window().focusWidget()
        self.setGeometry(self._host.rect())
        self.show()
        self.raise_()
        if self not in self.over(self._host):
            self._open.append(weakref.ref(self))
        self._lay()
        first = focus or next(iter(self._stops()), self._close)
        first.setFocus(Qt.FocusReason.TabFocusReason)

    def shut(self) -> None:
        """Close the sheet."""
        if not self.isHidden():
            self.hide()
            if self._back is not None and shiboken6.isValid(self._back):
                self._back.setFocus(Qt.FocusReason.OtherFocusReason)
            focus = QApplication.focusWidget()
            if focus is not None and self.isAncestorOf(focus):
                # The previous focus widget is gone or hidden, and keys must not go to a closed
                # sheet.
                focus.clearFocus()
            self._back = None
            self.closed.emit()

    def _lay(self) -> None:
        """Position the panel in the window."""
        margin = px(_MARGIN)
        wide = min(self._wide, self.width() - 2 * margin)
        if self._side == "right":
            self._panel.setGeometry(QRect(self.width() - wide, 0, wide, self.height()))
            return
        layout = self._column
        want = layout.totalHeightForWidth(wide) if layout.hasHeightForWidth() else -1
        high = want if want > 0 else self._panel.sizeHint().height()
        high = min(high, self.height() - 2 * margin)
        top = (self.height() - high) // 2 if self._side == "centre" else px(72)
        top = max(min(top, self.height() - high - margin), 0)
        left = (self.width() - wide) // 2
        if self._under is not None:
            corner = QPoint(self._under.width(), self._under.height() + px(8))
            spot = self._under.mapTo(self._host, corner)
            left, top = max(spot.x() - wide, margin), min(spot.y(), self.height() - high - margin)
        self._panel.setGeometry(QRect(left, top, wide, high))

    def _stops(self) -> list[QWidget]:
        """Return the Tab stops in order, ending with the close button."""
        stops: list[QWidget] = []
        widget = self.nextInFocusChain()
        while widget is not None and widget is not self:
            inside = self.isAncestorOf(widget) and widget.isVisible() and widget.isEnabled()
            if inside and widget.focusPolicy() & Qt.FocusPolicy.TabFocus:
                proxied = widget.focusProxy() is not None
                if not proxied and widget is not self._close and widget not in stops:
                    stops.append(widget)
            widget = widget.nextInFocusChain()
        return [*stops, self._close]

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Keep the focus inside the sheet when the user presses Tab."""
        stops = self._stops()
        here = self.window().focusWidget()
        place = stops.index(here) if here in stops else -1
        stops[(place + (1 if forward else -1)) % len(stops)].setFocus(
            Qt.FocusReason.TabFocusReason if forward else Qt.FocusReason.BacktabFocusReason
        )
        return True

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow changes to the window's size."""
        if watched is self._host and event.type() == QEvent.Type.Resize and not self.isHidden():
            self.setGeometry(self._host.rect())
            self._lay()
        return False

    def event(self, event: QEvent) -> bool:
        """Update the layout when the height of the content changes."""
        if event.type() == QEvent.Type.LayoutRequest and not self.isHidden():
            self._lay()
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Close the sheet on Esc, and prevent all other keys from reaching the window."""
        if event.key() == Qt.Key.Key_Escape:
            self.shut()
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Close the sheet on a click outside its panel."""
        if not self._panel.geometry().contains(event.position().toPoint()):
            self.shut()
        event.accept()

    def paint_on(self, painter: QPainter, _t: Theme) -> None:
        """Darken the window."""
        if self._under is None:
            painter.fillRect(self.rect(), faint(Qt.GlobalColor.black, _SCRIM))


class SheetHost(QWidget):
    """A screen with at most one sheet over it. The sheet closes when the screen is hidden."""

    sheet: Sheet | None = None

    def put_over(self, sheet: Sheet, focus: QWidget | None = None) -> None:
        """Open a sheet in place of any other, and delete it when it closes."""
        self.take_back()
        self.sheet = sheet
        sheet.closed.connect(self._sheet_closed)
        sheet.open(focus)

    def take_back(self) -> None:
        """Close the sheet that is open."""
        if self.sheet is not None:
            self.sheet.shut()

    def _sheet_closed(self) -> None:
        sheet, self.sheet = self.sheet, None
        if sheet is not None:
            sheet.deleteLater()

    def hideEvent(self, event: QHideEvent) -> None:
        """Close the open sheet."""
        super().hideEvent(event)
        self.take_back()


class KeysSheet(Sheet):
    """A sheet that prevents keys from triggering the shortcuts of the screen behind it."""

    def event(self, event: QEvent) -> bool:
        """Keep all keys in the sheet."""
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)


class LineSheet(KeysSheet):
    """A sheet with a text field and a button that submits the text.

    Attributes:
        taken: Signal(str). Emitted with the text when the user presses Enter or the button, unless
            the sheet is busy.
    """

    taken = Signal(str)

    def __init__(
        self, host: QWidget, title: str, label: str, button: str, text: str, example: str
    ) -> None:
        super().__init__(host, title, 440)
        self.field = TextField(label, example)
        self.field.set_text(text)
        self.field.edit.selectAll()
        self.take = Button(button, kind="primary", do=self._answer)
        cancel = Button(tr("Cancel"), do=self.shut)
        self.body.addWidget(self.field)
        self.add_button(cancel)
        self.add_button(self.take)
        self.field.entered.connect(lambda _text: self._answer())
        self.field.changed.connect(lambda _text: self.field.set_error(""))

    def say(self, sentence: str) -> None:
        """Show an error below the field, or close the sheet if `sentence` is empty."""
        self.show_busy(False)
        self.field.set_error(sentence)
        if not sentence:
            self.shut()

    def show_busy(self, saving: bool) -> None:
        """Set whether to show that the text is being saved."""
        if saving != self.take.busy:
            self.take.set_busy(tr("Saving…") if saving else None)

    def _answer(self) -> None:
        if not self.take.busy:
            self.taken.emit(self.field.text())


class Term(Pressable):
    """The name of a number, which opens an explanation of the number when pressed.

    The explanations are in `EXPLANATIONS`.
    """

    def __init__(
        self, key: str, words: str = "", look: tuple[int, int, Role] = (12, 400, "dim")
    ) -> None:
        super().__init__(words, do=self._explain)
        self.key, self._look = key, look
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self.say(words)

    def say(self, words: str, key: str = "") -> None:
        """Change the name and the key of the explanation.

        A term whose name is empty is hidden.
        """
        self.key = key or self.key
        self.setText(words)
        question = tr("{name}: what does it mean?", name=words)
        describe(self, question, tip=tr("What {name} means", name=EXPLANATIONS[self.key][0]))
        if not words or self.parent() is not None:
            self.setVisible(bool(words))
        self.updateGeometry()
        self.update()

    def _font(self) -> QFont:
        return theme().font(*self._look[:2])

    def sizeHint(self) -> QSize:
        """Return the size required by the text."""
        return QSize(text_width(self._font(), self.text()), theme().line_height(self._look[0]))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest useful size. The text may be shortened at that size."""
        return QSize(min(self.sizeHint().width(), px(24)), self.sizeHint().height())

    def focus_shape(self) -> tuple[QRect, int]:
        """Return the area of the text, excluding the empty space around it."""
        return QRect(0, 0, min(self.width(), self.sizeHint().width()), self.height()), px(4)

    def paint_on(self, painter: QPainter, t: Theme) -> None:
        """Paint the text with an underline that is dotted, or solid while the mouse is over it."""
        ink = getattr(t.c, self._look[2])
        put_text(painter, self.rect(), self.text(), self._font(), ink)
        line = pen(ink if self.hovered() else t.c.ctl, 1, () if self.hovered() else (1, 2))
        painter.setPen(line)
        low = self.height() - 1
        painter.drawLine(0, low, self.focus_shape()[0].width(), low)

    def _explain(self) -> None:
        title, words = EXPLANATIONS[self.key]
        sheet = KeysSheet(self.window(), title, 360, under=self)
        signal = getattr(self.window(), "asked", None)

        def read() -> None:
            sheet.shut()
            if signal is not None:
                signal.emit(f"manual#{title}", QPoint())

        sheet.body.addWidget(Text(words, 14, wrap=True))
        sheet.add_button(Button(tr("More in the manual"), size="small", do=read))
        sheet.closed.connect(sheet.deleteLater)
        sheet.open()
