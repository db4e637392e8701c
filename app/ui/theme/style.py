"""What Qt itself paints: palette, font, tool tips, menus and scroll bars in the theme's look."""

from __future__ import annotations

from typing import Any, Final

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import (
    QAbstractScrollArea,
    QApplication,
    QLabel,
    QProxyStyle,
    QStyle,
    QToolTip,
    QWidget,
)

from app.ui.theme.focus import install
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
    border-radius: {p8}px; padding: {p4}px; }}
QMenu::item {{ padding: {p8}px {p16}px {p8}px {p12}px; border-radius: {p4}px;
    border: {line}px solid transparent; }}
QMenu::item:selected {{ background: {chosen}; color: {onchosen}; border-color: {chosen_edge}; }}
QMenu::item:disabled {{ color: {dis}; }}
QMenu::icon {{ padding-left: {p8}px; }}
QMenu::separator {{ height: {line}px; background: {rule}; margin: {p4}px {p8}px; }}
"""

_STYLED: Final = "turnlight styled"


class _Style(QProxyStyle):
    """Fusion, with tool tips of our own.

    A style sheet for the whole application would do the same, but Qt would then look up every
    widget in it, each time that one is put into another. Qt itself paints the tips: Python would
    at times collect garbage meanwhile, and with it the tip's owner and the tip in painting.
    """

    def polish(self, what: Any) -> Any:
        """Dress tool tips, whose words are plain text wherever they come from.

        Left to itself Qt takes words that look like HTML for HTML, and opens the pictures in
        them: the title of a style from somebody else would read any file, or ask a network share.
        """
        if isinstance(what, QLabel) and what.inherits("QTipLabel"):
            what.setTextFormat(Qt.TextFormat.PlainText)
            t = theme()
            # Qt adds a margin of its own, and takes the role of the words for the edge.
            qts = 1 + self.pixelMetric(QStyle.PixelMetric.PM_ToolTipLabelFrameWidth)
            around = t.px(4) + t.line_width - qts
            aside = around + t.px(4)
            what.setContentsMargins(aside, around, aside, around)
            what.setForegroundRole(QPalette.ColorRole.WindowText)
        return super().polish(what)


def show_tip(at: QPoint, words: str, owner: QWidget) -> None:
    """Show a tool tip whose words differ from the widget's own, at a place on the screen."""
    QToolTip.showText(at, words, owner)


def palette(t: Theme) -> QPalette:
    """Give the palette that Qt's own parts are painted with."""
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
    """Give the style sheet of a scroll bar."""
    gap = t.px(2)
    return _BARS.format(
        **_lengths(t),
        bar=t.px(6) + 2 * gap,
        knob=t.px(6) // 2,
        gap=gap,
        ctl=t.c.ctl.name(),
        dim=t.c.dim.name(),
    )


def menu_sheet(t: Theme) -> str:
    """Give the style sheet of a menu."""
    c = t.c
    return _MENU.format(
        **_lengths(t),
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
    """Give an area's scroll bars the theme's look."""
    sheet, never = bar_sheet(theme()), Qt.ScrollBarPolicy.ScrollBarAlwaysOff
    area.verticalScrollBar().setStyleSheet(sheet)
    if area.horizontalScrollBarPolicy() != never:
        area.horizontalScrollBar().setStyleSheet(sheet)


def apply(app: QApplication) -> None:
    """Give the whole application the current theme's palette, font, tool tips and focus ring.

    Raises:
        CoreError: When the interface font is missing.
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
