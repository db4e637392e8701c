"""The camera used last, saved in the user's data folder without its password.

Anyone with write access to that folder can change the file, so only local addresses in it are
accepted.
"""

from __future__ import annotations

import json
import re
from contextlib import suppress
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import atomic_write_text, make_folder
from app.core.base.errors import CoreError
from app.core.base.paths import user_data
from app.devices.errors import BadReply, DeviceError
from app.devices.theta.camera_identity import FoundCamera, described
from app.devices.theta.endpoint import Endpoint, is_near
from app.devices.theta.messages import Info
from app.devices.theta.untrusted import parse_json, table, whole, words

FILE: Final = "last-camera.json"
"""Name of the file in the user's data folder."""

_MOST_BYTES: Final = 4096
_PORTS: Final = 65535
_FORMAT: Final = 1
_LOCAL_NAME: Final = re.compile(r"[a-z0-9_-]+(?:\.(?:local|lan|home|internal|home\.arpa))?")


def remember(camera: FoundCamera, folder: Path | None = None) -> bool:
    """Save a camera for the next start.

    Returns:
        False if the camera was not saved, because the folder is not writable or the address is not
        local.
    """
    place = user_data() if folder is None else folder
    if not _may_be_tried(camera.endpoint.host):
        return False
    facts = {
        "format": _FORMAT,
        "host": camera.endpoint.host,
        "port": camera.endpoint.port,
        "model": camera.model,
        "serial": camera.serial,
    }
    try:
        make_folder(place)
        atomic_write_text(place / FILE, json.dumps(facts, indent=1) + "\n")
    except (OSError, CoreError):
        return False
    return True


def last_camera(folder: Path | None = None) -> FoundCamera | None:
    """Return the camera used last, or None if none was saved or the file is invalid."""
    place = user_data() if folder is None else folder
    try:
        if not (place / FILE).is_file():
            return None
        with (place / FILE).open("rb") as stream:
            data = stream.read(_MOST_BYTES + 1)
    except OSError:
        return None
    if len(data) > _MOST_BYTES:
        return None
    with suppress(BadReply, DeviceError):
        facts = table(parse_json(data))
        host, port = words(facts.get("host")), whole(facts.get("port"), _PORTS)
        if port and _may_be_tried(host):
            model, serial = words(facts.get("model"), 64), words(facts.get("serial"), 40)
            return described(Endpoint(host, port), "remembered", Info(model, serial_number=serial))
    return None


def _may_be_tried(host: str) -> bool:
    return is_near(host) or _LOCAL_NAME.fullmatch(host.lower()) is not None
