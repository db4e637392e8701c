"""Basic controls, each with an accessible name, a focus ring, states and keyboard support."""
