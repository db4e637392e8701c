"""The best position of a lamp for each style: the background search and its pictures."""
