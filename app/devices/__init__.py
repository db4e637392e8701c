"""Cameras and their simulators: everything that speaks to something outside this machine."""
