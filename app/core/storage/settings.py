"""The settings, in a single table for the dialog, the file and docs/settings.md.

Each setting is a field of `Settings`. Its text is in `app.words.settings`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.solver.turn_choice import Objective
from app.core.storage.json_file import clean
from app.core.styles.lamps import (
    AS_PUBLISHED,
    RATIO_KEYS,
    SIZE_KEYS,
    Studio,
    parse_ratio,
    parse_softness,
)
from app.core.text import tr

Kind: TypeAlias = Literal["choice", "number", "toggle", "text", "folder"]
Value: TypeAlias = str | float | bool

_LONGEST_PATH: Final = 4096

_SECTIONS: Final = {
    "theme": "looks",
    "head": "sitter",
    "paper_mode": "answers",
    "plan": "capture",
    "mode": "turning",
    "sounds": "sound",
    "places_folder": "files",
    "live_source": "remembered",
}
"""Sections, keyed by their first setting. The dialog does not show the last section."""


class SettingsError(CoreError):
    """A setting is unknown or invalid, or cannot be saved."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One row in the table of settings. Its text is in `app.words.settings`.

    Attributes:
        choices: Values to choose from, or an empty tuple if `offers` names their source.
        offers: Source of the values in the dialog, such as "heads" for the available heads.
        unit: Unit of a number, separated from the number by a space unless it is "°" or "×".
    """

    key: str
    section: str
    kind: Kind
    default: Value
    choices: tuple[str, ...] = ()
    offers: str = ""
    minimum: float = 0.0
    maximum: float = 0.0
    step: float = 1.0
    whole: bool = False
    unit: str = ""
    longest: int = 80
    visible: bool = True

    def check(self, value: object) -> Value:
        """Validate a value and return it.

        Raises:
            SettingValueError: If the value is invalid for this setting.
        """
        if self.kind == "number":
            return self._number(value)
        if self.kind == "toggle":
            if isinstance(value, bool):
                return value
        elif isinstance(value, str):
            if self.kind == "choice" and self._is_choice(value):
                return value
            if self.kind != "choice":
                return self._text(value)
        raise SettingValueError(self)

    def _is_choice(self, value: str) -> bool:
        if self.choices:
            return value in self.choices
        # The user's own head is identified by its path.
        longest = _LONGEST_PATH if value.endswith(".npz") else self.longest
        return bool(value) and value == clean(value) and len(value) <= longest

    def _number(self, value: object) -> float:
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            inside = self.minimum <= value <= self.maximum and math.isfinite(value)
            if inside and (not self.whole or value == int(value)):
                return int(value) if self.whole else float(value)
        raise SettingValueError(self)

    def _text(self, value: str) -> str:
        line = clean(value)
        folder = self.kind == "folder"
        # A relative path could mean a different folder at each start.
        fits = not line or _is_absolute(line) if folder else len(line) <= self.longest
        if not fits or len(line) > _LONGEST_PATH or (folder and line != value.strip()):
            raise SettingValueError(self)
        return line


def _is_absolute(path: str) -> bool:
    # Accept POSIX and Windows paths, so that settings can be moved between computers.
    drive = len(path) > 2 and path[0].isalpha() and path[1] == ":" and path[2] in "\\/"
    return path.startswith(("/", "\\\\")) or drive


class SettingValueError(SettingsError):
    """A value is invalid. `app.words.settings.takes` describes the valid values."""

    def __init__(self, entry: Setting) -> None:
        super().__init__(tr("Invalid value for the setting {key!r}.", key=entry.key))
        self.entry = entry


@dataclass(frozen=True, slots=True)
class SettingsNote:
    """A note about a loss while reading the settings.

    Attributes:
        why: The problem with the file.
        unreadable: The file, if the system denies access to it.
        entry: The setting that was reset to its default.
        copy: The copy of the original file.
    """

    why: str = ""
    unreadable: Path | None = None
    entry: Setting | None = None
    copy: Path | None = None


def _line(
    default: Value,
    kind: Kind = "text",
    *,
    choices: tuple[str, ...] = (),
    within: tuple[float, float] = (0.0, 0.0),
    **more: object,
) -> Any:
    """Declare a field of `Settings`. Its kind follows from the default and the choices.

    Args:
        within: Minimum and maximum of a number.
        more: Additional fields of `Setting`.
    """
    if isinstance(default, bool):
        kind = "toggle"
    elif not isinstance(default, str):
        kind = "number"
    elif choices or "offers" in more:
        kind = "choice"
    about: dict[str, object] = {"kind": kind, "default": default, "choices": choices}
    about |= {"minimum": within[0], "maximum": within[1], "whole": type(default) is int}
    return field(default=default, metadata=about | more)


@dataclass(frozen=True, slots=True)
class Settings:
    """A valid value for every setting, in the order of the dialog.

    ``Settings()`` contains all the defaults, and `with_` changes one value. An invalid value raises
    `SettingsError`.

    Examples:
        >>> Settings().with_("text_scale", 1.5).text_scale
        1.5
    """

    theme: str = _line("dark", choices=("system", "dark", "light", "contrast"))
    text_scale: float = _line(1.0, within=(1.0, 2.0), step=0.05, unit="×")
    reduce_motion: bool = _line(False)
    head: str = _line("generic", offers="heads")
    hair: str = _line("short", choices=("short", "long", "plain"))
    behind: str = _line("place", choices=("place", "grey"))
    sitter_name: str = _line("", longest=80)
    paper_mode: bool = _line(False)
    lamp_size: str = _line("paper", choices=SIZE_KEYS)
    lamp_ratio: str = _line("none", choices=RATIO_KEYS)
    plan: str = _line("full", choices=("paper", "full"))
    self_timer_s: int = _line(5, within=(0.0, 10.0), unit="s")
    measure_with: str = _line("camera", choices=("camera", "film", "ball", "photos", "file"))
    mirrored: bool = _line(False)
    watch_folder: str = _line("", "folder")
    mode: str = _line("walk", choices=("walk", "selfie"))
    camera_looks: str = _line("ask", choices=("ask", "sitter", "me"))
    webcam: int = _line(0, within=(0.0, 15.0))
    camera_distance_m: float = _line(1.8, within=(0.5, 10.0), step=0.1, unit="m")
    sounds: bool = _line(True)
    volume: float = _line(70.0, within=(0.0, 100.0), step=5.0, unit="%")
    voice: bool = _line(False)
    places_folder: str = _line("", "folder")
    live_source: str = _line("", longest=2000)
    live_views: str = _line("", longest=4000)
    own_head: str = _line("", longest=_LONGEST_PATH)
    last_place: str = _line("", longest=4096)
    card_width: int = _line(0, within=(0.0, 440.0))
    same_exposure: bool = _line(False)
    show_numbers: bool = _line(False)
    tour_seen: bool = _line(False)
    unknown: Mapping[str, Any] = field(default_factory=dict, repr=False, hash=False)

    def __post_init__(self) -> None:
        for entry in TABLE:
            object.__setattr__(self, entry.key, entry.check(getattr(self, entry.key)))

    @property
    def objective(self) -> Objective:
        """The rule by which turns are chosen."""
        return "paper" if self.paper_mode else "picture"

    @property
    def studios(self) -> dict[str, Studio]:
        """Studio lamps for new places, as in `Place.studios`."""
        studio = Studio(parse_softness(self.lamp_size), parse_ratio(self.lamp_ratio))
        return {} if studio == AS_PUBLISHED else {"": studio}

    @property
    def looks(self) -> tuple[str, bool]:
        """The hair of the head, and whether the place is shown behind the head."""
        return self.hair, self.behind == "place"

    def value(self, key: str) -> Value:
        """Return the value of a setting by its key."""
        value: Value = getattr(self, setting(key).key)
        return value

    def with_(self, key: str, value: object) -> Settings:
        """Return a copy of the settings with one value changed."""
        changes: dict[str, Any] = {setting(key).key: setting(key).check(value)}
        return replace(self, **changes)

    def reset(self) -> Settings:
        """Return a copy in which every setting shown in the dialog has its default value."""
        changes: dict[str, Any] = {each.key: each.default for each in TABLE if each.visible}
        return replace(self, **changes)


def _table() -> Iterator[Setting]:
    section = ""
    for each in fields(Settings):
        section = _SECTIONS.get(each.name, section)
        if each.metadata:
            visible = section != "remembered"
            yield Setting(each.name, section=section, visible=visible, **each.metadata)


TABLE: Final = tuple(_table())
"""All settings, in the order of the dialog."""

SECTIONS: Final[tuple[str, ...]] = tuple(dict.fromkeys(entry.section for entry in TABLE))
"""All sections, in the order of the dialog."""

_BY_KEY: Final = {entry.key: entry for entry in TABLE}


def setting(key: str) -> Setting:
    """Return the row of the table that has the given key.

    Raises:
        SettingsError: If there is no such setting.
    """
    if key not in _BY_KEY:
        raise SettingsError(tr("There is no setting {key!r}.", key=key))
    return _BY_KEY[key]
