"""Measure the light of a place, one package per way."""
