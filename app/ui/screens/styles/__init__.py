"""The Styles screen: a gallery of cards, and the details of the chosen style."""
