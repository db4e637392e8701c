"""Read pictures: metadata and pixels."""
