"""The step for a second light."""

from app.ui.screens.light.screen import LightScreen

__all__ = ["LightScreen"]
