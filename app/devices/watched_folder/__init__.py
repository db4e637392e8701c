"""Brackets of any camera whose photos arrive in a folder."""
