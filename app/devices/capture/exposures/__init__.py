"""Metering and shooting, and cleaning up surplus photos on the camera."""
