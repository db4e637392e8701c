"""Turnlight: how far to turn so that a place lights a face like a studio style."""

__version__ = "0.1.0"
