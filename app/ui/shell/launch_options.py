"""The options for starting the app, in a module that can be imported before Qt."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, slots=True)
class LaunchOptions:
    """The options with which the app starts.

    Attributes:
        scale: Device pixels per logical pixel, either 1 or 2, or None to use the screen's own
            scale.
        paths: Files or folders to open.
    """

    demo: bool = False
    screenshots: Path | None = None
    theme: Literal["dark", "light", "contrast"] | None = None
    scale: int | None = None
    paths: tuple[Path, ...] = ()
