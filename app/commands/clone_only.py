"""Commands that run an instrument from `benchmarks`, which a clone has and a wheel has not."""

from __future__ import annotations

import sys
from pathlib import Path

import app
from app.core.base.errors import CoreError


def require_clone(command: str, package: str) -> None:
    """Make `benchmarks` importable for a command.

    Raises:
        CoreError: When this Turnlight was installed without its source.
    """
    root = Path(app.__file__).resolve().parents[1]
    if not (root / "benchmarks" / package / "command.py").is_file():
        raise CoreError(
            f"'{command}' is not part of the installed program.",
            f"Clone Turnlight's source and run 'python3 run.py {command}' in it.",
        )
    # In front: another package of that name must not take its place.
    if sys.path[:1] != [str(root)]:
        sys.path.insert(0, str(root))
