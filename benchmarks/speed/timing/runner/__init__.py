"""Run timings and compare them with their limits."""
