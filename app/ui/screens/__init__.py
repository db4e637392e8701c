"""The screens, one package each: a presenter resolves the state, and a view shows it."""
