"""The desktop app: theme, widgets, screens, and presenters that know nothing of Qt."""
