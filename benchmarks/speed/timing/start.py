"""Time the command line itself: a whole process that solves a panorama."""

from __future__ import annotations

import os
import pkgutil
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Final

import app
from app import commands
from app.core.base.errors import Cancelled, CoreError
from app.core.base.paths import resources
from benchmarks.speed.timing.runner.rows import Case

if TYPE_CHECKING:
    from collections.abc import Sequence

_SCENE: Final = "courtyard"
_STOPPED: Final = (130, -signal.SIGINT, -signal.SIGTERM)
_LIMIT_S: Final = 120.0
_ANSWER: Final = "import sys; from app.cli import main; sys.exit(main(sys.argv[1:]))"


def start_case() -> Case:
    """Return the case of ``turnlight solve`` of a bundled panorama, from process start to end.

    Returns:
        ``start.solve``. A plain program imports all of its commands first, whichever it runs; the
        limit is Python with NumPy and OpenImageIO imported, and nothing else.
    """
    scene = str(resources() / "demo" / "scenes" / f"{_SCENE}.exr")
    modules = [f"app.commands.{module.name}" for module in pkgutil.iter_modules(commands.__path__)]
    eager = f"import {', '.join(modules)}; {_ANSWER}"
    return Case(
        "start.solve",
        lambda: _run(["-c", _ANSWER, "solve", scene]),
        lambda: _run(["-c", eager, "solve", scene]),
        "all commands imported first",
        lambda: _run(["-c", "import numpy, OpenImageIO"]),
        "Python with NumPy and OpenImageIO",
        rounds=2,
        least=1,
        budget_s=0.0,
        by="process",
    )


def _run(words: Sequence[str]) -> None:
    environ = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    places = [os.path.dirname(path) for path in app.__path__]
    environ["PYTHONPATH"] = os.pathsep.join([*places, environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-P", *words],
        env=environ,
        capture_output=True,
        timeout=_LIMIT_S,
        check=False,
    )
    if done.returncode in _STOPPED:
        raise Cancelled  # Ctrl-C reaches both
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise CoreError(f"turnlight solve does not run: {said[-1] if said else 'no word'}")
