"""Subcommands, one per module, each with ``add_arguments`` and ``run``."""
