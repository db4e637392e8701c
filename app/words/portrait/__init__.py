"""The words of heads, of the light on a face, and of its age."""
