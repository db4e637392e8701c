"""The reason why the chosen style is soft or out of reach."""
