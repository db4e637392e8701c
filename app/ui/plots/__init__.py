"""Plots of panoramas, turns, lamps and the walk, drawn with pyqtgraph where possible."""
