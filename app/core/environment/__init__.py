"""Read, repair and reduce a panorama of light."""
