"""Move the frames of a bracket onto each other."""
