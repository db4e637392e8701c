"""Plan a bracket before it is shot."""
