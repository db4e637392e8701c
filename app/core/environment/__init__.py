"""Read, repair and reduce HDR panoramas."""
