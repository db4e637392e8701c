"""Screens, one per package: a presenter resolves the state and a view shows it."""
