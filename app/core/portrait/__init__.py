"""Heads and their portraits in any light, the lighting ratio, catchlights and glare.

The package also covers the age of measured light and the flow of light past the face.
"""
