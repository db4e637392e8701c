"""The steps from a panorama to the best turn: transport, search, grades and choice."""
