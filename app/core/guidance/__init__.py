"""From the camera's heading to the next step of a turn."""
