"""Recognise and stitch pictures with two fisheye circles."""
