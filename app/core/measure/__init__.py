"""Measure the light of a place from what a photographer has."""
