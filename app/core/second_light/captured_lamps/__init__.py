"""Lamps that were captured in a dark room: found, corrected, saved and placed."""
