"""Compute the transport matrix of a head and a skin tone; only this package uses Mitsuba."""
