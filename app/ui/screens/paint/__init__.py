"""The Paint screen: tools, canvas, and what the strokes change in this place."""
