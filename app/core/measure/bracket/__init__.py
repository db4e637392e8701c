"""Merge a bracket of exposures into one HDR panorama."""
