"""Turning the sitter: numbers and words, headings, views of the panorama, alignment, sounds."""
