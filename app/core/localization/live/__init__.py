"""Follow a live camera from picture to picture."""
