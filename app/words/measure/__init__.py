"""Sentences about measured light."""
