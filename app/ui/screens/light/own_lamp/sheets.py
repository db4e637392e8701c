"""The questions that the sheets ask about a captured lamp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

from app.ui.screens.light.own_lamp.mask import MaskEdit

WordsWish: TypeAlias = Literal["rename", "distance", "lux"]
"""The values of a captured lamp that can be edited as text."""


@dataclass(frozen=True, slots=True)
class WordsAsk:
    """A question that asks for one value of a captured lamp as text."""

    wish: WordsWish
    title: str
    label: str
    button: str
    text: str = ""
    example: str = ""


@dataclass(frozen=True, slots=True)
class CaptureAsk:
    """Instructions for capturing a lamp, and the sources that are currently available."""

    guide: tuple[str, ...]
    other: str = ""
    place: str = ""
    name: str = ""


class LampSheets(Protocol):
    """A view that opens sheets about a captured lamp."""

    def ask_capture(self, ask: CaptureAsk) -> None:
        """Explain how to capture a lamp, and pass the answer to `LampList.capture`."""

    def ask_pictures(self) -> None:
        """Ask for photos of a lamp, and pass them to `LampList.take`."""

    def ask_words(self, ask: WordsAsk) -> None:
        """Ask for a line of text, and pass the text to `LampActions.answer`."""

    def say(self, sentence: str) -> None:
        """Show an error in the open sheet, or close the sheet if the sentence is empty."""

    def ask_mask(self, edit: MaskEdit) -> None:
        """Open the sheet for painting the mask."""
