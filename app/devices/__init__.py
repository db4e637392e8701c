"""Cameras and their simulators: all communication with hardware and the network."""
