"""Studio styles, their lamps and their style packs."""
