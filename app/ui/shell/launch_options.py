"""The options of the app's start; imported before Qt."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, slots=True)
class LaunchOptions:
    """How the app is started.

    `scale`: Pixels per logical pixel, 1 or 2; None as the screen has it.
    `paths`: Files or folders to open.
    """

    demo: bool = False
    screenshots: Path | None = None
    theme: Literal["dark", "light", "contrast"] | None = None
    scale: int | None = None
    paths: tuple[Path, ...] = ()
