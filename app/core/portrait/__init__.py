"""Heads, their portraits under any light, lighting ratio, catchlights and glare.

Also the age of measured light, and its flow past the face.
"""
