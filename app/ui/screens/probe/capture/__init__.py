"""The right-hand side of the Probe screen: camera, way to measure and running capture."""
