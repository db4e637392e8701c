"""Baking the data of the portraits that the app draws at full size."""
