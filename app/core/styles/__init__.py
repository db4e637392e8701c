"""Studio styles, their lamps and their packs."""
