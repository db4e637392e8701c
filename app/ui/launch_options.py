"""How the app is started."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class LaunchOptions:
    """How the app is started.

    Attributes
    ----------
    scale : int or None
        Pixels per logical pixel, 1 or 2; None as the screen has it.
    """

    demo: bool = False
    screenshots: Path | None = None
    theme: Literal["dark", "light", "contrast"] | None = None
    scale: int | None = None
