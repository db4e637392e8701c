"""Styles: the classic studio set-ups as lamps around the sitter, one TOML file each or each pair.

A file's name without its ending is the style's name, as used on the command line. Built-in styles
travel with the program: of a pair the left one, from which the right one follows. A folder of the
user's own may add to them. Files are read by
`app.core.solver.style_file`, strictly: an unknown key or a lamp inside the sitter is an error with
a sentence, never a guess.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, TypeAlias

from app.core.base.errors import StyleError
from app.core.base.paths import resources
from app.core.solver.signature import UNSIGNED, Signature
from app.core.solver.style_file import is_painted, read_toml
from app.core.text import tr
from app.core.text.directions import place_words

Side: TypeAlias = Literal["left", "right", "none"]
"""The sitter's own side on which the key lamp stands."""


def mirror_name(name: str) -> str:
    """Name of the mirrored style.

    Returns:
        With ``left-`` and ``right-`` exchanged; other names are their own mirror.

    Examples:
        >>> mirror_name("left-loop-rim"), mirror_name("badger")
        ('right-loop-rim', 'badger')
    """
    for here, there in (("left-", "right-"), ("right-", "left-")):
        if name.startswith(here):
            return there + name.removeprefix(here)
    return name


def _with_mirrors(*names: str) -> tuple[str, ...]:
    """Name each style and, after a left one, the right one that is its mirror image."""
    return tuple(each for name in names for each in dict.fromkeys((name, mirror_name(name))))


PAPER_NAMES: Final = _with_mirrors(
    "butterfly",
    "badger",
    "below",
    "flat",
    "top",
    "clamshell",
    "left-loop",
    "left-split",
    "left-rim",
    "left-below-side",
    "left-loop-rim",
)
"""The sixteen styles of the paper (E, Fried, Agrawala, UIST 2019)."""

NAMES: Final = (
    *PAPER_NAMES,
    *_with_mirrors("left-rembrandt", "left-kicker", "left-window"),
    *("hair-light", "double-rim", "silhouette"),
)
"""All built-in styles, in the order in which they are listed everywhere."""

RARE: Final = frozenset(
    _with_mirrors("below", "top", "left-below-side", "hair-light", "silhouette")
)
"""Built-in styles that a portrait photographer seldom wants: never proposed first."""

_MAX_USER_STYLES: Final = 200
_TURNED: Final = {"left": "right", "right": "left", "Left": "Right", "Right": "Left"}


@dataclass(frozen=True, slots=True)
class StyleLamp:
    """One studio lamp, relative to the face.

    Attributes:
        distance_m: From the point midway between the eyes, at least 2 m: nearer lamps do not act
            from one direction over the whole face.
    """

    azimuth_deg: float
    elevation_deg: float
    diameter_deg: float
    power: float
    distance_m: float

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector to the lamp in the head frame (+X sitter's left, +Y up, +Z out of the face).

        Examples:
            >>> StyleLamp(90.0, 0.0, 10.0, 1.0, 2.0).direction[0]
            1.0
        """
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        return (
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        )


@dataclass(frozen=True, slots=True)
class Style:
    """A named target look.

    Attributes:
        key_elevation_deg, key_azimuth_deg: Where one lamp alone gives it, from and to, relative to
            the face; None for a style that needs several. From a larger to a smaller azimuth it is
            the way around the back.
        key_diameter_deg: How large that lamp is; None where any is right.
    """

    name: str
    title: str
    side: Side
    place: str
    note: str
    lamps: tuple[StyleLamp, ...]
    paper: bool = False
    signature: Signature = UNSIGNED
    key_elevation_deg: tuple[float, float] | None = None
    key_azimuth_deg: tuple[float, float] | None = None
    key_diameter_deg: tuple[float, float] | None = None

    @property
    def rare(self) -> bool:
        """Whether a portrait photographer seldom wants it alone: it is never proposed first."""
        return self.name in RARE

    @property
    def side_words(self) -> str:
        """The side named twice, "sitter's left (camera right)", or the place in words."""
        return place_words(self.side, self.place)

    @property
    def full_title(self) -> str:
        """Title that tells left from right on its own: "Loop, sitter's left (camera right)"."""
        return f"{self.title}, {self.side_words}" if self.side != "none" else self.title


def mirror(style: Style) -> Style:
    """Mirror a style at the sitter's middle plane.

    Returns:
        Name, side, every lamp's azimuth, and the words left and right exchanged.
    """
    around = style.key_azimuth_deg
    sides: dict[Side, Side] = {"left": "right", "right": "left", "none": "none"}
    lamps = tuple(
        # 180 degrees is its own mirror, and 0 must not become -0.
        dataclasses.replace(lamp, azimuth_deg=-lamp.azimuth_deg)
        if lamp.azimuth_deg not in (0.0, 180.0)
        else lamp
        for lamp in style.lamps
    )
    return dataclasses.replace(
        style,
        name=mirror_name(style.name),
        title=_other_way(style.title),
        side=sides[style.side],
        place=_other_way(style.place),
        note=_other_way(style.note),
        lamps=lamps,
        signature=style.signature.mirrored,
        key_azimuth_deg=around and (-around[1] + 0.0, -around[0] + 0.0),
    )


def _other_way(words: str) -> str:
    return re.sub(r"\b(left|right|Left|Right)\b", lambda found: _TURNED[found[0]], words)


def read_style(path: Path | str) -> Style:
    """Read one style file.

    Returns:
        Checked: every number finite and in range, every key known.

    Raises:
        StyleError: With the file's name and what is wrong with it.
    """
    values = read_toml(Path(path))
    return Style(
        name=values.name,
        title=values.title,
        side=values.side,
        place=values.place,
        note=values.note,
        lamps=tuple(StyleLamp(*lamp) for lamp in values.lamps),
        paper=values.paper,
        signature=values.signature,
        key_elevation_deg=values.key_elevation_deg,
        key_azimuth_deg=values.key_azimuth_deg,
        key_diameter_deg=values.key_diameter_deg,
    )


def load_styles(user_folder: Path | None = None) -> tuple[Style, ...]:
    """Load the built-in styles and, after them, the user's own by name.

    Painted styles in the user's folder have weights and no lamps; `app.core.painting` reads them.

    Raises:
        StyleError: When a file is missing or not valid, or a user's style takes a built-in name.
    """
    built_in = _built_in()
    if user_folder is None or not user_folder.is_dir():
        return built_in
    files = [file for file in sorted(user_folder.glob("*.toml")) if not is_painted(file)]
    if len(files) > _MAX_USER_STYLES:
        raise StyleError(
            tr(
                "{folder} has {count} styles; at most {most} are read.",
                folder=user_folder,
                count=len(files),
                most=_MAX_USER_STYLES,
            ),
            tr("Move some of them elsewhere."),
        )
    for file in files:
        if file.stem in NAMES:
            raise StyleError(
                tr("{file} has the name of a built-in style.", file=file),
                tr("Give it a name of its own."),
            )
    return built_in + tuple(read_style(file) for file in files)


def _built_in() -> tuple[Style, ...]:
    """Read the built-in styles; a right one is the mirror image of its left one."""
    found: dict[str, Style] = {}
    for name in NAMES:
        twin = found.get(mirror_name(name))
        path = resources() / "styles" / f"{name}.toml"
        found[name] = read_style(path) if twin is None else mirror(twin)
    return tuple(found.values())


def select(styles: Sequence[Style], names: Iterable[str] | None) -> tuple[Style, ...]:
    """Choose styles by name.

    Args:
        names: Iterable[str] or None. Names wanted; None or none at all means every style.

    Raises:
        StyleError: When a name is unknown, with the nearest known name.
    """
    wanted = set(names or ())
    known = [style.name for style in styles]
    for name in sorted(wanted):
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = (
                tr("Did you mean {near}?", near=near[0])
                if near
                else tr("'turnlight styles' lists them all.")
            )
            raise StyleError(tr("There is no style {name!r}.", name=name), hint)
    return tuple(style for style in styles if not wanted or style.name in wanted)
