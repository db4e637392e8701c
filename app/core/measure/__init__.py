"""Measure the light at a place. Each measuring method has its own package."""
