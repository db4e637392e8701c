"""The current theme: colours, type and sizes for everything that is painted.

A widget asks `theme` when it is made and when it paints. A change of theme or scale rebuilds
the views, so nothing has to restyle itself.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Final

from PySide6.QtGui import QColor, QFont

from app.ui.theme.fonts import inter
from app.ui.theme.tokens import PALETTES, Palette, ThemeName

SCALES: Final = (1.0, 2.0)
"""Smallest and largest scale of text and controls."""

LINE_HEIGHTS: Final[dict[int, int]] = {
    12: 16,
    14: 20,
    16: 24,
    20: 28,
    28: 36,
    36: 44,
    48: 52,
    56: 64,
    224: 176,
}
"""Line height of each type size, logical pixels."""

_DISPLAY: Final = 36  # type sizes from here on are set closer
_TIGHT: Final = 0.025  # of the type size


@dataclass(frozen=True, slots=True)
class Colours:
    """The tokens of `Palette` as colours that can be painted with; never change one."""

    bg: QColor
    panel: QColor
    raised: QColor
    well: QColor
    line: QColor
    ctl: QColor
    text: QColor
    dim: QColor
    dis: QColor
    amber: QColor
    amberfill: QColor
    onamber: QColor
    sel: QColor
    ok: QColor
    err: QColor
    focus: QColor
    track: QColor
    track2: QColor
    tag: QColor
    ontag: QColor
    plus: QColor
    minus: QColor

    @classmethod
    def of(cls, palette: Palette) -> Colours:
        """Turn the tokens of a theme into colours."""
        return cls(**{each.name: QColor(getattr(palette, each.name)) for each in fields(palette)})


class Theme:
    """One theme at one scale; KeyError when there is none of that name.

    Edges and dividers are `line_width` wide: 2 in "contrast", otherwise 1.
    """

    def __init__(self, name: ThemeName = "dark", scale: float = 1.0) -> None:
        self.name: ThemeName = name
        self.scale = min(max(scale, SCALES[0]), SCALES[1])
        self.c = Colours.of(PALETTES[name])
        self.line_width = 2 if name == "contrast" else 1

    @cached_property
    def contrast(self) -> bool:
        """Whether edges are 2 px black and what is chosen is white on black."""
        return self.name == "contrast"

    def px(self, length: float) -> int:
        """Scale a designed length in logical pixels to a whole number of them."""
        return int(length * self.scale + 0.5) if length >= 0 else -self.px(-length)

    def font(self, size: int, weight: int = 400) -> QFont:
        """Give Inter with tabular figures for a designed em; from 36 on a little closer."""
        font = inter(self.px(size), weight)
        if size >= _DISPLAY:
            # Figures of equal width stand too far apart when they are large.
            font.setLetterSpacing(QFont.SpacingType.AbsoluteSpacing, -_TIGHT * self.px(size))
        return font

    def line_height(self, size: int) -> int:
        """Give the distance of base lines for a designed em: from a table, or else 1.4 em."""
        return self.px(LINE_HEIGHTS.get(size, size * 1.4))


_current: list[Theme] = []


def theme() -> Theme:
    """Give the theme that everything is painted with now; dark at scale 1 until one is set."""
    if not _current:
        _current.append(Theme())
    return _current[0]


def set_theme(name: ThemeName, scale: float = 1.0) -> Theme:
    """Change the current theme; what is already on screen must be rebuilt by its owner."""
    new = Theme(name, scale)
    _current[:] = [new]
    return new
