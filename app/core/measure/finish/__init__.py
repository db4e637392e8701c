"""Finish a panorama: lamps, sun, tripod, doubts."""
