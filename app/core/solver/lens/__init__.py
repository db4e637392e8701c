"""Turn and yaw of the face: the search for the position of the lens."""
