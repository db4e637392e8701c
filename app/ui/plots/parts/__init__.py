"""What plots are made of: items, marks, layers and their geometry."""
