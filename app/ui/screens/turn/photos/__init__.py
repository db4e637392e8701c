"""Photos taken at the place, and how far each one was from the light."""
