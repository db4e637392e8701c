"""Paint target weights on the head: brush, canvas, undo, live answers and saved styles."""
