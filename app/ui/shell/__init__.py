"""The window and its environment: commands, jobs, messages, sound and saved settings."""
