"""Build a panorama from photos taken in all directions."""
