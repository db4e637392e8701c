"""Recognise and stitch unstitched 360 pictures."""
