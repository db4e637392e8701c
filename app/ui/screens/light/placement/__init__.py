"""Where a lamp belongs for every style: the search in the background, and its pictures."""
