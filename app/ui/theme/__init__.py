"""The theme of the app: colours, fonts, icons and the look of Qt's own widgets."""

from __future__ import annotations

from app.ui.theme.style import apply
from app.ui.theme.theme import Colours, Theme, ThemeName, px, set_theme, theme

__all__ = ["Colours", "Theme", "ThemeName", "apply", "px", "set_theme", "theme"]
