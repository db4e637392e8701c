"""Simulated cameras: from an HDR environment to the frames that a 360 camera would deliver."""
