"""Angles, colour, files, images, errors and progress, shared by all packages in core."""
