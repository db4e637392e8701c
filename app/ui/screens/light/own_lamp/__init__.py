"""A lamp of the user's own: its capture, its mask, and changes of its files."""
