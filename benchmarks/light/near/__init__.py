"""Places traced at the probe and beside it, and what its answers lose there."""
