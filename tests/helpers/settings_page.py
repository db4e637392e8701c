"""The page docs/settings.md, made of the table of settings.

``python -m tests.helpers.settings_page`` writes it anew.
"""

from __future__ import annotations

from pathlib import Path

from app.core.storage.settings import SECTIONS, TABLE, Setting
from app.words import settings as words

PAGE = Path(__file__).resolve().parents[2] / "docs" / "settings.md"


def document() -> str:
    """What the page should say."""
    lines = [
        "# Settings",
        "",
        "You can change these settings in the window (*Settings*, at the bottom of the rail) or in",
        "`settings.json` in Turnlight's folder, which contains only those that differ from the",
        "default. An invalid setting is reset to its default, and the original file is saved as",
        "`settings.json.bak`.",
    ]
    for section in SECTIONS:
        lines += [
            "",
            f"## {words.SECTIONS[section]}",
            "",
            "| setting | values | default | what it does | key |",
        ]
        lines += ["|---|---|---|---|---|"]
        lines += [_row(entry) for entry in TABLE if entry.section == section]
    return "\n".join(lines) + "\n"


def _row(entry: Setting) -> str:
    cells = (
        words.title(entry),
        _values(entry),
        words.value_words(entry, entry.default),
        words.explanation(entry),
        f"`{entry.key}`",
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _values(entry: Setting) -> str:
    if entry.kind == "toggle":
        return "on, off"
    if entry.kind == "number":
        whole = "whole numbers, " if entry.whole else ""
        low, high = (words.value_words(entry, end) for end in (entry.minimum, entry.maximum))
        return f"{whole}{low} to {high}"
    if entry.kind == "choice":
        known = (f"{name} (`{value}`)" for value, name in words.choices(entry))
        return ", ".join(known) if entry.choices else f"one of the {entry.offers}"
    return "a folder" if entry.kind == "folder" else f"text, at most {entry.longest} characters"


if __name__ == "__main__":
    PAGE.write_text(document(), encoding="utf-8")
