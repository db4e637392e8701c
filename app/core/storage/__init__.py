"""Settings, libraries, JSON files and folder locks."""
