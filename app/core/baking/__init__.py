"""Baking: from a head and a skin to a transport matrix. The only place that uses Mitsuba."""
