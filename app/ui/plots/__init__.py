"""Panoramas with marks, turns around a circle, drawings of a lamp, and the guidance’s signs."""
