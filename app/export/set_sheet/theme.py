"""Colours of a printed page: ink on white paper, grey neutral, amber for light and turn only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from app.export.result_sheet.theme import Colour

# A4 at 96 logical pixels per inch: 210 x 297 mm.
WIDTH: Final = 794.0
HEIGHT: Final = 1123.0
MARGIN: Final = 44.0

PAPER: Final[Colour] = (0xFF, 0xFF, 0xFF)
INK: Final[Colour] = (0x1A, 0x1A, 0x1A)
DIM: Final[Colour] = (0x51, 0x51, 0x51)
MIDDLE: Final[Colour] = (0x9A, 0x9A, 0x9A)
LINE: Final[Colour] = (0xC6, 0xC6, 0xC6)
TINT: Final[Colour] = (0xF4, 0xF4, 0xF4)
TRACK: Final[Colour] = (0xD8, 0xD8, 0xD8)
AMBER: Final[Colour] = (0x7A, 0x4E, 0x00)
AMBER_FILL: Final[Colour] = (0xF2, 0xBC, 0x4B)
TAG: Final[Colour] = (0x10, 0x10, 0x10)
ON_TAG: Final[Colour] = (0xF5, 0xF5, 0xF5)
