"""Inter with figures of equal width, from the files that travel with the program."""

from __future__ import annotations

from functools import lru_cache

from PySide6.QtGui import QFont

from app.export.canvas import FAMILY, load_fonts


@lru_cache(maxsize=256)
def _font(pixels: int, weight: int) -> QFont:
    load_fonts()
    font = QFont(FAMILY)
    font.setPixelSize(pixels)
    font.setWeight(QFont.Weight(weight))
    # A number that counts must not make the words beside it jump.
    font.setFeature(QFont.Tag("tnum"), 1)
    return font


def inter(pixels: int, weight: int = 400) -> QFont:
    """Give the interface font with an em of so many logical pixels; needs a `QGuiApplication`.

    Raises:
        CoreError: When the font's files are missing or damaged.
    """
    return QFont(_font(max(1, pixels), weight))
