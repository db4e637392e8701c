"""Photos taken at the place, and how far each was from the light."""
