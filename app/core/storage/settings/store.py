"""The settings: their values, reading and writing them, and the page that describes them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from app.core.base.errors import CoreError
from app.core.solver.reach import Limits
from app.core.storage.settings.json_file import Facts, keep_bad, read_json, write_json
from app.core.storage.settings.setting import SettingsError
from app.core.storage.settings.table import TABLE, setting

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from app.core.storage.settings.json_file import JsonFile
    from app.core.storage.settings.setting import Value


def _default(key: str) -> Any:
    return setting(key).default


@dataclass(frozen=True, slots=True)
class Settings:
    """A value for every line of `TABLE`; none that the table does not take.

    ``Settings()`` has all the defaults. `with_` changes one.

    Attributes
    ----------
    theme : str
        "system", "dark", "light" or "contrast".
    objective : str
        "picture" or "paper".
    plan : str
        "paper" or "full".
    mode : str
        "walk" or "selfie".
    camera_looks : str
        "ask" until the user has said it once, then "sitter" or "me".

    Raises
    ------
    SettingsError
        When a value is not one that its setting takes.

    Examples
    --------
    >>> Settings().with_("text_scale", 1.5).text_scale
    1.5
    """

    theme: str = _default("theme")
    text_scale: float = _default("text_scale")
    reduce_motion: bool = _default("reduce_motion")
    head: str = _default("head")
    sitter_name: str = _default("sitter_name")
    objective: str = _default("objective")
    match_limit: float = _default("match_limit")
    strength_limit: float = _default("strength_limit")
    plan: str = _default("plan")
    self_timer_s: int = _default("self_timer_s")
    watch_folder: str = _default("watch_folder")
    mode: str = _default("mode")
    camera_looks: str = _default("camera_looks")
    webcam: int = _default("webcam")
    camera_distance_m: float = _default("camera_distance_m")
    sounds: bool = _default("sounds")
    volume: float = _default("volume")
    places_folder: str = _default("places_folder")
    live_source: str = _default("live_source")
    live_views: str = _default("live_views")
    last_place: str = _default("last_place")
    tour_seen: bool = _default("tour_seen")
    unknown: Mapping[str, Any] = field(default_factory=dict, repr=False, hash=False)

    def __post_init__(self) -> None:
        for entry in TABLE:
            object.__setattr__(self, entry.key, entry.checked(getattr(self, entry.key)))

    @property
    def limits(self) -> Limits:
        """Least match and strength of a style in reach."""
        return Limits(self.match_limit, self.strength_limit)

    def value(self, key: str) -> Value:
        """Return the value of a setting by its key.

        Raises
        ------
        SettingsError
            When there is no such setting.
        """
        value: Value = getattr(self, setting(key).key)
        return value

    def with_(self, key: str, value: object) -> Settings:
        """Change one setting.

        Raises
        ------
        SettingsError
            When there is no such setting, or it does not take the value.
        """
        changes: dict[str, Any] = {setting(key).key: setting(key).checked(value)}
        return replace(self, **changes)

    def reset(self, section: str = "") -> Settings:
        """Set a section back to its defaults, or all that the dialog shows."""
        changes: dict[str, Any] = {
            entry.key: entry.default
            for entry in TABLE
            if entry.shown and section in ("", entry.section)
        }
        return replace(self, **changes)


DEFAULTS: Final = Settings()
"""What counts until the user says otherwise."""


FILE: Final = "settings.json"
"""Name of the file in the user's folder."""

VERSION: Final = 1
"""Of the file's form."""

_VERSION_KEY: Final = "format_version"
_MOST_BYTES: Final = 1 << 20


def read_settings(path: Path) -> tuple[Settings, tuple[str, ...]]:
    """Read the settings; whatever is wrong with the file, there are settings afterwards.

    Returns
    -------
    notes : tuple[str, ...]
        One sentence for each thing that was lost; then the bad file is kept as ``NAME.bak``.
    """
    found = read_json(path, _MOST_BYTES)
    if found.state == "missing":
        return Settings(), ()
    if found.state == "unreadable":
        return Settings(), (
            f"The settings in {path} cannot be read: {found.why}. Using default settings.",
        )
    notes = _about_file(found)
    values: dict[str, Any] = {}
    facts = dict(found.facts)
    newer = facts.pop(_VERSION_KEY, VERSION) != VERSION
    for entry in TABLE:
        if entry.key in facts:
            try:
                values[entry.key] = entry.checked(facts.pop(entry.key))
            except SettingsError as error:
                notes.append(f"{error.message} It is {entry.words(entry.default)} again.")
    settings = Settings(**values, unknown=facts)
    if notes or newer:
        kept = keep_bad(path, _MOST_BYTES)
        if kept is not None and notes:
            notes.append(f"The file as it was is kept as {kept.name}.")
    return settings, tuple(notes)


def _about_file(found: JsonFile) -> list[str]:
    if found.state == "whole":
        return []
    by_key = {entry.key: entry.title for entry in TABLE}
    lost = [f"“{by_key[key]}”" for key in found.lost if key in by_key]
    names = f" Lost: {', '.join(lost)}." if lost else ""
    if not found.facts:
        return [f"The settings could not be used: {found.why}. Using default settings."]
    return [f"A part of the settings could not be used: {found.why}.{names}"]


def write_settings(path: Path, settings: Settings) -> None:
    """Write the settings whole or not at all; only what differs from its default is in the file.

    Raises
    ------
    SettingsError
        When the disk refuses; the file is as it was.
    """
    facts: Facts = {_VERSION_KEY: VERSION}
    for entry in TABLE:
        value = settings.value(entry.key)
        if value != entry.default:
            facts[entry.key] = value
    facts |= {name: value for name, value in settings.unknown.items() if name not in facts}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, facts, _MOST_BYTES)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingsError(
            f"The settings were not saved in {path.parent}: {reason}.", "They count until you quit."
        ) from error
    except CoreError as error:
        raise SettingsError(
            f"The settings were not saved. {error.message}", "They count until you quit."
        ) from error
