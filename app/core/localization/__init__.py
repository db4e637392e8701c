"""Localization of a camera in the panorama: headings, the sitter, views and alignment."""
