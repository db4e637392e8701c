"""Brackets of any camera whose pictures arrive in a folder."""
