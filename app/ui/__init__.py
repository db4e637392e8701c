"""The desktop app: theme, widgets, screens, and presenters without Qt."""
