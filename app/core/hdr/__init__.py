"""The light probe: a bracket of exposures in, an environment that can be trusted out."""
