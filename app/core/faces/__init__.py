"""Faces in photos: their position, their pose and the light on them."""
