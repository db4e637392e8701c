"""From where the camera looks to what to do next, in words."""
