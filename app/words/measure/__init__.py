"""The words of measured light."""
