"""The Styles screen: a gallery of cards, and the detail of the chosen style."""

from app.ui.screens.styles.screen import StylesScreen

__all__ = ["StylesScreen"]
