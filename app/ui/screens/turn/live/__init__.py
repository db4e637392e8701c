"""The live camera: its picture beside the goal, its heading, and the choice of source."""
