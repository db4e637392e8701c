"""Measure the light of a place; each way of measuring is a package."""
