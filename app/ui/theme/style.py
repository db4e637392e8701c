"""What Qt itself paints: palette, font, tool tips, menus and scroll bars in the theme's look."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtGui import QPalette

from app.ui.theme.focus import install
from app.ui.theme.theme import Theme, theme

if TYPE_CHECKING:
    from PySide6.QtWidgets import QApplication

__all__ = ["apply", "palette", "style_sheet"]

_SHEET: Final = """
QToolTip {{ background: {tag}; color: {ontag}; border: {line}px solid {tip_edge};
    padding: {p4}px {p8}px; font: {f12}px "Inter"; }}
QScrollBar:vertical {{ background: transparent; width: {bar}px; margin: 0; border: none; }}
QScrollBar:horizontal {{ background: transparent; height: {bar}px; margin: 0; border: none; }}
QScrollBar::handle {{ background: {ctl}; border-radius: {knob}px; margin: {gap}px; }}
QScrollBar::handle:hover {{ background: {dim}; }}
QScrollBar::handle:vertical {{ min-height: {p32}px; }}
QScrollBar::handle:horizontal {{ min-width: {p32}px; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; border: none; }}
QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
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


def palette(t: Theme) -> QPalette:
    """Give the palette that Qt's own parts are painted with.

    Parameters
    ----------
    t : Theme
        The theme to take the colours from.

    Returns
    -------
    QPalette
        Colours for all of Qt's roles that Fusion uses.
    """
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


def style_sheet(t: Theme) -> str:
    """Give the style sheet for what is simplest to style with one.

    Parameters
    ----------
    t : Theme
        The theme to take colours and sizes from.

    Returns
    -------
    str
        Qt style sheet for tool tips, scroll bars and menus.
    """
    c = t.c
    lengths = {f"p{n}": t.px(n) for n in (4, 8, 12, 16, 32)}
    gap = t.px(2)
    return _SHEET.format(
        **lengths,
        line=t.line_width,
        f12=t.px(12),
        bar=t.px(6) + 2 * gap,
        knob=t.px(6) // 2,
        gap=gap,
        tag=c.tag.name(),
        ontag=c.ontag.name(),
        tip_edge=c.ctl.name(),
        panel=c.panel.name(),
        text=c.text.name(),
        dim=c.dim.name(),
        dis=c.dis.name(),
        ctl=c.ctl.name(),
        rule=c.line.name(),
        chosen=(c.text if t.contrast else c.raised).name(),
        onchosen=(c.panel if t.contrast else c.text).name(),
        chosen_edge=c.ctl.name(),
    )


def apply(app: QApplication) -> None:
    """Give the whole application the current theme's palette, font, style sheet and focus ring.

    Parameters
    ----------
    app : QApplication
        The application; windows that are open are repainted by Qt.

    Raises
    ------
    CoreError
        When the interface font is missing.
    """
    t = theme()
    if not app.property(_STYLED):
        # Once: with a style sheet set, another style costs as much as the sheet does.
        app.setStyle("Fusion")
        app.setProperty(_STYLED, True)
    app.setPalette(palette(t))
    app.setFont(t.font(14))
    app.setStyleSheet(style_sheet(t))
    install(app)
