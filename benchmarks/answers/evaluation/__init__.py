"""The paper's evaluation on any environments: sizes, peaks, heads, positions of the probe."""
