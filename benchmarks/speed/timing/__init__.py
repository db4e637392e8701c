"""Time the hot paths against plain code, the machine's own limit and peers, in one run."""
