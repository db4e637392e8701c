"""The steps from a panorama to the best turn: light transport, search, grading and choice."""
