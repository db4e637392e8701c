"""A film of a turning sitter: how the camera went around, and the light that the face shows."""
