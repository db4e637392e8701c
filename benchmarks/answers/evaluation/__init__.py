"""The paper's evaluation on any environments: sizes, peaks, heads, places of the probe."""
