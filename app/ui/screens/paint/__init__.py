"""The Paint screen: tools, canvas, and the effect of the strokes in this place."""
