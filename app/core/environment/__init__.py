"""Read, repair and reduce panoramas of light."""
