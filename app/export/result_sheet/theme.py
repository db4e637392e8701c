"""Colours and type of the dark theme, and the scale at which sheets are drawn.

Every surface is neutral (equal red, green and blue), so that the tone of pictures can be judged
on it. Amber means the turn and nothing else.
"""

from __future__ import annotations

from typing import Final, TypeAlias

Colour: TypeAlias = tuple[int, int, int]
"""sRGB bytes."""

SCALE: Final = 2
"""Pixels per logical pixel; all lengths elsewhere in the sheet are logical."""

PIXELS_PER_INCH: Final = 96 * SCALE
"""Resolution to state in the file, so that viewers show logical pixels at their size."""

BG: Final[Colour] = (0x16, 0x16, 0x16)
PANEL: Final[Colour] = (0x1E, 0x1E, 0x1E)
LINE: Final[Colour] = (0x38, 0x38, 0x38)
CTL: Final[Colour] = (0x7D, 0x7D, 0x7D)
TEXT: Final[Colour] = (0xED, 0xED, 0xED)
DIM: Final[Colour] = (0xB4, 0xB4, 0xB4)
TRACK: Final[Colour] = (0x3B, 0x3B, 0x3B)
AMBER: Final[Colour] = (0xF2, 0xBC, 0x4B)
TAG: Final[Colour] = (0x10, 0x10, 0x10)
ON_TAG: Final[Colour] = (0xF5, 0xF5, 0xF5)
