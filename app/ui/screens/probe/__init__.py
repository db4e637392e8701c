"""The Probe screen: the panorama of a place and the ways to measure it."""
