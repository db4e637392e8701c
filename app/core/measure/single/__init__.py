"""Estimate the light from a single 360 photo."""
