"""A place as JSON and back, field by field."""

from __future__ import annotations

from dataclasses import fields, replace
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.storage.places.place import (
    LONGEST_NAME,
    LONGEST_NOTES,
    UNNAMED,
    Asked,
    CaptureFacts,
    FrameFacts,
    Location,
    Place,
    PlaceError,
    Source,
)
from app.core.storage.places.results import result_from_json, results_to_json
from app.core.storage.settings.json_file import (
    Facts,
    Unfit,
    carry_unknown,
    number,
    optional,
    take,
    text,
    truth,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from app.core.solver.solve import StyleResult

VERSION: Final = 1
"""Of the form of ``place.json``."""

ENVIRONMENT_NAME: Final = r"environment[A-Za-z0-9_-]{0,60}\.(exr|hdr)"
"""What an environment in a place's folder may be called; a name has no folder in it."""

_MOST_FRAMES: Final = 200
_MOST_SENTENCES: Final = 200
_MOST_RESULTS: Final = 2000
_ANGLE: Final = number(-360.0, 360.0)
_LIMIT: Final = number(0.0, 100.0)
_SHARE: Final = number(0.0, 1.0)
_WHITE: Final = number(1e-12, 1e12)
_LONGEST_WORD: Final = 200
_LONGEST_SENTENCE: Final = 4000
_WORD: Final = text(_LONGEST_WORD)
_SENTENCE: Final = text(_LONGEST_SENTENCE)


def _one_of(*words: str) -> Callable[[Any], str]:
    def check(value: Any) -> str:
        if value not in words:
            raise Unfit("an unknown word")
        return str(value)

    return check


def _time(value: Any) -> datetime:
    try:
        time = datetime.fromisoformat(text(64)(value))
    except ValueError as error:
        raise Unfit("not a time") from error
    # One day of room on both ends, since times are compared in UTC.
    if time.utcoffset() is None or not 1 < time.year < 9999:
        raise Unfit("a time without its offset from UTC")
    return time


_LOCATION: Final[dict[str, Callable[[Any], Any]]] = {
    "kind": _one_of("unknown", "indoor", "outdoor"),
    "sun": optional(truth),
    "sun_azimuth_deg": optional(_ANGLE),
    "sun_elevation_deg": optional(number(-90.0, 90.0)),
    "latitude_deg": optional(number(-90.0, 90.0)),
    "longitude_deg": optional(number(-180.0, 180.0)),
}
_ASKED: Final[dict[str, Callable[[Any], Any]]] = {
    "head": _WORD,
    "objective": _one_of("picture", "paper"),
    "match_limit": _LIMIT,
    "strength_limit": _LIMIT,
}
_FRAME: Final[dict[str, Callable[[Any], Any]]] = {
    "file": text(255, r"[^/\\\0]*"),
    "shutter_s": number(0.0, 1e6),
    "iso": number(0.0, 1e8),
    "aperture": number(0.0, 1e4),
    "ev": number(-100.0, 100.0),
    "clipped_share": _SHARE,
}


def to_json(place: Place) -> Facts:
    """Turn a place into what its file holds.

    The short entries first, so that a file that was cut off has kept them; with what a newer
    version has written beside them.
    Raises PlaceError when it could not be read again: notes that are too long, a result that is no
    number.
    """
    facts = _known(place)
    source = place.source
    if source is None:
        return facts
    carried: Facts = carry_unknown(facts, source.known, source.found)
    # The higher number stays, since what a newer version wrote stays as well.
    carried["format_version"] = max(VERSION, version_of(source.found))
    return carried


def version_of(facts: Facts) -> int:
    """Return the version of the form that a file says it has; 1 where it says nothing useful."""
    value = facts.get("format_version")
    return value if isinstance(value, int) and 0 < value < 10**6 else VERSION


def _known(place: Place) -> Facts:
    if len(place.notes) > LONGEST_NOTES:
        raise PlaceError(
            f"The notes are too long to be kept: {len(place.notes):,} letters.",
            f"At most {LONGEST_NOTES:,} fit; keep the rest in a file of its own.",
        )
    measured = place.measured_at
    return {
        "format_version": VERSION,
        "name": place.name,
        "made_at": place.made_at.isoformat(),
        "environment": place.environment,
        "fingerprint": place.fingerprint,
        "measured_at": None if measured is None else measured.isoformat(),
        "front_deg": place.front_deg,
        "head": place.head,
        "chosen": place.chosen,
        "needle_deg": place.needle_deg,
        "goal_deg": place.goal_deg,
        "said_white_cd_m2": _plain(place.said_white_cd_m2),
        "spot": place.spot,
        "location": _flat(place.location),
        "asked": None if place.asked is None else _flat(place.asked),
        "notes": place.notes,
        "capture": None if place.capture is None else _capture_to_json(place.capture),
        "results": results_to_json(place.results),
    }


def _flat(values: Location | Asked | FrameFacts) -> Facts:
    return {each.name: _plain(getattr(values, each.name)) for each in fields(values)}


def _plain(value: Any) -> Any:
    """Turn a number of numpy's into one of Python's."""
    return value.item() if isinstance(value, np.generic) else value


def _capture_to_json(capture: CaptureFacts) -> Facts:
    # These texts come from cameras and from the program: cut, rather than refused.
    return {
        "camera": capture.camera[:_LONGEST_WORD],
        "plan": capture.plan[:_LONGEST_WORD],
        "clipped_share": _plain(capture.clipped_share),
        "white_cd_m2": _plain(capture.white_cd_m2),
        "frames": [_flat(frame) for frame in capture.frames[:_MOST_FRAMES]],
        "warnings": _cut(capture.warnings),
        "advice": _cut(capture.advice),
        "notes": _cut(capture.notes),
    }


def _cut(sentences: Sequence[str]) -> list[str]:
    return [each[:_LONGEST_SENTENCE] for each in sentences[:_MOST_SENTENCES]]


def summary_of(facts: Facts, lost: list[str]) -> tuple[str, datetime | None, str]:
    """Take only what a list of places shows: name, time and environment."""
    name = take(facts, "name", text(20 * LONGEST_NAME), "", lost, "its name")
    made_at = take(facts, "made_at", _time, None, lost, "its time")
    pattern = rf"({ENVIRONMENT_NAME})?"
    environment = take(facts, "environment", text(80, pattern), "", lost, "its light")
    return name, made_at, environment


def unreadable(place: Place) -> list[str]:
    """Return what of a place would count as damaged when it is read again; mostly nothing."""
    lost: list[str] = []
    _decoded(_known(place), lost, place.name, place.made_at)
    return lost


def place_of(facts: Facts, lost: list[str], name: str, made_at: datetime) -> Place:
    """Make a place of what a file holds; what is missing or unfit has its default."""
    place = _decoded(facts, lost, name, made_at)
    # Before anything changes it: what this version would make of the very same file.
    return replace(place, source=Source(facts, _known(place)))


def _decoded(facts: Facts, lost: list[str], name: str, made_at: datetime) -> Place:
    found_name, found_time, environment = summary_of(facts, lost)
    return Place(
        name=found_name or name or UNNAMED,
        made_at=found_time or made_at,
        environment=environment,
        fingerprint=take(
            facts, "fingerprint", text(64, "([0-9a-f]{64})?"), "", lost, "the light's checksum"
        ),
        measured_at=take(
            facts, "measured_at", optional(_time), None, lost, "when the light was measured"
        ),
        front_deg=take(facts, "front_deg", _ANGLE, 0.0, lost, "where the photographer stands"),
        head=take(facts, "head", _WORD, "generic", lost, "the head"),
        notes=take(facts, "notes", text(LONGEST_NOTES), "", lost, "the notes"),
        location=_location(facts, lost),
        asked=take(
            facts, "asked", optional(_asked), None, lost, "what the results were asked with"
        ),
        results=_results(facts, lost),
        chosen=take(facts, "chosen", optional(_WORD), None, lost, "the chosen style"),
        needle_deg=take(facts, "needle_deg", optional(_ANGLE), None, lost, "the turn looked at"),
        goal_deg=take(facts, "goal_deg", optional(_ANGLE), None, lost, "the turn to go to"),
        capture=_capture(facts, lost),
        said_white_cd_m2=take(
            facts, "said_white_cd_m2", optional(_WHITE), None, lost, "how bright it is there"
        ),
        spot=take(facts, "spot", _WORD, "", lost, "the spot"),
    )


def _results(facts: Facts, lost: list[str]) -> tuple[StyleResult, ...]:
    entries = take(facts, "results", _list_of(_MOST_RESULTS), [], lost, "the results")
    good, kept = [], []
    for entry in entries:
        try:
            good.append(result_from_json(entry))
            kept.append(entry)
        except Unfit:
            continue
    if len(kept) < len(entries):
        missing = len(entries) - len(kept)
        lost.append(f"{missing} of {len(entries)} results")
        facts["results"] = kept
    return tuple(good)


def _list_of(most: int) -> Callable[[Any], list[Any]]:
    def check(value: Any) -> list[Any]:
        if not isinstance(value, list) or len(value) > most:
            raise Unfit("not a list")
        return value

    return check


def _object(value: Any) -> Facts:
    if not isinstance(value, dict):
        raise Unfit("not an object")
    return value


def _location(facts: Facts, lost: list[str]) -> Location:
    noun = "where the place is"
    entries = take(facts, "location", _object, {}, lost, noun)
    bad: list[str] = []
    values = {
        name: take(entries, name, check, getattr(Location(), name), bad, noun)
        for name, check in _LOCATION.items()
    }
    lost.extend(bad[:1])
    return Location(**values)


def _asked(value: Any) -> Asked:
    entries = _object(value)
    return Asked(**{name: check(entries.get(name)) for name, check in _ASKED.items()})


def _capture(facts: Facts, lost: list[str]) -> CaptureFacts | None:
    noun = "how the light was measured"
    entries = take(facts, "capture", optional(_object), None, lost, noun)
    if entries is None:
        return None
    bad: list[str] = []

    def part(name: str, check: Callable[[Any], Any], default: Any) -> Any:
        return take(entries, name, check, default, bad, noun)

    capture = CaptureFacts(
        camera=part("camera", _WORD, ""),
        plan=part("plan", _WORD, ""),
        frames=part("frames", _frames, ()),
        clipped_share=part("clipped_share", optional(_SHARE), None),
        white_cd_m2=part("white_cd_m2", optional(number(0.0, 1e12)), None),
        warnings=part("warnings", _sentences, ()),
        advice=part("advice", _sentences, ()),
        notes=part("notes", _sentences, ()),
    )
    lost.extend(bad[:1])
    return capture


def _frames(value: Any) -> tuple[FrameFacts, ...]:
    frames = []
    for entry in _list_of(_MOST_FRAMES)(value):
        facts = _object(entry)
        frames.append(FrameFacts(**{n: check(facts.get(n)) for n, check in _FRAME.items()}))
    return tuple(frames)


def _sentences(value: Any) -> tuple[str, ...]:
    return tuple(_SENTENCE(each) for each in _list_of(_MOST_SENTENCES)(value))
