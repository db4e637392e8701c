"""The window and what surrounds it: commands, jobs, messages, sound and saved settings."""
