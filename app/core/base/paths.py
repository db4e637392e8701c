"""Locate shipped resources and the user's data folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from app.core.base.catalogue import tr
from app.core.base.errors import CoreError

_PACKAGE = Path(__file__).resolve().parents[2]


def resources(package: Path = _PACKAGE) -> Path:
    """Return the folder that contains the heads, styles, transports and demo scenes.

    In a clone the folder is ``resources/``, next to the package. In an installed wheel it is
    ``_resources/``, inside the package.

    Raises:
        CoreError: If neither folder exists, because the installation is damaged.
    """
    # Try the wheel's folder first, since "resources" beside an installed package may belong to
    # another package.
    for folder in (package / "_resources", package.parent / "resources"):
        if folder.is_dir():
            return folder
    raise CoreError(
        tr(
            "The program's own files are missing (no 'resources' folder at {folder}).",
            folder=package.parent,
        ),
        tr("Reinstall Turnlight."),
    )


def user_data(
    platform: str = sys.platform,
    environ: Mapping[str, str] | None = None,
    home: Path | None = None,
) -> Path:
    """Return the folder for the user's styles and settings, without creating it.

    The environment variable ``TURNLIGHT_HOME`` overrides the default, which is ``turnlight`` in the
    platform's usual location: ``%LOCALAPPDATA%`` on Windows, ``~/Library/Application Support`` on
    macOS, and ``$XDG_DATA_HOME`` or ``~/.local/share`` elsewhere.
    """
    env = os.environ if environ is None else environ
    if env.get("TURNLIGHT_HOME"):
        return Path(env["TURNLIGHT_HOME"])
    base = Path.home() if home is None else home
    if platform == "win32":
        # Not Roaming, since photos of people must not be copied to a company's servers.
        return Path(env.get("LOCALAPPDATA") or base / "AppData" / "Local") / "turnlight"
    if platform == "darwin":
        return base / "Library" / "Application Support" / "turnlight"
    return Path(env.get("XDG_DATA_HOME") or base / ".local" / "share") / "turnlight"


def roaming_data(environ: Mapping[str, str] | None = None, home: Path | None = None) -> Path:
    """Return the data folder that earlier versions used on Windows, which may not exist."""
    env = os.environ if environ is None else environ
    base = Path.home() if home is None else home
    return Path(env.get("APPDATA") or base / "AppData" / "Roaming") / "turnlight"
