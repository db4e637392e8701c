"""How the app is started."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["Wishes"]


@dataclass(frozen=True, slots=True)
class Wishes:
    """How the app is started.

    Attributes
    ----------
    demo : bool
        With the imitation camera, webcam and the demo location.
    screenshots : Path or None
        Folder for pictures of every screen; the app ends when they are made.
    theme : {"dark", "light", "contrast"} or None
        In place of the setting.
    scale : int or None
        Pixels per logical pixel, 1 or 2; None as the screen has it.
    """

    demo: bool = False
    screenshots: Path | None = None
    theme: Literal["dark", "light", "contrast"] | None = None
    scale: int | None = None
