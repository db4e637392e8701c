"""The live camera: its picture beside the goal, where it points, and how it is chosen."""
