"""``turnlight bench``: how fast the hot paths are here, beside plain code, limits and peers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.commands.clone_only import require_clone

if TYPE_CHECKING:
    import argparse


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the ``bench`` command to the command line.

    Raises:
        CoreError: When this Turnlight was installed without its source.
    """
    require_clone("bench", "timing")
    from benchmarks.timing import command

    command.add_parser(subparsers)
