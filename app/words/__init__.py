"""Sentences about results, at several lengths; this package depends only on data from the core."""
