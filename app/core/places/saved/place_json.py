"""Convert the record of a place to and from the JSON of ``place.json``, with exact floats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any, Final, get_args

from app.core.places.place import (
    LONGEST_NAME,
    LONGEST_NOTES,
    LONGEST_TAG,
    MOST_TAGS,
    UNNAMED,
    AnswerBasis,
    CaptureFacts,
    FrameFacts,
    Location,
    Place,
    PlaceError,
    PlaceSource,
)
from app.core.places.remarks import LostPart
from app.core.places.saved.result_json import (
    LONGEST_WORD,
    MOST_RESULTS,
    WORD,
    YAW,
    arc,
    result_of,
    results_to_json,
)
from app.core.places.saved.saved_cautions import cautions_of, cautions_to_json, with_cautions
from app.core.places.saved.saved_remarks import facts_of, remarks_of
from app.core.places.saved.saved_verdict import flow_of
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish, YawAsked, YawWord
from app.core.solver.style_result import StyleResult
from app.core.storage.json_file import (
    Check,
    Facts,
    Unfit,
    carry_unknown,
    entries,
    listed,
    moment,
    number,
    one_of,
    optional,
    plain,
    record,
    take,
    text,
    truth,
)
from app.core.styles.lamps import RATIO_RANGE, SIZES_DEG, Studio
from app.core.text import tr

VERSION: Final = 1
"""Version of the format of ``place.json``."""

ENVIRONMENT_NAME: Final = r"environment[A-Za-z0-9_-]{0,60}\.(exr|hdr)"
"""Pattern for the file name of an environment in a place's folder, without a path."""

_MOST_FRAMES: Final = 200
_LONGEST_SENTENCE: Final = 4000


def _time(value: Any) -> datetime:
    time = moment(value)
    # Leave a day's margin at both ends, since times are compared in UTC.
    if time.utcoffset() is None or not 1 < time.year < 9999:
        raise Unfit("a time without its offset from UTC")
    return time


def _yaw(value: Any) -> YawAsked:
    yaw: YawAsked = ASIDE(value) if isinstance(value, str) else YAW(value)
    return yaw


def _studios(value: Any) -> dict[str, Studio]:
    studios = entries(value)
    if len(studios) > MOST_RESULTS:
        raise Unfit("too many styles")
    return {WORD(name): _LAMPS(each) for name, each in studios.items()}


_ANGLE: Final = number(-360.0, 360.0)
_LIMIT: Final = number(0.0, 100.0)
_SHARE: Final = number(0.0, 1.0)
_WHITE: Final = number(1e-12, 1e12)
_TAGS: Final = listed(text(4 * LONGEST_TAG), 8 * MOST_TAGS)
_LAMPS: Final = record(
    Studio, {"softness_deg": optional(number(*SIZES_DEG)), "ratio": optional(number(*RATIO_RANGE))}
)
ASIDE: Final[Check] = one_of(*get_args(YawWord))
_LENS: Final = record(LensWish, {"yaw": _yaw, "background": optional(arc)})


def _head(value: Any) -> str:
    """Validate the name of a built-in head or the path of one of the user's own heads."""
    own = isinstance(value, str) and value.endswith(".npz")
    return text(_LONGEST_SENTENCE if own else LONGEST_WORD)(value)


# The entries of each object, in the order in which they are written.
_LOCATION: Final[dict[str, Check]] = {
    "kind": one_of("unknown", "indoor", "outdoor"),
    "sun": optional(truth),
    "sun_azimuth_deg": optional(_ANGLE),
    "sun_elevation_deg": optional(number(-90.0, 90.0)),
    "latitude_deg": optional(number(-90.0, 90.0)),
    "longitude_deg": optional(number(-180.0, 180.0)),
}
_BASIS_CHECKS: Final[dict[str, Check]] = {
    "head": _head,
    "objective": one_of("picture", "paper"),
    "match_limit": _LIMIT,
    "strength_limit": _LIMIT,
}
_FRAME: Final[dict[str, Check]] = {
    "file": text(255, r"[^/\\\0]*"),
    "shutter_s": number(0.0, 1e6),
    "iso": number(0.0, 1e8),
    "aperture": number(0.0, 1e4),
    "ev": number(-100.0, 100.0),
    "clipped_share": _SHARE,
}
_CAPTURE: Final[dict[str, Check]] = {
    "camera": WORD,
    "plan": WORD,
    "clipped_share": optional(_SHARE),
    "white_cd_m2": optional(number(0.0, 1e12)),
    "frames": listed(record(FrameFacts, _FRAME), _MOST_FRAMES),
    "warnings": remarks_of,
    "advice": remarks_of,
    "notes": remarks_of,
    "blind": _SHARE,
    "cautions": cautions_of,
}
# The check of each entry of a place, and its default.
_PLACE: Final[dict[str, tuple[Check, Any]]] = {
    "name": (text(20 * LONGEST_NAME), ""),
    "made_at": (_time, None),
    "environment": (text(80, rf"({ENVIRONMENT_NAME})?"), ""),
    "fingerprint": (text(64, "([0-9a-f]{64})?"), ""),
    "measured_at": (optional(_time), None),
    "front_deg": (_ANGLE, 0.0),
    "head": (_head, "generic"),
    "notes": (text(LONGEST_NOTES), ""),
    "tags": (_TAGS, ()),
    "location": (entries, {}),
    "asked": (optional(record(AnswerBasis, _BASIS_CHECKS)), None),
    "results": (listed(lambda each: each, MOST_RESULTS), ()),
    "before": (listed(lambda each: each, MOST_RESULTS), ()),
    "flow": (flow_of, None),
    "chosen": (optional(WORD), None),
    "needle_deg": (optional(_ANGLE), None),
    "goal_deg": (optional(_ANGLE), None),
    "capture": (optional(entries), None),
    "said_white_cd_m2": (optional(_WHITE), None),
    "spot": (WORD, ""),
    "studios": (_studios, {}),
    "lens": (_LENS, STRAIGHT),
}
_ANSWERS: Final = ("results", "before")
_REMARKS: Final = ("warnings", "advice", "notes")
_SUMMARY_KEYS: Final = ("name", "made_at", "environment", "tags", "notes")
_LAST: Final = ("location", "asked", "notes", "capture", *_ANSWERS)  # the long entries


def to_json(place: Place) -> Facts:
    """Convert a place to JSON, including unknown entries from newer versions.

    Raises:
        PlaceError: If the JSON could not be read back because the notes are too long or because a
            result is not a number.
    """
    facts = _facts_of(place)
    source = place.source
    if source is None:
        return facts
    extra: Facts = carry_unknown(facts, source.known_facts, source.file_facts)
    # Keep the higher version, since entries of a newer version are kept as well.
    extra["format_version"] = max(VERSION, version_of(source.file_facts))
    return extra


def version_of(facts: Facts) -> int:
    """Return the format version recorded in a file, or 1 if none is recorded."""
    value = facts.get("format_version")
    return value if isinstance(value, int) and 0 < value < 10**6 else VERSION


def _facts_of(place: Place) -> Facts:
    if len(place.notes) > LONGEST_NOTES:
        raise PlaceError(
            tr("The notes are too long to save: {count:,} characters.", count=len(place.notes)),
            tr(
                "The limit is {most:,}. Move some of the notes to a separate file.",
                most=LONGEST_NOTES,
            ),
        )
    order = [*(name for name in _PLACE if name not in _LAST), *_LAST]
    facts = {name: plain(getattr(place, name)) for name in order if name not in _ANSWERS}
    if place.capture is not None:
        facts["capture"] = _capture_to_json(place.capture)
    facts |= {name: results_to_json(getattr(place, name)) for name in _ANSWERS}
    return {"format_version": VERSION} | facts


def _capture_to_json(capture: CaptureFacts) -> Facts:
    # These texts come from cameras and from the program, so truncate them instead of rejecting the
    # place.
    facts = {name: plain(getattr(capture, name)) for name in _CAPTURE if name not in _REMARKS}
    for name in ("camera", "plan"):
        facts[name] = facts[name][:LONGEST_WORD]
    facts |= cautions_to_json(capture.cautions)
    facts["frames"] = facts["frames"][:_MOST_FRAMES]
    # Earlier versions reject a capture without lists of sentences.
    facts |= {name: [] for name in _REMARKS}
    return facts | {"remarks": {name: facts_of(getattr(capture, name)) for name in _REMARKS}}


def _readable(facts: Facts) -> Facts:
    """Read the remarks, if there are any, instead of the sentences saved by earlier versions."""
    facts, remarks = with_cautions(facts), facts.get("remarks")
    if not isinstance(remarks, dict):
        return facts
    return facts | {name: remarks[name] for name in _REMARKS if name in remarks}


def _read_fact(facts: Facts, name: str, bad: list[LostPart]) -> Any:
    check, default = _PLACE[name]
    return take(facts, name, check, default, bad, LostPart(name))


def summary_of(facts: Facts, bad: list[LostPart]) -> Facts:
    """Read only the entries that a list of places needs."""
    return {each: _read_fact(facts, each, bad) for each in _SUMMARY_KEYS}


def unreadable(place: Place) -> list[LostPart]:
    """Return the parts of a place that could not be read back. Usually there are none."""
    bad: list[LostPart] = []
    _decoded(_facts_of(place), bad, place.name, place.made_at)
    return bad


def place_of(facts: Facts, bad: list[LostPart], name: str, made_at: datetime) -> Place:
    """Parse a place, using defaults for missing or invalid entries."""
    place = _decoded(facts, bad, name, made_at)
    # What this version would write for an unchanged file.
    return replace(place, source=PlaceSource(facts, _facts_of(place)))


def _decoded(facts: Facts, bad: list[LostPart], name: str, made_at: datetime) -> Place:
    values: Facts = {}
    for key in _PLACE:
        values[key] = _read_fact(facts, key, bad)
        if key == "location":
            values[key] = _part(Location(), values[key], _LOCATION, bad, key)
        elif key == "capture" and values[key] is not None:
            readable = _readable(values[key])
            names = tuple(readable)
            values[key] = _part(CaptureFacts(), readable, _CAPTURE, bad, key)
            for lost in set(names) - set(readable):
                # Otherwise, it would be kept as an entry of a newer version.
                facts[key].pop(lost, None)
        elif key in _ANSWERS:
            values[key] = _results(facts, key, values[key], bad)
    values["name"] = values["name"] or name or UNNAMED
    values["made_at"] = values["made_at"] or made_at
    return Place(**values)


def _part(
    default: Location | CaptureFacts,
    facts: Facts,
    checks: dict[str, Check],
    bad_parts: list[LostPart],
    key: str,
) -> Location | CaptureFacts:
    """Read the valid entries in an object, and report the object once if any are invalid."""
    bad: list[LostPart] = []
    values = {
        name: take(facts, name, check, getattr(default, name), bad, LostPart(key))
        for name, check in checks.items()
    }
    bad_parts.extend(bad[:1])
    return replace(default, **values)


def _results(
    facts: Facts, key: str, rows: Sequence[Any], bad: list[LostPart]
) -> tuple[StyleResult, ...]:
    good, rest = [], []
    for entry in rows:
        try:
            good.append(result_of(entry))
            rest.append(entry)
        except Unfit:
            continue
    if len(rest) < len(rows):
        bad.append(LostPart(key, len(rows) - len(rest), len(rows)))
        facts[key] = rest
    return tuple(good)
