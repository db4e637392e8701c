"""Commands that run a tool from `benchmarks`, which is in the source tree but not in the wheel."""

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
"""Folder in `benchmarks` that each command or option uses."""


def instrument(command: str) -> ModuleType:
    """Import the module of a command from `benchmarks`.

    Raises:
        CoreError: If Turnlight was installed without its source tree.
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
    # Insert first, so that another package of the same name does not shadow this one.
    if sys.path[:1] != [str(root)]:
        sys.path.insert(0, str(root))
    return importlib.import_module(f"benchmarks.{folder.replace('/', '.')}.command")
