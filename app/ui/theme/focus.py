"""The focus ring: 2 px wide, 2 px away from whatever has the keyboard.

It lies outside the control, so no control can paint it itself. One transparent widget is moved
to where the focus is, inside the nearest window, sheet or scrolled area, and is cut off by that.
It shows when the focus came by keyboard, or as soon as somebody types.

A widget whose shape is not its whole rectangle offers ``focus_shape() -> (QRect, int)``:
rectangle in its own coordinates and corner radius, both in logical pixels. One that shows the
focus by itself has the dynamic property ``noFocusRing``; one that the ring should stay inside
has ``focusHost``.
"""

from __future__ import annotations

from typing import Final

import shiboken6
from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QRectF, Qt, QTimer
from PySide6.QtGui import QGuiApplication, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractScrollArea, QApplication, QWidget

from app.ui.theme.theme import theme

_WIDTH: Final = 2
_GAP: Final = 2
_MOVES: Final = frozenset(
    {
        QEvent.Type.Move,
        QEvent.Type.Resize,
        QEvent.Type.Show,
        QEvent.Type.Hide,
        QEvent.Type.ParentChange,
        QEvent.Type.EnabledChange,
    }
)


class _Ring(QWidget):
    """The ring itself; never in the way of the mouse."""

    def __init__(self, host: QWidget) -> None:
        super().__init__(host)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.radius = 8

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint it in the current theme."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(theme().c.focus, _WIDTH))
        half = _WIDTH / 2
        radius = self.radius + _GAP + half
        painter.drawRoundedRect(
            QRectF(self.rect()).adjusted(half, half, -half, -half), radius, radius
        )


def _host(widget: QWidget) -> QWidget:
    """Find the widget that the ring must stay inside."""
    up = widget.parentWidget()
    while up is not None:
        grand = up.parentWidget()
        scrolled = isinstance(grand, QAbstractScrollArea) and grand.viewport() is up
        if up.isWindow() or scrolled or up.property("focusHost"):
            return up
        up = grand
    return widget.window()


def _shape(widget: QWidget) -> tuple[QRect, int]:
    offer = getattr(widget, "focus_shape", None)
    if offer is None:
        return widget.rect(), theme().px(8)
    rect, radius = offer()
    return rect, radius


class FocusRing(QObject):
    """Moves the ring to where the keyboard is."""

    def __init__(self, app: QApplication) -> None:
        super().__init__(app)
        self._ring: _Ring | None = None
        self._target: QWidget | None = None
        self._watched: list[QWidget] = []
        self._by_keyboard = True
        self._later = QTimer(self, singleShot=True, interval=0)
        self._later.timeout.connect(self._place)
        app.focusChanged.connect(self._focus_moved)

    @property
    def rect(self) -> QRect | None:
        """Outer rectangle of the ring in its host's coordinates; None while it is hidden."""
        ring = self._ring
        if ring is None or not shiboken6.isValid(ring) or not ring.isVisible():
            return None
        return ring.geometry()

    def _focus_moved(self) -> None:
        """Follow it among our own widgets.

        It also moves while a dialog of Qt's own is half destroyed: neither what Qt says had the
        focus may be touched here, nor what stands around a widget that is not ours.
        """
        new = QApplication.focusWidget()
        if new is not None and not shiboken6.createdByPython(new):
            new = None
        for widget in self._watched:
            if shiboken6.isValid(widget):
                widget.removeEventFilter(self)
        self._watched = []
        self._target = new
        if QGuiApplication.mouseButtons() != Qt.MouseButton.NoButton:
            self._by_keyboard = False
        if new is not None:
            host = _host(new)
            up: QWidget | None = new
            while up is not None:
                up.installEventFilter(self)
                self._watched.append(up)
                if up is host:
                    break
                up = up.parentWidget()
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Notice movements, typing and clicks; nothing is ever held back."""
        kind = event.type()
        if kind in _MOVES or (kind == QEvent.Type.Paint and watched is self._target):
            # Its shape may have changed with what it shows; not now, it is being painted.
            self._later.start()
        elif kind == QEvent.Type.KeyPress and not self._by_keyboard:
            self._by_keyboard = True
            self._later.start()
        elif kind == QEvent.Type.MouseButtonPress and watched is self._target:
            self._by_keyboard = False
            self._later.start()
        return False

    def _wanted(self) -> QWidget | None:
        target = self._target
        if target is None or not shiboken6.isValid(target) or not self._by_keyboard:
            return None
        if target.isWindow() or not target.isVisible() or target.property("noFocusRing"):
            return None
        return target

    def _place(self) -> None:
        ring = self._ring
        if ring is not None and not shiboken6.isValid(ring):
            ring = self._ring = None
        target = self._wanted()
        if target is None:
            if ring is not None:
                ring.hide()
            return
        host = _host(target)
        if ring is None:
            ring = self._ring = _Ring(host)
        elif ring.parentWidget() is not host:
            ring.setParent(host)
        rect, radius = _shape(target)
        reach = _WIDTH + _GAP
        corner = target.mapTo(host, QPoint(0, 0))
        place = rect.translated(corner).adjusted(-reach, -reach, reach, reach)
        if ring.geometry() != place or ring.radius != radius or not ring.isVisible():
            ring.radius = radius
            ring.setGeometry(place)
            ring.show()
            ring.raise_()
            ring.update()


def install(app: QApplication) -> FocusRing:
    """Give the application its focus ring, once."""
    found = app.findChild(FocusRing)
    return found if isinstance(found, FocusRing) else FocusRing(app)
