"""Faces in photographs: where they are, how they are held, and what light falls on them."""
