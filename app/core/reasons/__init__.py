"""Reasons that help: the light that keeps a style out of reach, and the areas that show it."""
