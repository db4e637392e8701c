"""Places: one folder per place and time, with its light, its results and the user's files."""
