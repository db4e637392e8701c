"""Turns, directions and quantities as text."""
