"""Guidance through a turn, from the camera's heading to the next step."""
