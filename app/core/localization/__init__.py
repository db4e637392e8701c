"""Localization of a camera in the panorama: its heading, the sitter, views and alignment."""
