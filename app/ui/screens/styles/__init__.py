"""The Styles screen: a gallery of cards, and the detail of the chosen style."""
