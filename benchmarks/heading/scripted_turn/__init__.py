"""A scripted photographer turns a sitter in the demo location, by what a phone sees of it."""
