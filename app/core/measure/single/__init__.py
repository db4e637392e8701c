"""Estimate light from a single picture."""
