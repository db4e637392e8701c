"""Find the camera's tone curve and any wrongly recorded exposures."""
