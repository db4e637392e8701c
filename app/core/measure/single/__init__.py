"""Estimate light from a single 360 photo."""
