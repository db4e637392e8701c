"""Photos taken at the place: how far each was from the light."""
