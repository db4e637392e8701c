"""Pictures labelled by blind readers: how they are chosen, drawn and read, and what was read."""
