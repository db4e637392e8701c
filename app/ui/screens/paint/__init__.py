"""The Paint screen: the tools, the canvas, and the effect of the strokes at this place."""
