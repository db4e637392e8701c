"""Whether a camera was level."""
