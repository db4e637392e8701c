"""Measure light from a film of a turning sitter."""
