"""Align the frames of a bracket with each other."""
