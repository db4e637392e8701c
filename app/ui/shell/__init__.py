"""The window and what starts it: commands, jobs, messages, sound, settings on the disk."""
