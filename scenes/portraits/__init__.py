"""Baking the data of full-size portraits."""
