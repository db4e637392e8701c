"""The right-hand side of the Probe screen: the camera, the way to measure and the capture."""
