"""Panoramas, turns around a circle, the lamp and the plan, on pyqtgraph where it fits."""
