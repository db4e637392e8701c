"""Plots painted by hand: turns around a circle, panoramas with marks, and the guidance's signs."""
