"""Styles: classic studio set-ups of lamps around the sitter, with one TOML file per style or pair.

The name of a file, without its suffix, is the style's name, as used on the command line. Built-in
styles ship with the program. Only the left style of each pair is stored, and the right one is
derived from it. The user's folder may contain additional styles. `app.core.styles.style_file` reads
the files strictly: an unknown key or a lamp inside the sitter is an error.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from app.core.base.errors import StyleError
from app.core.base.paths import resources
from app.core.styles.painted_style_file import is_painted
from app.core.styles.style import Side, Style
from app.core.styles.style_file import read_style
from app.core.text import tr


def mirror_name(name: str) -> str:
    """Return the name of the mirrored style.

    Returns:
        The name with ``left-`` and ``right-`` exchanged. Other names are their own mirror images.

    Examples:
        >>> mirror_name("left-loop-rim"), mirror_name("badger")
        ('right-loop-rim', 'badger')
    """
    for here, there in (("left-", "right-"), ("right-", "left-")):
        if name.startswith(here):
            return there + name.removeprefix(here)
    return name


def _with_mirrors(*names: str) -> tuple[str, ...]:
    """Return the names, with each left name followed by its mirror image, the right name."""
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
"""The names of the sixteen styles in the paper (E, Fried, Agrawala, UIST 2019)."""

NAMES: Final = (
    *PAPER_NAMES,
    *_with_mirrors("left-rembrandt", "left-kicker", "left-window"),
    *("hair-light", "double-rim", "silhouette"),
)
"""The names of all built-in styles, in the order used in every list."""

RARE: Final = frozenset(
    _with_mirrors("below", "top", "left-below-side", "hair-light", "silhouette")
)
"""Built-in styles that are never suggested first, since portrait photographers rarely want them."""

DEEP: Final = frozenset(
    (
        *_with_mirrors("left-rembrandt", "left-split", "left-kicker", "left-rim"),
        *("badger", "double-rim", "hair-light", "silhouette"),
    )
)
"""Built-in styles in which at least a cheek or the middle of the face lies in deep shadow."""

_MAX_USER_STYLES: Final = 200
_OTHER_SIDE: Final = {"left": "right", "right": "left", "Left": "Right", "Right": "Left"}


def mirror(style: Style) -> Style:
    """Return a style mirrored left to right.

    Returns:
        The style with its name, its side and the azimuth of every lamp mirrored, and with the words
        left and right exchanged in its texts.
    """
    around = style.key_azimuth_deg
    sides: dict[Side, Side] = {"left": "right", "right": "left", "none": "none"}
    lamps = tuple(
        # 180 degrees is its own mirror image, and 0 must not become -0.
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
    return re.sub(r"\b(left|right|Left|Right)\b", lambda match: _OTHER_SIDE[match[0]], words)


def load_styles(user_folder: Path | None = None) -> tuple[Style, ...]:
    """Load the built-in styles, followed by the user's own styles in order of name.

    Painted styles in the user's folder, which have weights instead of lamps, are skipped. They are
    read by `app.core.painting`.

    Raises:
        StyleError: If a file is missing or invalid, or a user's style has a built-in name.
    """
    built_in = _built_in()
    if user_folder is None or not user_folder.is_dir():
        return built_in
    files = [file for file in sorted(user_folder.glob("*.toml")) if not is_painted(file)]
    if len(files) > _MAX_USER_STYLES:
        raise StyleError(
            tr(
                "{folder} has {count} styles; the limit is {most}.",
                folder=user_folder,
                count=len(files),
                most=_MAX_USER_STYLES,
            ),
            tr("Move some of them to another folder."),
        )
    for file in files:
        if file.stem in NAMES:
            raise StyleError(
                tr("{file} has the name of a built-in style.", file=file),
                tr("Rename the file."),
            )
    return built_in + tuple(read_style(file) for file in files)


def _built_in() -> tuple[Style, ...]:
    """Read the built-in styles, deriving each right style from its left one."""
    styles: dict[str, Style] = {}
    for name in NAMES:
        twin = styles.get(mirror_name(name))
        path = resources() / "styles" / f"{name}.toml"
        styles[name] = read_style(path) if twin is None else mirror(twin)
    return tuple(styles.values())


def select(styles: Sequence[Style], names: Iterable[str] | None) -> tuple[Style, ...]:
    """Select styles by name.

    Args:
        names: Names to select, or None or an empty sequence for every style.

    Raises:
        StyleError: If a name is unknown. The error suggests the nearest known name.
    """
    name_set = set(names or ())
    all_names = [style.name for style in styles]
    for name in sorted(name_set):
        if name not in all_names:
            near = difflib.get_close_matches(name, all_names, n=1)
            raise StyleError(
                tr("There is no style {name!r}.", name=name),
                tr("Did you mean {near}?", near=near[0])
                if near
                else tr("'turnlight styles' lists all styles."),
            )
    return tuple(style for style in styles if not name_set or style.name in name_set)
