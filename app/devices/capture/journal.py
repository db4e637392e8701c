"""What a session remembers of a capture, as JSON that is not trusted when it is read again."""

from __future__ import annotations

import contextlib
import json
import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from app.core.hdr.frame import Exposure
from app.core.hdr.planner import Plan, PlannedShot

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

VERSION: Final = 1
"""Of the journal's form; a file with a higher one is left alone."""

EXPOSURE_LIMITS: Final = {
    "shutter_s": (1e-7, 1e5),
    "iso": (0.5, 1e7),
    "aperture": (0.3, 1000.0),
}
"""Least and largest value of an exposure that a journal holds."""

JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"

_KIND: Final = "turnlight-session"
_MAX_TEXT: Final = 4000
_MAX_ITEMS: Final = 400
_MAX_DEPTH: Final = 12
_MAX_SIZE: Final = 1 << 40
_LOCAL: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
_NAME: Final = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}")
_SHA256: Final = re.compile(r"[0-9a-f]{64}")
_STAGE: Final = re.compile(r"[a-z][a-z-]{0,31}")
_URL: Final = re.compile(r"http://[^\s/@\\?#]{1,300}/[^\s\\]{0,2000}")


class Damaged(ValueError):
    """The text is no journal, or not a whole one; the message says where it goes wrong."""


class Newer(ValueError):
    """The journal was written by a newer version of this program."""


@dataclass(frozen=True, slots=True)
class SessionFrame:
    """One picture of the camera."""

    name: str
    url: str
    size: int = 0
    taken: str = ""
    local: str = ""
    thumbnail: str = ""
    done: bool = False
    sha256: str = ""


@dataclass(frozen=True, slots=True)
class SessionJournal:
    """How far a capture has come.

    `exposed`: all exposures have been made.
    """

    model: str = ""
    serial: str = ""
    firmware: str = ""
    stage: str = "idle"
    metered: Exposure | None = None
    plan: Plan | None = None
    settings_to_restore: Mapping[str, JsonValue] = field(default_factory=dict)
    picture_to_delete: SessionFrame | None = None
    previous_latest: str = ""
    command_id: str | int | None = None
    group_id: str = ""
    exposed: bool = False
    frames: tuple[SessionFrame, ...] = ()
    environment: str = ""
    started: str = ""
    finished: str = ""
    seconds: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def owes(self) -> bool:
        """Whether the camera has not been given back as it was."""
        return bool(self.settings_to_restore) or self.picture_to_delete is not None


def text_of(journal: SessionJournal) -> str:
    """Write a journal down.

    JSON that `journal_of` reads back to an equal journal. Raises `ValueError` when a value would be
    refused on reading, or is a password: nothing is ever written that cannot be read again.
    """
    facts: dict[str, Any] = {"kind": _KIND, "version": VERSION}
    for name in SessionJournal.__slots__:
        facts[name] = _plain(getattr(journal, name))
    text = json.dumps(facts, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
    journal_of(text)
    return text


def journal_of(text: str) -> SessionJournal:
    """Read a journal that may be damaged or forged.

    Raises `Newer` when its version is higher than `VERSION`; `Damaged` for everything else that is
    not a journal.
    """
    try:
        facts = json.loads(text, parse_constant=_no_constant)
    except RecursionError:
        raise Damaged("it is nested too deeply") from None
    except ValueError as error:
        raise Damaged(str(error)) from error
    top = _Reader(facts, "the journal")
    if top.text("kind") != _KIND:
        raise Damaged("it is not the journal of a session")
    if top.whole("version", 1, 1 << 30) > VERSION:
        raise Newer("it was written by a newer version of this program")
    return SessionJournal(
        model=top.text("model"),
        serial=top.text("serial"),
        firmware=top.text("firmware"),
        stage=top.match("stage", _STAGE),
        metered=top.optional("metered", _exposure),
        plan=top.optional("plan", _plan),
        settings_to_restore=_settings(top.raw("settings_to_restore")),
        # Journals of earlier versions do not have it.
        picture_to_delete=top.optional("picture_to_delete", _frame, missing=True),
        previous_latest=top.text("previous_latest"),
        command_id=_command_id(top.raw("command_id")),
        group_id=top.text("group_id"),
        exposed=top.truth("exposed"),
        frames=tuple(_frame(each) for each in top.items("frames")),
        environment=top.match("environment", _LOCAL, empty=True),
        started=top.text("started"),
        finished=top.text("finished"),
        seconds=_seconds(top.raw("seconds")),
        warnings=tuple(_text(each, "a warning") for each in top.items("warnings")),
    )


def keepable(settings: Mapping[str, JsonValue]) -> dict[str, JsonValue]:
    """Leave out the settings of a camera that a journal cannot hold."""
    kept: dict[str, JsonValue] = {}
    for name, value in settings.items():
        with contextlib.suppress(Damaged):
            kept |= _settings({name: value})
    return kept


def _plain(value: Any) -> Any:
    """Turn the journal's dataclasses into dictionaries; everything else is JSON already."""
    if isinstance(value, (Exposure, Plan, PlannedShot, SessionFrame)):
        return {name: _plain(getattr(value, name)) for name in type(value).__slots__}
    if isinstance(value, (tuple, list)):
        return [_plain(each) for each in value]
    return dict(value) if hasattr(value, "items") else value


def _no_constant(word: str) -> None:
    raise ValueError(f"{word} is not a number")


@dataclass(frozen=True, slots=True)
class _Reader:
    """Checked access to one object of the JSON."""

    facts: Any
    where: str

    def raw(self, name: str) -> Any:
        if not isinstance(self.facts, dict):
            raise Damaged(f"{self.where} is not an object")
        if name not in self.facts:
            raise Damaged(f"{self.where} lacks {name}")
        return self.facts[name]

    def text(self, name: str) -> str:
        return _text(self.raw(name), name)

    def match(self, name: str, pattern: re.Pattern[str], *, empty: bool = False) -> str:
        text = self.text(name)
        if pattern.fullmatch(text) is None and not (empty and not text):
            raise Damaged(f"{name} of {self.where} is not valid")
        return text

    def truth(self, name: str) -> bool:
        value = self.raw(name)
        if not isinstance(value, bool):
            raise Damaged(f"{name} of {self.where} is neither true nor false")
        return value

    def whole(self, name: str, low: int, high: int) -> int:
        value = self.raw(name)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise Damaged(f"{name} of {self.where} is not a valid number")
        return value

    def number(self, name: str, low: float, high: float) -> float:
        return _number(self.raw(name), name, low, high)

    def items(self, name: str) -> Sequence[Any]:
        value = self.raw(name)
        if not isinstance(value, list) or len(value) > _MAX_ITEMS:
            raise Damaged(f"{name} of {self.where} is not a list")
        return value

    def optional(self, name: str, read: Callable[[Any], Any], *, missing: bool = False) -> Any:
        if missing and isinstance(self.facts, dict) and name not in self.facts:
            return None
        value = self.raw(name)
        return None if value is None else read(value)


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or len(value) > _MAX_TEXT:
        raise Damaged(f"{where} is not a short text")
    if not value.isprintable():
        raise Damaged(f"{where} holds control characters")
    return value


def _number(value: Any, where: str, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise Damaged(f"{where} is not a valid number")
    return float(value)


def _exposure(facts: Any) -> Exposure:
    read = _Reader(facts, "an exposure")
    return Exposure(
        read.number("shutter_s", *EXPOSURE_LIMITS["shutter_s"]),
        read.number("iso", *EXPOSURE_LIMITS["iso"]),
        read.number("aperture", *EXPOSURE_LIMITS["aperture"]),
        read.truth("known"),
    )


def _plan(facts: Any) -> Plan:
    read = _Reader(facts, "the plan")
    kind = read.text("kind")
    if kind not in ("paper", "full"):
        raise Damaged("the plan is of an unknown kind")
    known: Literal["paper", "full"] = "paper" if kind == "paper" else "full"
    shots = tuple(_shot(each) for each in read.items("shots"))
    notes = tuple(_text(each, "a note") for each in read.items("notes"))
    return Plan(known, shots, read.number("expected_s", 0.0, 1e6), notes)


def _shot(facts: Any) -> PlannedShot:
    read = _Reader(facts, "a shot")
    return PlannedShot(
        _exposure(read.raw("exposure")),
        read.number("wanted_ev", -60.0, 60.0),
        read.number("ev_offset", -60.0, 60.0),
    )


def _frame(facts: Any) -> SessionFrame:
    read = _Reader(facts, "a frame")
    frame = SessionFrame(
        name=read.match("name", _NAME),
        url=read.match("url", _URL),
        size=read.whole("size", 0, _MAX_SIZE),
        taken=read.text("taken"),
        local=read.match("local", _LOCAL, empty=True),
        thumbnail=read.match("thumbnail", _LOCAL, empty=True),
        done=read.truth("done"),
        sha256=read.match("sha256", _SHA256, empty=True),
    )
    if frame.done and not (frame.local and frame.sha256):
        raise Damaged("a frame is said to be there without a name or a checksum")
    return frame


def _settings(value: Any) -> dict[str, JsonValue]:
    if not isinstance(value, dict) or len(value) > _MAX_ITEMS:
        raise Damaged("the settings to restore are not an object")
    for name in value:
        if not re.fullmatch(r"_?[A-Za-z][A-Za-z0-9_]{0,63}", name) or "password" in name.lower():
            raise Damaged("a setting to restore has a name that is not allowed")
    _check_depth(value, _MAX_DEPTH)
    return value


def _check_depth(value: Any, left: int) -> None:
    if left == 0:
        raise Damaged("the settings to restore are nested too deeply")
    if isinstance(value, str):
        _text(value, "a setting")
    elif isinstance(value, float) and not math.isfinite(value):
        raise Damaged("a setting is not a number")
    elif isinstance(value, (list, dict)):
        if len(value) > _MAX_ITEMS:
            raise Damaged("a setting is too long")
        for each in value.values() if isinstance(value, dict) else value:
            _check_depth(each, left - 1)
        for name in value if isinstance(value, dict) else ():
            _text(name, "a setting")


def _command_id(value: Any) -> str | int | None:
    if value is None or (isinstance(value, int) and not isinstance(value, bool)):
        return value
    return _text(value, "the command's id")


def _seconds(value: Any) -> dict[str, float]:
    if not isinstance(value, dict) or len(value) > _MAX_ITEMS:
        raise Damaged("the seconds are not an object")
    return {
        _text(name, "a part"): _number(time, "a time", 0.0, 1e9) for name, time in value.items()
    }
