"""Measure the light at a place. Each way of measuring has its own package."""
