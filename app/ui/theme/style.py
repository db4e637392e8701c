"""The look of Qt's own parts: palette, font, tooltips, menus, scroll bars and the focus ring."""

from __future__ import annotations

from typing import Any, Final

import shiboken6
from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QRectF, Qt, QTimer
from PySide6.QtGui import QGuiApplication, QPainter, QPaintEvent, QPalette, QPen
from PySide6.QtWidgets import (
    QAbstractScrollArea,
    QApplication,
    QLabel,
    QProxyStyle,
    QStyle,
    QToolTip,
    QWidget,
)

from app.ui.theme.theme import Theme, theme

_BARS: Final = """
QScrollBar:vertical {{ background: transparent; width: {bar}px; margin: 0; border: none; }}
QScrollBar:horizontal {{ background: transparent; height: {bar}px; margin: 0; border: none; }}
QScrollBar::handle {{ background: {ctl}; border-radius: {knob}px; margin: {gap}px; }}
QScrollBar::handle:hover {{ background: {dim}; }}
QScrollBar::handle:vertical {{ min-height: {p32}px; }}
QScrollBar::handle:horizontal {{ min-width: {p32}px; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; border: none; }}
QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
"""
_MENU: Final = """
QMenu {{ background: {panel}; color: {text}; border: {line}px solid {ctl};
    border-radius: {radius}px; padding: {p4}px; }}
QMenu::item {{ padding: {p8}px {p16}px {p8}px {p12}px; border-radius: {p4}px;
    border: {line}px solid transparent; }}
QMenu::item:selected {{ background: {chosen}; color: {onchosen}; border-color: {chosen_edge}; }}
QMenu::item:disabled {{ color: {dis}; }}
QMenu::icon {{ padding-left: {p8}px; }}
QMenu::separator {{ height: {line}px; background: {rule}; margin: {p4}px {p8}px; }}
"""

_MAYBE_BLACK: Final = ("xcb", "vnc", "linuxfb")
_STYLED: Final = "turnlight styled"


class _Style(QProxyStyle):
    """Qt's Fusion style with custom tooltips.

    A style sheet for the whole application would have the same effect, but Qt would match it
    against every widget whenever a widget's parent changes. The tooltips are painted by Qt, because
    garbage collection during a paint in Python could destroy the tooltip or its owner.
    """

    def polish(self, what: Any) -> Any:
        """Style a tooltip, and always treat its text as plain text.

        By default, Qt renders any text that looks like HTML and loads the images in it. The title
        of a style made by somebody else could then read any file or contact a network share.
        """
        if isinstance(what, QLabel) and what.inherits("QTipLabel"):
            what.setTextFormat(Qt.TextFormat.PlainText)
            t = theme()
            # Qt adds its own margin and takes the border colour from the text role.
            qts = 1 + self.pixelMetric(QStyle.PixelMetric.PM_ToolTipLabelFrameWidth)
            around = t.px(4) + t.line_width - qts
            aside = around + t.px(4)
            what.setContentsMargins(aside, around, aside, around)
            what.setForegroundRole(QPalette.ColorRole.WindowText)
        return super().polish(what)


def show_tip(at: QPoint, words: str, owner: QWidget) -> None:
    """Show a tooltip at a screen position, with a text other than the widget's own tooltip."""
    QToolTip.showText(at, words, owner)


def palette(t: Theme) -> QPalette:
    """Return the palette for Qt's own parts."""
    c, role, group = t.c, QPalette.ColorRole, QPalette.ColorGroup
    colours = {
        role.Window: c.bg,
        role.WindowText: c.text,
        role.Base: c.raised,
        role.AlternateBase: c.panel,
        role.Text: c.text,
        role.PlaceholderText: c.dim,
        role.Button: c.panel,
        role.ButtonText: c.text,
        role.BrightText: c.err,
        role.ToolTipBase: c.tag,
        role.ToolTipText: c.ontag,
        role.Highlight: c.amberfill,
        role.HighlightedText: c.onamber,
        role.Accent: c.amberfill,
        role.Link: c.amber,
        role.LinkVisited: c.amber,
        role.Light: c.raised,
        role.Midlight: c.raised,
        role.Mid: c.ctl,
        role.Dark: c.line,
        role.Shadow: c.line,
    }
    result = QPalette()
    for which, colour in colours.items():
        result.setColor(which, colour)
    for which in (role.WindowText, role.Text, role.ButtonText):
        result.setColor(group.Disabled, which, c.dis)
    return result


def _lengths(t: Theme) -> dict[str, int]:
    return {f"p{n}": t.px(n) for n in (4, 8, 12, 16, 32)}


def bar_sheet(t: Theme) -> str:
    """Return the style sheet of a scroll bar."""
    gap = t.px(2)
    return _BARS.format(
        **_lengths(t),
        bar=t.px(6) + 2 * gap,
        knob=t.px(6) // 2,
        gap=gap,
        ctl=t.c.ctl.name(),
        dim=t.c.dim.name(),
    )


def round_corners(popup: QWidget) -> int:
    """Round the corners of a popup unless they might turn black, and return the radius used.

    On X11, transparency needs a compositor, and Qt does not report whether one is running.
    """
    safe = QGuiApplication.platformName() not in _MAYBE_BLACK
    popup.setAttribute(Qt.WidgetAttribute.WA_TranslucentBackground, safe)
    return theme().px(8) if safe else 0


def dress_menu(menu: QWidget) -> None:
    """Apply the theme to a menu, without the system's frame or shadow."""
    menu.setWindowFlag(Qt.WindowType.FramelessWindowHint)
    menu.setWindowFlag(Qt.WindowType.NoDropShadowWindowHint)
    menu.setStyleSheet(menu_sheet(theme(), round_corners(menu)))


def menu_sheet(t: Theme, radius: int = 0) -> str:
    """Return the style sheet of a menu."""
    c = t.c
    return _MENU.format(
        **_lengths(t),
        radius=radius,
        line=t.line_width,
        panel=c.panel.name(),
        text=c.text.name(),
        dis=c.dis.name(),
        ctl=c.ctl.name(),
        rule=c.line.name(),
        chosen=(c.text if t.contrast else c.raised).name(),
        onchosen=(c.panel if t.contrast else c.text).name(),
        chosen_edge=c.ctl.name(),
    )


def dress_bars(area: QAbstractScrollArea) -> None:
    """Apply the theme to the scroll bars of an area."""
    sheet, never = bar_sheet(theme()), Qt.ScrollBarPolicy.ScrollBarAlwaysOff
    area.verticalScrollBar().setStyleSheet(sheet)
    if area.horizontalScrollBarPolicy() != never:
        area.horizontalScrollBar().setStyleSheet(sheet)


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
    """The focus ring, 2 px wide and 2 px away from the control.

    The ring ignores the mouse.
    """

    def __init__(self, host: QWidget) -> None:
        super().__init__(host)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.radius = 8

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(theme().c.focus, _WIDTH))
        half = _WIDTH / 2
        radius = self.radius + _GAP + half
        painter.drawRoundedRect(
            QRectF(self.rect()).adjusted(half, half, -half, -half), radius, radius
        )


def _host(widget: QWidget) -> QWidget:
    """Return the widget inside which the focus ring must stay."""
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
    """Moves the focus ring to the focused widget.

    The ring lies outside the control, so no control can paint it itself. Instead, one transparent
    widget moves to the focused control, inside the nearest window, sheet or scroll area, which
    clips the ring. The ring appears when the user moves the focus with the keyboard or starts to
    type.

    A widget whose shape does not fill its rectangle provides ``focus_shape() -> (QRect, int)``,
    which returns a rectangle in its own coordinates and a corner radius, both in logical pixels. A
    widget that shows the focus itself has the dynamic property ``noFocusRing``, and one that should
    contain the ring has ``focusHost``.
    """

    def __init__(self, app: QApplication) -> None:
        super().__init__(app)
        self._ring: _Ring | None = None
        self._target: QWidget | None = None
        self._watched: list[QWidget] = []
        self._by_keyboard = True
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._place)
        app.focusChanged.connect(self._focus_moved)

    def _focus_moved(self) -> None:
        """Follow the focus among the app's own widgets.

        The focus also moves while one of Qt's own dialogs is half destroyed. At that time, neither
        the widget that Qt reports as the old focus nor the parents of a foreign widget may be
        accessed.
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
        """Watch for movement, typing and clicks, without blocking any events."""
        kind = event.type()
        if kind in _MOVES or (kind == QEvent.Type.Paint and watched is self._target):
            # The shape may change with the content, but the widget is being painted right now.
            self._later.start()
        elif kind == QEvent.Type.KeyPress and not self._by_keyboard:
            self._by_keyboard = True
            self._later.start()
        elif kind == QEvent.Type.MouseButtonPress and watched is self._target:
            self._by_keyboard = False
            self._later.start()
        return False

    def _next_target(self) -> QWidget | None:
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
        target = self._next_target()
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
    """Install the application's focus ring, once only, and return the ring."""
    ring = app.findChild(FocusRing)
    return ring if isinstance(ring, FocusRing) else FocusRing(app)


def apply(app: QApplication) -> None:
    """Apply the current theme's palette, font, tooltips and focus ring to the application.

    Raises:
        CoreError: If the interface font is missing.
    """
    t = theme()
    if not app.property(_STYLED):
        app.setStyle(_Style("Fusion"))
        app.setProperty(_STYLED, True)
    app.setPalette(palette(t))
    app.setFont(t.font(14))
    tips = QPalette(app.palette())
    tips.setColor(QPalette.ColorRole.ToolTipBase, t.c.tag)
    tips.setColor(QPalette.ColorRole.ToolTipText, t.c.ctl)
    tips.setColor(QPalette.ColorRole.WindowText, t.c.ontag)
    QToolTip.setPalette(tips)
    QToolTip.setFont(t.font(12))
    install(app)
