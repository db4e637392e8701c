"""The Turn screen."""

from app.ui.screens.turn.screen import TurnScreen

__all__ = ["TurnScreen"]
