"""From a panorama to the turn: transport, styles, search and answer."""
