"""A good simulated camera, of any model, that answers over HTTP."""
