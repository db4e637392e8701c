"""Heads, their portraits under any light, lighting ratio, catchlights and glare.

The age of measured light and its flow past the face are here as well.
"""
