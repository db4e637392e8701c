"""A well-behaved simulated camera of any model that answers over HTTP."""
