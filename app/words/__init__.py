"""Every sentence about a result, at the length that is asked for; it knows core's data only."""
