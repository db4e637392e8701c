"""Turns, directions and quantities in words."""
