"""From the camera to the environment: metering, bracketing, downloading and merging."""
