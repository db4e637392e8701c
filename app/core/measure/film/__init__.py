"""Measure the light from a video of a turning sitter."""
