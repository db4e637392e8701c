"""The record of a place, and its JSON; floats are exact."""

from __future__ import annotations

import json
import math
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, get_args

import numpy as np

from app.core.base.angles import TURNS, wrap
from app.core.base.arrays import Float64
from app.core.base.errors import CoreError
from app.core.base.remarks import Remark
from app.core.base.visible_text import STEERING
from app.core.places.remarks import LostPart
from app.core.places.saved.saved_reasons import sentence_of, shortfall_of
from app.core.places.saved.saved_remarks import facts_of, remarks_of
from app.core.portrait.head_views import MOST_YAW_DEG
from app.core.solver.lens_search import LIGHTINGS, STRAIGHT, LensWish, YawAsked, YawWord
from app.core.solver.shortfall import Shortfall
from app.core.solver.solve import Gain, PeakResult, StyleResult
from app.core.solver.style_signature import GRADES
from app.core.solver.turn_choice import LIMITS, Objective
from app.core.storage.json_file import (
    Check,
    Facts,
    Unfit,
    carry_unknown,
    clean,
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
    whole,
)
from app.core.styles.lamps import RATIO_RANGE, SIZES_DEG, Studio
from app.core.styles.styles import NAMES, RARE
from app.core.text import tr

if TYPE_CHECKING:
    from app.core.solver.place_light import PlaceLight

Kind: TypeAlias = Literal["unknown", "indoor", "outdoor"]

LONGEST_NAME: Final = 120
LONGEST_NOTES: Final = 100_000
LONGEST_TAG: Final = 32
MOST_TAGS: Final = 12
UNNAMED: Final = "Unnamed place"


class PlaceError(CoreError):
    """A place cannot be found, read or saved."""


@dataclass(frozen=True, slots=True)
class Location:
    """Sky and sun of a place, for the age of its light."""

    kind: Kind = "unknown"
    sun: bool | None = None  # whether the sun shines on the place; None where it is not known
    # sun_azimuth_deg, sun_elevation_deg: where the sun stood in the panorama when it was captured;
    # azimuth from the panorama's own centre column, positive clockwise from above, whatever
    # `Place.front_deg` is
    sun_azimuth_deg: float | None = None
    sun_elevation_deg: float | None = None
    # latitude_deg, longitude_deg: on the earth, north and east positive; None where the camera
    # does not know
    latitude_deg: float | None = None
    longitude_deg: float | None = None


@dataclass(frozen=True, slots=True)
class AnswerBasis:
    """Settings of the results of a place."""

    head: str = "generic"
    objective: Objective = "picture"
    match_limit: float = LIMITS.match
    strength_limit: float = LIMITS.strength


@dataclass(frozen=True, slots=True)
class FrameFacts:
    """One frame of the bracket."""

    file: str
    shutter_s: float
    iso: float = 0.0
    aperture: float = 0.0
    ev: float = 0.0  # relative to the metered exposure, stops; positive is brighter
    clipped_share: float = 0.0  # share of the panorama that is too bright for the frame, 0 to 1


@dataclass(frozen=True, slots=True)
class CaptureFacts:
    """How the light was measured."""

    camera: str = ""
    # "paper", "full", "files" (a bracket that was opened), "rough" (one photograph), "panorama"
    # (an HDR file), "film", "ball" or "photos"
    plan: str = ""
    frames: tuple[FrameFacts, ...] = ()
    # share of the light's energy in clipped areas, 0 to 1; None where it was not measured
    clipped_share: float | None = None
    # luminance of radiance 1, cd/m2; None where the scale is only relative
    white_cd_m2: float | None = None
    warnings: tuple[Remark, ...] = ()
    advice: tuple[Remark, ...] = ()
    notes: tuple[Remark, ...] = ()
    # names of the styles whose answer depends on what is clipped
    doubtful: tuple[str, ...] = ()
    # share of the sphere that nothing shows, 0 to 1
    blind: float = 0.0
    # names of the styles whose answer depends on what was not seen
    doubtful_unseen: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class PlaceSource:
    """A place's file as read, to preserve entries of newer versions."""

    file_facts: Facts
    known_facts: Facts
    version: str = ""  # of the file, as `read_json` states it


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A place: the light of one spot and time, with its answers.

    Texts are cleaned of what a file or a screen cannot hold, and angles are wrapped, so that what
    is in memory is what will be read again.

    Raises ValueError when a number is not finite, or a time has no offset from UTC.
    """

    name: str
    made_at: datetime
    # name of the environment in the place's folder, as `store_environment` gave it; "" while no
    # light was measured
    environment: str = ""
    fingerprint: str = ""
    measured_at: datetime | None = None
    front_deg: float = 0.0  # panorama azimuth at which the photographer stands, deg
    head: str = "generic"
    notes: str = ""
    tags: tuple[str, ...] = ()  # labels of the user's own, each at most once
    location: Location = field(default_factory=Location)
    asked: AnswerBasis | None = None  # what `results` were asked with; None where there are none
    results: tuple[StyleResult, ...] = field(default=(), repr=False)
    # what it was answered by an earlier rule, if it was
    before: tuple[StyleResult, ...] = field(default=(), repr=False)
    chosen: str | None = None
    # turn that is looked at, deg; None = the best of the chosen style
    needle_deg: float | None = None
    goal_deg: float | None = None  # turn that is gone to, deg
    capture: CaptureFacts | None = field(default=None, repr=False)
    # luminance of radiance 1 as the user has stated it, cd/m2; it counts before the capture's
    said_white_cd_m2: float | None = None
    # the same for captures of the same spot at different times; "" for a spot of its own
    spot: str = ""
    # lamps by the name of a style, for all others by ""; as in the paper where neither is there
    studios: Mapping[str, Studio] = field(default_factory=dict)
    # where the lens may stand; its background in azimuths of the panorama
    lens: LensWish = STRAIGHT
    remarks: tuple[Remark, ...] = ()
    source: PlaceSource | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        changes: dict[str, Any] = {
            "name": clean_name(self.name),
            "notes": clean_notes(self.notes),
            "tags": clean_tags(self.tags),
            "front_deg": _turn(self.front_deg),
            "needle_deg": None if self.needle_deg is None else _turn(self.needle_deg),
            "goal_deg": None if self.goal_deg is None else _turn(self.goal_deg),
        }
        for time in (self.made_at, self.measured_at):
            if time is not None and time.utcoffset() is None:
                raise ValueError("the time of a place needs its offset from UTC")
        for name, value in changes.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True, slots=True, eq=False)
class OpenPlace:
    """A place in memory, with its light.

    Attributes:
        folder: None where it could not be saved.
        files: Originals that are not in a folder of its own yet.
        trouble: Why it could not be saved.
    """

    folder: Path | None
    place: Place
    light: PlaceLight
    files: tuple[Path, ...] = ()
    trouble: Exception | None = None


def clean_name(name: str) -> str:
    """Clean the name of a place: one line of at most 120 letters, never empty.

    Examples:
        >>> clean_name("  Café   de la Paix "), clean_name("")
        ('Café de la Paix', 'Unnamed place')
    """
    spaced = " ".join(name[: 20 * LONGEST_NAME].split())
    line = clean(unicodedata.normalize("NFC", clean(spaced)))[:LONGEST_NAME]
    return " ".join(line.split()) or UNNAMED


def clean_tags(tags: Iterable[str]) -> tuple[str, ...]:
    """Clean the tags of a place: short, unique regardless of case, and limited in number.

    Examples:
        >>> clean_tags(["  north   light ", "", "North light", "brick"])
        ('north light', 'brick')
    """
    result: dict[str, str] = {}
    for tag in tags:
        if short := clean_name(tag[:LONGEST_NAME])[:LONGEST_TAG].strip() if tag.strip() else "":
            result.setdefault(short.casefold(), short)
    return tuple(result.values())[:MOST_TAGS]


def clean_notes(notes: str) -> str:
    """Remove control characters except line ends and tabs."""
    ends = notes.replace("\r\n", "\n").replace("\r", "\n")
    return "".join(c for c in ends if c in "\n\t" or ord(c) not in STEERING)


def _turn(angle_deg: float) -> float:
    if not math.isfinite(angle_deg):
        raise ValueError("an angle of a place is not a number")
    return wrap(float(angle_deg))


VERSION: Final = 1
"""Of the form of ``place.json``."""

ENVIRONMENT_NAME: Final = r"environment[A-Za-z0-9_-]{0,60}\.(exr|hdr)"
"""What an environment in a place's folder may be called; a name has no folder in it."""

_MOST_FRAMES: Final = 200
_MOST_SENTENCES: Final = 200
_MOST_RESULTS: Final = 2000
_LONGEST_WORD: Final = 200
_LONGEST_SENTENCE: Final = 4000


def _time(value: Any) -> datetime:
    time = moment(value)
    # One day of room on both ends, since times are compared in UTC.
    if time.utcoffset() is None or not 1 < time.year < 9999:
        raise Unfit("a time without its offset from UTC")
    return time


def _arc(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise Unfit("an arc is not a pair")
    return _TURN(value[0]), _TURN(value[1])


def _curve(value: Any) -> Float64:
    if not isinstance(value, list) or len(value) != TURNS:
        raise Unfit(f"a curve has not {TURNS} turns")
    if not all(type(each) in (float, int) and math.isfinite(each) for each in value):
        raise Unfit("a curve holds something else than numbers")
    curve = np.array(value, np.float64)
    curve.flags.writeable = False
    return curve


def _yaw(value: Any) -> YawAsked:
    yaw: YawAsked = _ASIDE(value) if isinstance(value, str) else _YAW(value)
    return yaw


def _studios(value: Any) -> dict[str, Studio]:
    studios = entries(value)
    if len(studios) > _MOST_RESULTS:
        raise Unfit("too many styles")
    return {_WORD(name): _LAMPS(each) for name, each in studios.items()}


_ANGLE: Final = number(-360.0, 360.0)
_TURN: Final = number(-180.0, 180.0)
_LIMIT: Final = number(0.0, 100.0)
_SHARE: Final = number(0.0, 1.0)
_NUMBER: Final = number(-1e300, 1e300)
_WHITE: Final = number(1e-12, 1e12)
_WORD: Final = text(_LONGEST_WORD)
_TAGS: Final = listed(text(4 * LONGEST_TAG), 8 * MOST_TAGS)
_LAMPS: Final = record(
    Studio, {"softness_deg": optional(number(*SIZES_DEG)), "ratio": optional(number(*RATIO_RANGE))}
)
_YAW: Final = number(-MOST_YAW_DEG, MOST_YAW_DEG)
_ASIDE: Final[Check] = one_of(*get_args(YawWord))
_LENS: Final = record(LensWish, {"yaw": _yaw, "background": optional(_arc)})
_SENTENCES: Final = listed(text(_LONGEST_SENTENCE), _MOST_SENTENCES)


def _head(value: Any) -> str:
    """Check for the name of a head, or the path of one's own."""
    own = isinstance(value, str) and value.endswith(".npz")
    return text(_LONGEST_SENTENCE if own else _LONGEST_WORD)(value)


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
    "camera": _WORD,
    "plan": _WORD,
    "clipped_share": optional(_SHARE),
    "white_cd_m2": optional(number(0.0, 1e12)),
    "frames": listed(record(FrameFacts, _FRAME), _MOST_FRAMES),
    "warnings": remarks_of,
    "advice": remarks_of,
    "notes": remarks_of,
    "doubtful": _SENTENCES,
    "blind": _SHARE,
    "doubtful_unseen": _SENTENCES,
}
_PEAK: Final[dict[str, Check]] = {
    "turn_deg": _TURN,
    "turn_refined_deg": _TURN,
    "quality": _NUMBER,
    "match": _NUMBER,
    "strength": _NUMBER,
    "arc_deg": _arc,
}
_GAIN: Final[dict[str, Check]] = {
    "lighting": one_of(*LIGHTINGS),
    "turn_deg": _TURN,
    "yaw_deg": _YAW,
    "match": _NUMBER,
}
_RESULT: Final[dict[str, Check]] = {
    "name": _WORD,
    "title": _WORD,
    "side": _WORD,
    "turn_index": whole(0, TURNS - 1),
    "turn_deg": _TURN,
    "turn_refined_deg": _TURN,
    "direction": one_of("clockwise", "counter-clockwise", "none"),
    "quality": _NUMBER,
    "match": _NUMBER,
    "strength": _NUMBER,
    "attainable": truth,
    "arc_deg": _arc,
    "peaks": listed(record(PeakResult, _PEAK), TURNS),
    "quality_curve": _curve,
    "match_curve": _curve,
    "strength_curve": _curve,
    "grade": optional(one_of(*GRADES)),
    "looks_more_like": optional(_WORD),
    "same_picture": listed(_WORD, _MOST_RESULTS),
    "neighbour": optional(_WORD),
    "yaw_deg": _YAW,
    "yaw_arc_deg": _arc,
    "lighting": one_of(*LIGHTINGS),
    "gains": listed(record(Gain, _GAIN), len(LIGHTINGS)),
}
_NEW: Final = frozenset(
    {
        *("grade", "looks_more_like", "same_picture", "neighbour"),
        *("yaw_deg", "yaw_arc_deg", "lighting", "gains"),
    }
)
# Data, and the sentences that earlier versions kept in its place.
_WHY: Final[dict[str, Check]] = {
    "cause": optional(shortfall_of),
    "reason": optional(sentence_of),
    "shortfall": optional(sentence_of),
}
# What each entry of a place may be, and what it is when it is missing.
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
    "results": (listed(lambda each: each, _MOST_RESULTS), ()),
    "before": (listed(lambda each: each, _MOST_RESULTS), ()),
    "chosen": (optional(_WORD), None),
    "needle_deg": (optional(_ANGLE), None),
    "goal_deg": (optional(_ANGLE), None),
    "capture": (optional(entries), None),
    "said_white_cd_m2": (optional(_WHITE), None),
    "spot": (_WORD, ""),
    "studios": (_studios, {}),
    "lens": (_LENS, STRAIGHT),
}
_ANSWERS: Final = ("results", "before")
_REMARKS: Final = ("warnings", "advice", "notes")
_SUMMARY_KEYS: Final = ("name", "made_at", "environment", "tags", "notes")
_LAST: Final = ("location", "asked", "notes", "capture", *_ANSWERS)  # the long ones


def _result(
    cause: Shortfall | None = None,
    reason: Shortfall | None = None,
    shortfall: Shortfall | None = None,
    **values: Any,
) -> StyleResult:
    return StyleResult(**values, shortfall=cause or reason or shortfall)


result_of: Final = record(_result, _RESULT | _WHY, _RESULT.keys() - _NEW)
"""Check for a result; its curves are (64,) float64, read-only."""


def to_json(place: Place) -> Facts:
    """Convert a place to JSON, with unknown entries of newer versions.

    Raises PlaceError when it could not be read again: notes that are too long, a result that is
    not a number.
    """
    facts = _facts_of(place)
    source = place.source
    if source is None:
        return facts
    extra: Facts = carry_unknown(facts, source.known_facts, source.file_facts)
    # The higher number stays, since what a newer version wrote stays as well.
    extra["format_version"] = max(VERSION, version_of(source.file_facts))
    return extra


def version_of(facts: Facts) -> int:
    """Return the version of the form that a file says it has; 1 where it says nothing useful."""
    value = facts.get("format_version")
    return value if isinstance(value, int) and 0 < value < 10**6 else VERSION


def _facts_of(place: Place) -> Facts:
    if len(place.notes) > LONGEST_NOTES:
        raise PlaceError(
            tr("The notes are too long to be kept: {count:,} letters.", count=len(place.notes)),
            tr("At most {most:,} fit; keep the rest in a file of its own.", most=LONGEST_NOTES),
        )
    order = [*(name for name in _PLACE if name not in _LAST), *_LAST]
    facts = {name: plain(getattr(place, name)) for name in order if name not in _ANSWERS}
    if place.capture is not None:
        facts["capture"] = _capture_to_json(place.capture)
    facts |= {name: results_to_json(getattr(place, name)) for name in _ANSWERS}
    return {"format_version": VERSION} | facts


def _capture_to_json(capture: CaptureFacts) -> Facts:
    # These texts come from cameras and from the program: cut, rather than refused.
    facts = {name: plain(getattr(capture, name)) for name in _CAPTURE if name not in _REMARKS}
    for name in ("camera", "plan"):
        facts[name] = facts[name][:_LONGEST_WORD]
    for name in ("doubtful", "doubtful_unseen"):
        facts[name] = [each[:_LONGEST_SENTENCE] for each in facts[name][:_MOST_SENTENCES]]
    facts["frames"] = facts["frames"][:_MOST_FRAMES]
    # Earlier versions refuse a capture without lists of sentences.
    facts |= {name: [] for name in _REMARKS}
    return facts | {"remarks": {name: facts_of(getattr(capture, name)) for name in _REMARKS}}


def _with_remarks(facts: Facts) -> Facts:
    """Put the remarks in the place of the sentences that earlier versions kept."""
    remarks = facts.get("remarks")
    if not isinstance(remarks, dict):
        return facts
    return facts | {name: remarks[name] for name in _REMARKS if name in remarks}


def results_to_json(results: Sequence[StyleResult]) -> list[Facts]:
    """Turn results into what JSON can hold; raises PlaceError when a number is infinite or none."""
    rows = [_result_to_json(result) for result in results]
    for facts in rows:
        try:
            json.dumps(facts, allow_nan=False)
        except ValueError as error:
            raise PlaceError(
                tr("The result for {name} is not a number and was not kept.", name=facts["name"])
            ) from error
    return rows


def _result_to_json(result: StyleResult) -> Facts:
    facts = {name: plain(getattr(result, name)) for name in _RESULT}
    # Earlier versions refuse a result without this entry.
    return facts | {"cause": plain(result.shortfall), "reason": None}


def _read_fact(facts: Facts, name: str, bad: list[LostPart]) -> Any:
    check, default = _PLACE[name]
    return take(facts, name, check, default, bad, LostPart(name))


def summary_of(facts: Facts, bad: list[LostPart]) -> Facts:
    """Read the entries for a list of places."""
    return {each: _read_fact(facts, each, bad) for each in _SUMMARY_KEYS}


def answers_of(facts: Facts) -> tuple[int, int, str]:
    """Return the number of styles in reach, of all styles, and the one to propose.

    Skips whatever cannot be read: it is only for a list of places.
    """
    results = facts.get("results")
    rows = [row for row in results if isinstance(row, dict)] if isinstance(results, list) else []

    def merit(row: Facts) -> tuple[bool, bool, float]:
        match = row.get("match")
        match_value = match if isinstance(match, float) and math.isfinite(match) else 0.0
        return str(row.get("name")) not in RARE, bool(row.get("grade") == "yes"), match_value

    there = [row for row in rows if row.get("attainable") is True]
    title = max(there, key=merit).get("title") if there else ""
    return len(there), len(rows), clean_name(title) if isinstance(title, str) and title else ""


def unreadable(place: Place) -> list[LostPart]:
    """Return the parts of a place that could not be read again; usually none."""
    bad: list[LostPart] = []
    _decoded(_facts_of(place), bad, place.name, place.made_at)
    return bad


def place_of(facts: Facts, bad: list[LostPart], name: str, made_at: datetime) -> Place:
    """Parse a place; missing or invalid entries get defaults."""
    place = _decoded(facts, bad, name, made_at)
    # Before anything changes it: what this version would make of the very same file.
    return replace(place, source=PlaceSource(facts, _facts_of(place)))


def _decoded(facts: Facts, bad: list[LostPart], name: str, made_at: datetime) -> Place:
    values: Facts = {}
    for key in _PLACE:
        values[key] = _read_fact(facts, key, bad)
        if key == "location":
            values[key] = _part(Location(), values[key], _LOCATION, bad, key)
        elif key == "capture" and values[key] is not None:
            values[key] = _part(CaptureFacts(), _with_remarks(values[key]), _CAPTURE, bad, key)
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
    """Take what is fit of an object; it is listed once, whatever was lost of it."""
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


def by_the_rule_before(place: Place) -> bool:
    """Return whether the results of a place predate grades."""
    return any(result.name in NAMES and result.grade is None for result in place.results)
