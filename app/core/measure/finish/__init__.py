"""Finish a panorama: find lamps, restore the sun, mask the tripod and find doubtful answers."""
