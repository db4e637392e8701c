"""Finish a panorama: find lamps, restore the sun, mask the tripod, report doubts."""
