"""Heads, their portraits under any light, lighting ratio, catchlights and glare.

The lighting ratio, where the light comes from and how strongly, whether a lamp shines into the
sitter's eyes, how old the light is, and how a second capture lies on the first.
"""
