"""The current theme: colours, fonts and sizes for everything that is painted.

A widget calls `theme` when it is created and when it paints. A change of theme or scale rebuilds
the views, so no widget has to restyle itself.

Every surface is a neutral grey with equal red, green and blue, which allows tones to be judged
beside it. Pictures have the same background, `Colours.well`, in all themes. Amber is reserved for
light, turn and selection, and green and red always come with an icon.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated, Final, Literal, TypeAlias, get_type_hints

from PySide6.QtGui import QColor, QFont

from app.export.canvas import FAMILY, load_fonts

ThemeName: TypeAlias = Literal["dark", "light", "contrast"]
"""Name of a theme, as stored in the settings."""

SCALES: Final = (1.0, 2.0)
"""Smallest and largest scale of text and controls."""

LINE_HEIGHTS: Final = {12: 16, 14: 20, 16: 24, 20: 28, 28: 36, 36: 44, 48: 52, 56: 64, 224: 176}
"""Line height for each font size, both in logical pixels."""

_DISPLAY: Final = 36  # font sizes from here on are spaced more tightly
_TIGHT: Final = 0.025  # fraction of the font size


@dataclass(frozen=True, slots=True)
class Colours:
    """The colours of a theme, which must not be modified.

    `bg` is the colour of the window, `panel` that of the rail, bars, columns and cards, and
    `raised` that of selected, pressed and editable parts. Each colour has a value in the dark, the
    light and the contrast theme.
    """

    bg: Annotated[QColor, "#161616", "#e4e4e4", "#ffffff"]
    panel: Annotated[QColor, "#1e1e1e", "#f2f2f2", "#ffffff"]
    raised: Annotated[QColor, "#292929", "#ffffff", "#ffffff"]
    well: Annotated[QColor, "#2b2b2b", "#2b2b2b", "#2b2b2b"]
    line: Annotated[QColor, "#383838", "#c6c6c6", "#000000"]
    ctl: Annotated[QColor, "#7d7d7d", "#767676", "#000000"]
    text: Annotated[QColor, "#ededed", "#1a1a1a", "#000000"]
    dim: Annotated[QColor, "#b4b4b4", "#515151", "#000000"]
    dis: Annotated[QColor, "#747474", "#8a8a8a", "#8a8a8a"]
    amber: Annotated[QColor, "#f2bc4b", "#7a4e00", "#000000"]
    amberfill: Annotated[QColor, "#f2bc4b", "#f2bc4b", "#ffb400"]
    onamber: Annotated[QColor, "#1c1404", "#1c1404", "#000000"]
    sel: Annotated[QColor, "#f2bc4b", "#7a4e00", "#000000"]
    ok: Annotated[QColor, "#5fcf9a", "#0a6844", "#005c3a"]
    okfill: Annotated[QColor, "#0f4d36", "#b9e4cf", "#5fd39b"]
    err: Annotated[QColor, "#ff9088", "#a8201a", "#9b0000"]
    focus: Annotated[QColor, "#ffffff", "#1a1a1a", "#000000"]
    track: Annotated[QColor, "#4a4a4a", "#b4b4b4", "#767676"]
    track2: Annotated[QColor, "#3b3b3b", "#d0d0d0", "#bdbdbd"]
    tag: Annotated[QColor, "#101010", "#101010", "#000000"]
    ontag: Annotated[QColor, "#f5f5f5", "#f5f5f5", "#ffffff"]
    plus: Annotated[QColor, "#ff8c1e", "#ff8c1e", "#ff8c1e"]
    minus: Annotated[QColor, "#288cff", "#288cff", "#288cff"]


_TOKENS: Final = get_type_hints(Colours, include_extras=True)
_THEMES: Final[tuple[ThemeName, ...]] = ("dark", "light", "contrast")
PALETTES: Final[dict[ThemeName, dict[str, str]]] = {
    name: {token: hint.__metadata__[number] for token, hint in _TOKENS.items()}
    for number, name in enumerate(_THEMES)
}
"""Colours of each theme as ``#rrggbb`` in sRGB, keyed by purpose."""


@lru_cache(maxsize=256)
def _font(pixels: int, weight: int) -> QFont:
    load_fonts()
    font = QFont(FAMILY)
    font.setPixelSize(pixels)
    font.setWeight(QFont.Weight(weight))
    # A changing number must not shift the text beside it.
    font.setFeature(QFont.Tag("tnum"), 1)
    return font


class Theme:
    """One theme at one scale.

    Borders and dividers are `line_width` wide, which is 2 pixels in "contrast" and 1 pixel
    otherwise.

    Raises:
        KeyError: If there is no theme with that name.
    """

    def __init__(self, name: ThemeName = "dark", scale: float = 1.0) -> None:
        self.name: ThemeName = name
        self.scale = min(max(scale, SCALES[0]), SCALES[1])
        self.c = Colours(**{token: QColor(code) for token, code in PALETTES[name].items()})
        self.line_width = 2 if name == "contrast" else 1

    @cached_property
    def contrast(self) -> bool:
        """Whether this is the high-contrast theme.

        This theme has 2 px borders and shows selected parts in inverted colours.
        """
        return self.name == "contrast"

    def px(self, length: float) -> int:
        """Scale a design length in logical pixels, and round the result."""
        return int(length * self.scale + 0.5) if length >= 0 else -self.px(-length)

    def font(self, size: int, weight: int = 400) -> QFont:
        """Return the font Inter at a given size, with tabular figures.

        From 36 pixels up, the letters are spaced more tightly.

        Raises:
            CoreError: If the font's files are missing or damaged.
        """
        font = QFont(_font(max(1, self.px(size)), weight))
        if size >= _DISPLAY:
            # Tabular figures look too widely spaced at large sizes.
            font.setLetterSpacing(QFont.SpacingType.AbsoluteSpacing, -_TIGHT * self.px(size))
        return font

    def line_height(self, size: int) -> int:
        """Return the line height for a font size, from a table or as 1.4 times the font size."""
        return self.px(LINE_HEIGHTS.get(size, size * 1.4))


_current: list[Theme] = []


def theme() -> Theme:
    """Return the current theme, which is dark at scale 1 until another theme is set."""
    if not _current:
        _current.append(Theme())
    return _current[0]


def px(length: float) -> int:
    """Scale a design length in logical pixels by the current theme (see `Theme.px`)."""
    return theme().px(length)


def set_theme(name: ThemeName, scale: float = 1.0) -> Theme:
    """Change the current theme. The caller must then rebuild the views on screen."""
    new = Theme(name, scale)
    _current[:] = [new]
    return new
