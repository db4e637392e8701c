"""Arguments, output and errors shared by all commands."""
