"""Compute the transport matrix of a head and a skin tone. Only this package uses Mitsuba."""
