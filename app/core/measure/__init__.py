"""Measure the light at a place. Each way of measuring is a package."""
