"""The Paint screen: tools, canvas, and what the strokes come to in this place."""

from app.ui.screens.paint.screen import PaintScreen

__all__ = ["PaintScreen"]
