"""From a camera to an environment: metering, bracket, download and merge."""
