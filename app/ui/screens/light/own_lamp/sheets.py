"""What the sheets about a captured lamp ask."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

from app.ui.screens.light.own_lamp.mask import MaskEdit

WordsWish: TypeAlias = Literal["rename", "distance", "lux"]
"""What is asked about a captured lamp."""


@dataclass(frozen=True, slots=True)
class WordsAsk:
    """A line that is asked for about a captured lamp."""

    wish: WordsWish
    title: str
    label: str
    button: str
    text: str = ""
    example: str = ""


@dataclass(frozen=True, slots=True)
class CaptureAsk:
    """How a lamp is captured, and what can be made one now."""

    guide: tuple[str, ...]
    other: str = ""
    place: str = ""
    name: str = ""


class LampSheets(Protocol):
    """Shows sheets about a captured lamp."""

    def ask_capture(self, ask: CaptureAsk) -> None:
        """Explain how to capture a lamp; the answer goes to `LampList.capture`."""

    def ask_pictures(self) -> None:
        """Ask for the photos of a lamp; the answer goes to `LampList.take`."""

    def ask_words(self, ask: WordsAsk) -> None:
        """Ask for a line; the answer goes to `LampActions.answer`."""

    def say(self, sentence: str) -> None:
        """Show in the sheet what is wrong with its answer; an empty sentence closes it."""

    def ask_mask(self, edit: MaskEdit) -> None:
        """Open the sheet in which the mask is painted."""
