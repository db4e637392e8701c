"""The search for the best position of a lamp for each style, and the pictures of its results."""
