"""Finish a panorama: lamps, a restored sun, the tripod's mask, and doubtful answers."""
