"""Lamps that were captured in a dark room: detected, corrected, saved and placed."""
