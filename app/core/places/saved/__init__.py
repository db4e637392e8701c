"""Format of saved remarks and reasons, now and in earlier versions."""
