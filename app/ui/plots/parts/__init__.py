"""The building blocks of plots: items, marks, layers and geometry."""
