"""The colours of the three themes, as plain data: one table, no Qt.

Every surface has equal red, green and blue, so that tone can be judged beside it, and pictures
lie on the same `Palette.well` in all three. Amber means light, turn and selection, and nothing
else; green and red never stand without an icon.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

ThemeName: TypeAlias = Literal["dark", "light", "contrast"]
"""Name of a theme, as it stands in the settings."""


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of one theme as ``#rrggbb`` in sRGB, by what they are for.

    Attributes:
        bg, panel, raised: Window; rail, bars, columns and cards; what is selected, pressed or typed
            into.
    """

    bg: str
    panel: str
    raised: str
    well: str
    line: str
    ctl: str
    text: str
    dim: str
    dis: str
    amber: str
    amberfill: str
    onamber: str
    sel: str
    ok: str
    err: str
    focus: str
    track: str
    track2: str
    tag: str
    ontag: str
    plus: str
    minus: str


DARK: Final = Palette(
    bg="#161616",
    panel="#1e1e1e",
    raised="#292929",
    well="#2b2b2b",
    line="#383838",
    ctl="#7d7d7d",
    text="#ededed",
    dim="#b4b4b4",
    dis="#747474",
    amber="#f2bc4b",
    amberfill="#f2bc4b",
    onamber="#1c1404",
    sel="#f2bc4b",
    ok="#5fcf9a",
    err="#ff9088",
    focus="#ffffff",
    track="#4a4a4a",
    track2="#3b3b3b",
    tag="#101010",
    ontag="#f5f5f5",
    plus="#ff8c1e",
    minus="#288cff",
)

LIGHT: Final = Palette(
    bg="#e4e4e4",
    panel="#f2f2f2",
    raised="#ffffff",
    well="#2b2b2b",
    line="#c6c6c6",
    ctl="#767676",
    text="#1a1a1a",
    dim="#515151",
    dis="#8a8a8a",
    amber="#7a4e00",
    amberfill="#f2bc4b",
    onamber="#1c1404",
    sel="#7a4e00",
    ok="#0a6844",
    err="#a8201a",
    focus="#1a1a1a",
    track="#b4b4b4",
    track2="#d0d0d0",
    tag="#101010",
    ontag="#f5f5f5",
    plus="#ff8c1e",
    minus="#288cff",
)

CONTRAST: Final = Palette(
    bg="#ffffff",
    panel="#ffffff",
    raised="#ffffff",
    well="#2b2b2b",
    line="#000000",
    ctl="#000000",
    text="#000000",
    dim="#000000",
    dis="#8a8a8a",
    amber="#000000",
    amberfill="#ffb400",
    onamber="#000000",
    sel="#000000",
    ok="#005c3a",
    err="#9b0000",
    focus="#000000",
    track="#767676",
    track2="#bdbdbd",
    tag="#000000",
    ontag="#ffffff",
    plus="#ff8c1e",
    minus="#288cff",
)

PALETTES: Final[dict[ThemeName, Palette]] = {"dark": DARK, "light": LIGHT, "contrast": CONTRAST}
"""The palette of each theme."""
