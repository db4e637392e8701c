"""The desktop app: its theme, widgets and screens, and presenters that do not use Qt."""
