"""The files in the folder of a place: light, originals, frames and photos."""
