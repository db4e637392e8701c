"""The way from a camera to an environment: metering, bracketing, downloading and merging."""
