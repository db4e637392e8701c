"""Commands that run an instrument from `benchmarks`, which a clone has and a wheel has not."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Final

import app
from app.core.base.errors import CoreError
from app.core.text import tr

INSTRUMENTS: Final = {
    "bench": "speed/timing",
    "evaluate": "answers/evaluation",
    "--screenshots": "ui/screenshots",
}
"""Commands and an option, and their folders in `benchmarks`."""


def instrument(command: str) -> ModuleType:
    """Import a command from `benchmarks`.

    Raises `CoreError` when this Turnlight was installed without its source.
    """
    root, folder = Path(app.__file__).resolve().parents[1], INSTRUMENTS[command]
    if not (root / "benchmarks" / folder / "command.py").is_file():
        raise CoreError(
            tr("“{command}” is not part of the installed program.", command=command),
            tr(
                "Clone Turnlight’s source and run “python3 run.py {command}” in it.",
                command=command,
            ),
        )
    # In front: another package of that name must not take its place.
    if sys.path[:1] != [str(root)]:
        sys.path.insert(0, str(root))
    return importlib.import_module(f"benchmarks.{folder.replace('/', '.')}.command")
