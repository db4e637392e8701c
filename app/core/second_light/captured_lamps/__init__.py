"""Lamps captured in a dark room: how they are detected, corrected, saved and placed."""
