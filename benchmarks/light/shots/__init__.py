"""Shoot known light with simulated cameras."""
