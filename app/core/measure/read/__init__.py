"""Read the metadata and pixels of pictures."""
