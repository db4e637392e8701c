"""The search for the position of the lens, given by the turn and the yaw of the face."""
