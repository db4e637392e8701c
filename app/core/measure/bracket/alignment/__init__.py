"""Align the frames of a bracket with one another."""
