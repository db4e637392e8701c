"""Read and write the settings file, which several processes may share.

The file is read field by field and written atomically.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from app.core.base.atomic_files import make_folder, os_errors_as
from app.core.base.errors import CoreError
from app.core.storage.data_lock import writing
from app.core.storage.json_file import Facts, keep_bad, keep_copy, read_json, write_json
from app.core.storage.settings import (
    TABLE,
    Settings,
    SettingsError,
    SettingsNote,
    SettingValueError,
)
from app.core.text import tr

FILE: Final = "settings.json"
"""Name of the settings file in the user's data folder."""

VERSION: Final = 1
"""Version of the settings file's format."""

_VERSION_KEY: Final = "format_version"
_MOST_BYTES: Final = 1 << 20


def read_settings(path: Path) -> tuple[Settings, tuple[SettingsNote, ...]]:
    """Read the settings, replacing invalid entries with their defaults.

    Returns:
        The settings, and a note about each loss. If anything was lost, a copy of the bad file is
        kept as ``NAME.bak``.
    """
    file = read_json(path, _MOST_BYTES)
    if file.state == "missing":
        return Settings(), ()
    if file.state == "unreadable":
        return Settings(), (SettingsNote(why=file.why, unreadable=path),)
    notes = [SettingsNote(why=file.why)] if file.state == "damaged" else []
    values: dict[str, Any] = {}
    facts = _renamed(file.facts)
    newer = facts.pop(_VERSION_KEY, VERSION) != VERSION
    for entry in TABLE:
        if entry.key in facts:
            try:
                values[entry.key] = entry.check(facts.pop(entry.key))
            except SettingValueError:
                notes.append(SettingsNote(entry=entry))
    settings = Settings(**values, unknown=facts)
    if notes or newer:
        copy = keep_bad(path, _MOST_BYTES)
        if copy is not None and notes:
            notes.append(SettingsNote(copy=copy))
    return settings, tuple(notes)


def write_settings(path: Path, settings: Settings, base: Settings | None = None) -> Path | None:
    """Atomically write to the file the settings that differ from the defaults.

    Args:
        base: The settings as this process last read or wrote them. Changes that another process has
            made since then are kept unless this process has changed the same setting.

    Returns:
        The path of a copy of the file if the file contained a different value for the same setting,
        otherwise None.
    """
    with os_errors_as(
        SettingsError,
        tr("The settings were not saved in {parent}: {reason}."),
        tr("They apply until you quit."),
        parent=path.parent,
    ):
        make_folder(path.parent, private=True)
        with writing(path.parent):
            merged, clash = (settings, False) if base is None else _merged(path, settings, base)
            copy = keep_copy(path, _MOST_BYTES, "conflict") if clash else None
            try:
                write_json(path, _facts_of(merged), _MOST_BYTES)
            except CoreError as error:
                raise SettingsError(
                    tr("The settings were not saved. {message}", message=error.message),
                    tr("They apply until you quit."),
                ) from error
    return copy


def _merged(path: Path, ours: Settings, base: Settings) -> tuple[Settings, bool]:
    """Merge in the changes of another process and return whether both changed the same setting."""
    file = read_json(path, _MOST_BYTES)
    if file.state != "whole":
        return ours, False
    clash = False
    changes: dict[str, Any] = {}
    facts = _renamed(file.facts)
    for entry in TABLE:
        mine, before = ours.value(entry.key), base.value(entry.key)
        theirs = entry.default
        with contextlib.suppress(SettingsError):
            theirs = entry.check(facts.get(entry.key, entry.default))
        if mine == before:
            changes[entry.key] = theirs
        elif theirs not in (before, mine) and entry.key != "last_place":
            clash = True
    keys = {_VERSION_KEY, *(entry.key for entry in TABLE)}
    unknown = {name: value for name, value in facts.items() if name not in keys}
    return replace(ours, **changes, unknown={**unknown, **ours.unknown}), clash


def _renamed(facts: Facts) -> Facts:
    """Replace the names that settings had in earlier versions with the current ones."""
    current = dict(facts)
    objective = current.pop("objective", None)
    if objective == "paper":
        current.setdefault("paper_mode", True)
    return current


def _facts_of(settings: Settings) -> Facts:
    facts: Facts = {_VERSION_KEY: VERSION}
    for entry in TABLE:
        value = settings.value(entry.key)
        if value != entry.default:
            facts[entry.key] = value
    facts |= {name: value for name, value in settings.unknown.items() if name not in facts}
    return facts
