"""Merge a bracket of exposures into a single HDR panorama."""
