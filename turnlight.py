"""The installed command: it finds its own package, whatever else is called ``app`` where it runs.

A folder or file of that name stands before the installed one as soon as PYTHONPATH leads to it;
many name the current folder there, some without knowing, by a colon at its end.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

__all__ = ["main"]

_PACKAGE = "app"


def main() -> int:
    """Run the command line with the package that lies beside this file.

    Returns:
        Exit code.
    """
    folder = Path(__file__).resolve().parent / _PACKAGE
    spec = importlib.util.spec_from_file_location(
        _PACKAGE, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None or not (folder / "cli.py").is_file():
        sys.stderr.write(
            "turnlight: Its own files are missing, or another package of the name 'app' took "
            "their place. Install Turnlight again, into an environment of its own.\n"
        )
        return 2
    package = importlib.util.module_from_spec(spec)
    for name in [each for each in sys.modules if each.partition(".")[0] == _PACKAGE]:
        del sys.modules[name]
    sys.modules[_PACKAGE] = package
    spec.loader.exec_module(package)
    try:
        from app.cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("Stopped.\n")
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
