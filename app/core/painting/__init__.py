"""Painting target weights on the head: brush, canvas, undo, live answers, and styles to keep."""
