"""The second light: lamps held near the head, and where to hold them (eq. 7 of the paper)."""
