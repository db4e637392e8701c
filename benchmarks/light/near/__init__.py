"""What a camera that stood beside the head gives away, in places traced at both positions."""
