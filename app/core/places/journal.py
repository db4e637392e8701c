"""The journal of a capture, which survives a power cut.

``session.json`` is written atomically before every step of a capture. It allows the capture to be
resumed with the camera, from the downloaded frames, or on another day.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeAlias

from app.core.base.atomic_files import open_file
from app.core.base.remarks import PlainRemark, Remark
from app.core.measure.plan.planner import Plan, PlannedShot
from app.core.measure.read.frame import Exposure
from app.core.places.saved.saved_remarks import facts_of, remarks_of
from app.core.storage.json_file import (
    Check,
    Unfit,
    entries,
    listed,
    number,
    one_of,
    optional,
    plain,
    record,
    text,
    truth,
    whole,
)

JOURNAL: Final = "session.json"
"""Name of the journal in the folder of a session."""

VERSION: Final = 1
"""Version of the journal's format. A file with a higher version is left untouched."""

EXPOSURE_LIMITS: Final = {
    "shutter_s": (1e-7, 1e5),
    "iso": (0.5, 1e7),
    "aperture": (0.3, 1000.0),
}
"""Smallest and largest valid values for the exposures in a journal."""

JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"

_KIND: Final = "turnlight-session"
_MAX_TEXT: Final = 4000
_MAX_ITEMS: Final = 400
_MAX_DEPTH: Final = 12
_MOST_BYTES: Final = 4 << 20
_MAX_SIZE: Final = 1 << 40
_LOCAL: Final = r"([A-Za-z0-9][A-Za-z0-9_.-]{0,99})?"
_NAME: Final = r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}"
_URL: Final = r"http://[^\s/@\\?#]{1,300}/[^\s\\]{0,2000}"


class Newer(ValueError):
    """The journal was written by a newer version."""


@dataclass(frozen=True, slots=True)
class SessionFrame:
    """A photo on the camera."""

    name: str
    url: str
    size: int = 0
    taken: str = ""
    local: str = ""
    thumbnail: str = ""
    done: bool = False
    sha256: str = ""


@dataclass(frozen=True, slots=True)
class ShotStart:
    """State of the camera before a photo is requested.

    Attributes:
        previous: URL of the newest file on the camera, or "" if there is none.
        camera_time: Time on the camera's clock, or "" if it is unknown.
    """

    previous: str
    camera_time: str


@dataclass(frozen=True, slots=True)
class SessionJournal:
    """Progress of a capture.

    Attributes:
        exposed: Whether all exposures have been made.
        shot_start: State of the camera before the photo whose URL is not in the journal yet.
        singles: Photos in a bracket that is shot one photo at a time.
        surplus: Photos from interrupted brackets, which are deleted from the camera once another
            bracket is complete.
    """

    model: str = ""
    serial: str = ""
    firmware: str = ""
    stage: str = "idle"
    metered: Exposure | None = None
    plan: Plan | None = None
    settings_to_restore: Mapping[str, JsonValue] = field(default_factory=dict)
    picture_to_delete: SessionFrame | None = None
    shot_start: ShotStart | None = None
    singles: tuple[SessionFrame, ...] = ()
    surplus: tuple[SessionFrame, ...] = ()
    previous_latest: str = ""
    command_id: str | int | None = None
    group_id: str = ""
    exposed: bool = False
    frames: tuple[SessionFrame, ...] = ()
    environment: str = ""
    started: str = ""
    finished: str = ""
    seconds: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[Remark, ...] = ()

    @property
    def owes(self) -> bool:
        """Whether settings must still be restored on the camera or photos deleted from it."""
        pictures = self.picture_to_delete is not None or (self.exposed and bool(self.surplus))
        metering = self.shot_start is not None and self.stage == "metering"
        return bool(self.settings_to_restore) or pictures or metering


def text_of(journal: SessionJournal) -> str:
    """Format a journal as JSON, inverting `journal_of`.

    Raises:
        Unfit: If a value is a password or would be rejected by `journal_of`. Every journal that is
            written can therefore be read again.
    """
    facts = {"kind": _KIND, "version": VERSION, **plain(journal)}
    facts["warnings"] = facts_of(journal.warnings)
    if journal.plan is not None:
        facts["plan"]["notes"] = facts_of(journal.plan.notes)
    text = json.dumps(facts, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
    journal_of(text)
    return text


def journal_of(data: str | bytes) -> SessionJournal:
    """Parse an untrusted journal.

    Raises:
        Newer: If the version of the journal is higher than `VERSION`.
        Unfit: If the journal is invalid.
    """
    try:
        facts = entries(json.loads(data))
    except (RecursionError, ValueError) as error:
        raise Unfit("not JSON") from error
    if facts.get("kind") != _KIND:
        raise Unfit("not the journal of a session")
    if whole(1, 1 << 30)(facts.get("version")) > VERSION:
        raise Newer
    return _JOURNAL(facts)


def keepable(settings: Mapping[str, JsonValue]) -> dict[str, JsonValue]:
    """Return the camera settings without those that a journal cannot store."""
    result: dict[str, JsonValue] = {}
    for name, value in settings.items():
        with suppress(Unfit):
            result |= _settings({name: value})
    return result


def _line(value: Any) -> str:
    """Validate a single line of text that contains no control characters."""
    line = text(_MAX_TEXT)(value)
    if not line.isprintable():
        raise Unfit("control characters")
    return line


def _remarks(value: Any) -> tuple[Remark, ...]:
    """Validate remarks whose sentences are single lines."""
    remarks = remarks_of(value)
    for each in remarks:
        if isinstance(each, PlainRemark):
            _line(each.sentence)
    return remarks


def _like(pattern: str) -> Check:
    check = text(_MAX_TEXT, pattern)
    return lambda value: check(_line(value))


def _frame(**facts: Any) -> SessionFrame:
    frame = SessionFrame(**facts)
    if frame.done and not (frame.local and frame.sha256):
        raise Unfit("a whole file without a name or a checksum")
    return frame


def _settings(value: Any) -> dict[str, JsonValue]:
    settings = entries(value)
    for name in settings:
        if not re.fullmatch(r"_?[A-Za-z][A-Za-z0-9_]{0,63}", name) or "password" in name.lower():
            raise Unfit("a setting's name that is not allowed")
    _check_setting(settings, _MAX_DEPTH)
    return settings


def _check_setting(value: Any, deepest: int) -> None:
    if deepest == 0:
        raise Unfit("nested too deeply")
    if isinstance(value, str):
        _line(value)
    elif isinstance(value, float) and not math.isfinite(value):
        raise Unfit("not a number")
    elif isinstance(value, (list, dict)):
        if len(value) > _MAX_ITEMS:
            raise Unfit("too long")
        for each in [*value, *value.values()] if isinstance(value, dict) else value:
            _check_setting(each, deepest - 1)


def _command_id(value: Any) -> str | int | None:
    whole_number = isinstance(value, int) and not isinstance(value, bool)
    return value if value is None or whole_number else _line(value)


def _seconds(value: Any) -> dict[str, float]:
    if len(entries(value)) > _MAX_ITEMS:
        raise Unfit("too many times")
    return {_line(name): number(0.0, 1e9)(time) for name, time in value.items()}


_EXPOSURE: Final = record(
    Exposure, {name: number(*limits) for name, limits in EXPOSURE_LIMITS.items()} | {"known": truth}
)
_SHOT: Final = record(
    PlannedShot,
    {"exposure": _EXPOSURE, "wanted_ev": number(-60.0, 60.0), "ev_offset": number(-60.0, 60.0)},
)
_PLAN: Final = record(
    Plan,
    {
        "kind": one_of("paper", "full"),
        "shots": listed(_SHOT, _MAX_ITEMS),
        "expected_s": number(0.0, 1e6),
        "notes": _remarks,
    },
)
_FRAME: Final = record(
    _frame,
    {
        "name": _like(_NAME),
        "url": _like(_URL),
        "size": whole(0, _MAX_SIZE),
        "taken": _line,
        "local": _like(_LOCAL),
        "thumbnail": _like(_LOCAL),
        "done": truth,
        "sha256": _like(r"([0-9a-f]{64})?"),
    },
)
_SHOT_START: Final = record(ShotStart, {"previous": _line, "camera_time": _line})
_CHECKS: Final[dict[str, Check]] = {
    "model": _line,
    "serial": _line,
    "firmware": _line,
    "stage": _like(r"[a-z][a-z-]{0,31}"),
    "metered": optional(_EXPOSURE),
    "plan": optional(_PLAN),
    "settings_to_restore": _settings,
    "picture_to_delete": optional(_FRAME),
    "shot_start": optional(_SHOT_START),
    "singles": listed(_FRAME, _MAX_ITEMS),
    "surplus": listed(_FRAME, _MAX_ITEMS),
    "previous_latest": _line,
    "command_id": _command_id,
    "group_id": _line,
    "exposed": truth,
    "frames": listed(_FRAME, _MAX_ITEMS),
    "environment": _like(_LOCAL),
    "started": _line,
    "finished": _line,
    "seconds": _seconds,
    "warnings": _remarks,
}
# Journals of earlier versions lack these entries.
_LATER: Final = frozenset({"picture_to_delete", "shot_start", "singles", "surplus"})
_JOURNAL: Final = record(SessionJournal, _CHECKS, _CHECKS.keys() - _LATER)


def journal_in(session: Path) -> SessionJournal | None:
    """Return the journal of a capture, or None if it is unreadable."""
    try:
        with open_file(session / JOURNAL) as stream:
            return journal_of(stream.read(_MOST_BYTES))
    except (OSError, Unfit, Newer):
        return None
