"""Turnlight finds how far to turn for a place to light a face like a studio style."""

__version__ = "0.1.0"
