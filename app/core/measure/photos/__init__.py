"""Build a panorama from photos taken all around."""
