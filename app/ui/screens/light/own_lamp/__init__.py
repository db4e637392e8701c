"""Lamps captured by the user, including their capture, their masks and changes to their files."""
