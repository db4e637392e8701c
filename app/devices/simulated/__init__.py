"""Simulated cameras that answer over HTTP, as awkward as the real ones."""
