"""A scripted photographer turns a sitter in the demo location, guided by a phone's view."""
