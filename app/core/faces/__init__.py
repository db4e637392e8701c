"""Faces in photos: position, pose, and the light on them."""
