"""The Ricoh Theta models, and the exposure settings that each accepts."""
