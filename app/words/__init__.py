"""Sentences about results, at several lengths.

This package depends only on data from the core.
"""
