"""Find the camera's tone curve and wrongly stated exposures."""
