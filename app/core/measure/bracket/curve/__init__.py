"""The camera's tone curve, and exposures that are stated wrong."""
