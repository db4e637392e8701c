"""``turnlight evaluate``: the paper's evaluation on any folder of environments, as a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.commands.clone_only import require_clone

if TYPE_CHECKING:
    import argparse


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the ``evaluate`` command to the command line.

    Raises:
        CoreError: When this Turnlight was installed without its source.
    """
    require_clone("evaluate", "evaluation")
    from benchmarks.evaluation import command

    command.add_parser(subparsers)
