"""A well-behaved simulated camera of any model, which answers over HTTP."""
