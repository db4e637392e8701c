"""Timing the hot paths beside plain code, the machine's own limit and peers, in one run."""
