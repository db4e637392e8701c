"""Cautions about a measurement, and the styles whose answers depend on it."""
