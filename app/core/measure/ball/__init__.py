"""Measure light with a mirror ball."""
