"""Basic controls, each with an accessible name, a focus ring, its states and keyboard support."""
