"""Metering and shooting, and the pictures that this leaves on the camera."""
