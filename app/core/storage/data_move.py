"""Move the data folder of an earlier version to its new location. This happens only once."""

from __future__ import annotations

import errno
import filecmp
import json
import os
import shutil
import tempfile
from collections.abc import MutableMapping
from pathlib import Path
from typing import Any, Final

from app.core.base.atomic_files import atomic_write_bytes
from app.core.base.errors import CoreError
from app.core.base.paths import roaming_data, user_data

_OTHER_DISK: Final = 17  # Windows' ERROR_NOT_SAME_DEVICE
_SETTINGS: Final = "settings.json"


def settle_data(environ: MutableMapping[str, str] | None = None, home: Path | None = None) -> None:
    """Move the data of an earlier version on Windows from the Roaming folder to the Local folder.

    If this is not possible now, for example because an earlier version is open, ``TURNLIGHT_HOME``
    is set to make this process use the old folder.
    """
    env = os.environ if environ is None else environ
    old = roaming_data(env, home)
    if env.get("TURNLIGHT_HOME") or not old.is_dir():
        return
    try:
        has_moved = move_data(old, user_data("win32", env, home))
    except OSError:
        has_moved = False
    if not has_moved:
        env["TURNLIGHT_HOME"] = str(old)


def move_data(old: Path, new: Path) -> bool:
    """Move a data folder and return whether the new folder exists.

    The new folder appears either complete or not at all. The old folder is deleted only once the
    new one is complete.

    Raises:
        OSError: If the folder cannot be moved. In that case, nothing has changed.
    """
    if os.path.lexists(new):
        return True
    new.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.rename(old, new)
    except OSError as error:
        code = getattr(error, "winerror", None)
        if error.errno != errno.EXDEV and code != _OTHER_DISK:
            raise
        _copy(old, new)
        shutil.rmtree(old, ignore_errors=True)
    _follow(new / _SETTINGS, old, new)
    return True


def _copy(old: Path, new: Path) -> None:
    staging = Path(tempfile.mkdtemp(prefix=f".{new.name}-", dir=new.parent))
    try:
        shutil.copytree(old, staging, symlinks=True, dirs_exist_ok=True)
        if not _same(old, staging):
            raise OSError(errno.EIO, os.strerror(errno.EIO), os.fspath(new))
        os.rename(staging, new)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _same(one: Path, other: Path) -> bool:
    """Return whether the other folder contains an identical copy of every file in the first."""
    for folder, _, names in os.walk(one):
        copy = other / Path(folder).relative_to(one)
        _, unlike, missing = filecmp.cmpfiles(folder, copy, names, shallow=False)
        if unlike or missing:
            return False
    return True


def _follow(settings: Path, old: Path, new: Path) -> None:
    """Redirect the paths in the settings to the new folder."""

    def relocate(value: Any) -> Any:
        if isinstance(value, str) and Path(value).is_relative_to(old):
            return str(new / Path(value).relative_to(old))
        return value

    try:
        facts = json.loads(settings.read_text("utf-8"))
        changed = {name: relocate(value) for name, value in facts.items()}
        if changed != facts:
            atomic_write_bytes(settings, json.dumps(changed, indent=1).encode())
    except (OSError, ValueError, AttributeError, CoreError):
        return  # unreadable settings are reported when they are read
