"""Reading and writing the settings, and the page that describes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from app.core.base.errors import CoreError
from app.core.storage.settings.json_file import Facts, keep_bad, read_json, write_json
from app.core.storage.settings.setting import Setting, SettingsError
from app.core.storage.settings.table import SECTIONS, TABLE
from app.core.storage.settings.values import Settings

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.storage.settings.json_file import JsonFile

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
            f"The settings in {path} cannot be read: {found.why}. Everything is as it came.",
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
        return [f"The settings could not be used: {found.why}. Everything is as it came."]
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


def document() -> str:
    """Write docs/settings.md."""
    lines = [
        "# Settings",
        "",
        "Everything here is in one dialog (Settings, at the foot of the rail) and in one file,",
        "`settings.json` in Turnlight's folder, which holds only what differs from the defaults.",
        "A field that cannot be used gets its default again, and the file is kept beside itself as",
        "`settings.json.bak`.",
    ]
    for section in SECTIONS:
        lines += ["", f"## {section}", "", "| setting | values | default | what it does | key |"]
        lines += ["|---|---|---|---|---|"]
        lines += [_row(entry) for entry in TABLE if entry.section == section]
    return "\n".join(lines) + "\n"


def _row(entry: Setting) -> str:
    cells = (entry.title, _values(entry), entry.words(entry.default), entry.help, f"`{entry.key}`")
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _values(entry: Setting) -> str:
    if entry.kind == "toggle":
        return "on, off"
    if entry.kind == "number":
        whole = "whole numbers, " if entry.whole else ""
        return f"{whole}{entry.words(entry.minimum)} to {entry.words(entry.maximum)}"
    if entry.kind == "choice":
        known = (f"{words} (`{value}`)" for value, words in entry.choices)
        return ", ".join(known) if entry.choices else f"one of the {entry.offers}"
    return "a folder" if entry.kind == "folder" else f"text, at most {entry.longest} letters"
