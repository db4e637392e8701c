"""Inter with figures of equal width, from the files that travel with the program."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Final

from PySide6.QtGui import QFont, QFontDatabase

from app.core.base.errors import CoreError
from app.core.base.paths import resources

FAMILY: Final = "Inter"
"""Family name of the interface font."""

WEIGHTS: Final[dict[int, str]] = {400: "Regular", 500: "Medium", 600: "SemiBold", 700: "Bold"}
"""Weights that travel with the program, and the names of their files."""


@cache
def _load() -> None:
    """Register the four files once per process."""
    folder = resources() / "fonts"
    for word in WEIGHTS.values():
        path = folder / f"{FAMILY}-{word}.otf"
        if QFontDatabase.addApplicationFont(str(path)) < 0:
            raise CoreError(f"The font {path.name} cannot be read.", "Install Turnlight again.")


@lru_cache(maxsize=256)
def _font(pixels: int, weight: int) -> QFont:
    _load()
    font = QFont(FAMILY)
    font.setPixelSize(pixels)
    font.setWeight(QFont.Weight(weight))
    # A number that counts must not make the words beside it jump.
    font.setFeature(QFont.Tag("tnum"), 1)
    return font


def inter(pixels: int, weight: int = 400) -> QFont:
    """Give the interface font with an em of so many logical pixels; needs a `QGuiApplication`.

    Raises
    ------
    CoreError
        When the font's files are missing or damaged.
    """
    return QFont(_font(max(1, pixels), weight))
