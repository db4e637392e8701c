"""How a place keeps remarks and reasons, and how earlier versions did."""
