"""What one setting is: its words, its kind, and which values it takes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.storage.settings.json_file import clean

Kind: TypeAlias = Literal["choice", "number", "toggle", "text", "folder"]
Value: TypeAlias = str | float | bool

_LONGEST_PATH: Final = 4096


class SettingsError(CoreError):
    """A setting is unknown, takes no such value, or cannot be kept."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One line of the table of settings."""

    key: str
    title: str
    section: str
    kind: Kind
    default: Value
    help: str
    # tuple of (str, str), values of a choice and the words for them; empty where `offers` says who
    # knows them
    choices: tuple[tuple[str, str], ...] = ()
    # whose values the dialog is to offer: "heads" for the heads that are there; "" for none
    offers: str = ""
    minimum: float = 0.0
    maximum: float = 0.0
    step: float = 1.0
    whole: bool = False
    # of a number, as written after it; a space goes in between unless it is "°" or "×"
    unit: str = ""
    longest: int = 80
    empty_means: str = ""
    shown: bool = True

    def checked(self, value: object) -> Value:
        """Return a value as the program uses it.

        Raises SettingsError when the setting does not take this value; the sentence says which it
        takes.
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
        raise SettingsError(f"“{self.title}” {self.takes()}.")

    def takes(self) -> str:
        """Say which values the setting takes, to go on the sentence "“Title” ..." with."""
        if self.kind == "toggle":
            return "is on or off"
        if self.kind == "number":
            whole = "a whole number " if self.whole else ""
            return f"goes from {whole}{self.words(self.minimum)} to {self.words(self.maximum)}"
        if self.kind == "choice" and self.choices:
            return "is one of: " + ", ".join(words for _, words in self.choices)
        if self.kind == "folder":
            return "is a folder with its whole path, or empty"
        return f"is a text of at most {self.longest} letters"

    def words(self, value: Value) -> str:
        """Write a value as the dialog shows it.

        Examples
        --------
        >>> Setting("k", "K", "S", "number", 1.8, "", minimum=1, maximum=9, unit="m").words(1.8)
        '1.8 m'
        """
        if isinstance(value, bool):
            return "on" if value else "off"
        if isinstance(value, str):
            return dict(self.choices).get(value, value) or self.empty_means
        # Rounded only to be shown; an exact whole number is written without a point.
        digits = f"{value:.2f}".rstrip("0").rstrip(".").replace("-", "−")
        return digits + ("" if self.unit in ("", "°", "×") else " ") + self.unit

    def _is_choice(self, value: str) -> bool:
        if self.choices:
            return any(value == key for key, _ in self.choices)
        return bool(value) and value == clean(value) and len(value) <= self.longest

    def _number(self, value: object) -> float:
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            inside = self.minimum <= value <= self.maximum and math.isfinite(value)
            if inside and (not self.whole or value == int(value)):
                return int(value) if self.whole else float(value)
        raise SettingsError(f"“{self.title}” {self.takes()}.")

    def _text(self, value: str) -> str:
        line = clean(value)
        folder = self.kind == "folder"
        # A relative folder would mean another one at each start.
        fits = not line or _is_absolute(line) if folder else len(line) <= self.longest
        if not fits or len(line) > _LONGEST_PATH or (folder and line != value.strip()):
            raise SettingsError(f"“{self.title}” {self.takes()}.")
        return line


def _is_absolute(path: str) -> bool:
    # Of either kind, so that settings can be carried from one computer to another.
    drive = len(path) > 2 and path[0].isalpha() and path[1] == ":" and path[2] in "\\/"
    return path.startswith(("/", "\\\\")) or drive
