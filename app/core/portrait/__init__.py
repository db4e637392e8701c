"""Heads, their portraits under any light, and what a portrait at a turn needs to know.

The lighting ratio, where the light comes from and how strongly, whether a lamp shines into the
sitter's eyes, how old the light is, and how a second capture lies on the first.
"""
