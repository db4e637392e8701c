"""Lamps captured by the user: capture, mask and changes to their files."""
