"""The right side of the Probe screen: camera, way to measure, and the capture that runs."""
