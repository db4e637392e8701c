"""Brackets from any camera whose photos arrive in a folder."""
