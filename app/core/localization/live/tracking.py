"""Track the heading from picture to picture.

`track` takes a picture and the `Track` of the previous picture. While tracking, only the area
around the last heading is searched. After three pictures without a heading, the whole panorama is
searched. A heading that does not follow from the last one must be *seen twice*, unless the picture
leaves no doubt and nothing contradicts it, or a picture of another direction confirms it
(`app.core.localization.live.several_frames`). Until then, it is only likely. The results are
steadied (`app.core.localization.live.temporal_filters`), with the background behind the sitter as a
single value: a camera that only pans changes the heading and the sitter's angle in opposite
directions, but not the turn.

A picture without a heading has no number. The display decides how long the old number stays
(`app.core.guidance.guide` keeps it for a second).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.angles import difference, wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.guidance.who_moves import Mode
from app.core.localization.features import HeadingIndex
from app.core.localization.heading import UNSURE, Heading, find_heading
from app.core.localization.heading_conversion import (
    Looks,
    assumed_fov,
    offset_angle,
    turn_of_heading,
)
from app.core.localization.live.background_texture import background_of
from app.core.localization.live.several_frames import (
    Clue,
    agreement,
    carried_on,
    remember,
)
from app.core.localization.live.temporal_filters import (
    STILL,
    Company,
    Leash,
    Steady,
    Stillness,
    Width,
    read,
    steadied,
    update_company,
    watch,
)
from app.core.localization.sitter import Sitter, background_mask, find_sitter

Status: TypeAlias = Literal["lost", "searching", "tracking"]

_LEASH: Final = Leash(0.95, 4.0)  # degrees; a heading's jitter is 0.1 to 0.3
_PATIENCE: Final = 3  # pictures without a heading before everything is searched
_FORGET_S: Final = 2.0  # after that time, a camera may point anywhere
_STEP_DEG: Final = 8.0  # how far a heading may be from its prediction,
_STEP_PER_S: Final = 45.0  # and how much more for each second since
_CERTAIN: Final = 0.9
_CONFIDENCE_S: Final = 0.4
_CHECK_S: Final = 0.5  # between two comparisons of a heading that is already confirmed
_LEAST_CLUE: Final = 0.05  # confidence of a heading that another picture may confirm
_CONFIRMED: Final = 0.9  # confidence of a doubtful heading that another picture confirms
_CARRIED: Final = 0.8  # confidence of a heading that is carried on from earlier pictures
_NO_SITTER: Final = 0.7  # factor for the confidence: the sitter may be anywhere in the picture


@dataclass(frozen=True, slots=True)
class Seeing:
    """The functions that analyse a picture. Tests and simulations replace them."""

    heading: Callable[..., Heading] = find_heading
    sitter: Callable[[Bytes, float, Sitter | None], Sitter | None] = find_sitter


SEEING: Final = Seeing()
"""The program's own functions for analysing pictures."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackMemory:
    """The state that is kept between pictures and not displayed.

    Attributes:
        steady: Azimuths of the heading and of the background behind the sitter, (2,), in degrees,
            unwrapped, or None if unknown.
        misses: Number of pictures since the last heading.
        rival: Heading that awaits confirmation, in degrees, and its time in seconds, or None if
            there is no such heading.
        clues: Headings of earlier pictures, certain or doubtful.
        checked_s: Time of the last comparison with them, in seconds.
        confirmed_s: Time at which they last confirmed the current heading, in seconds, or None.
    """

    steady: Steady | None = None
    misses: int = 0
    rival: tuple[float, float] | None = None
    clues: tuple[Clue, ...] = ()
    checked_s: float = -math.inf
    confirmed_s: float | None = None
    width: Width = field(default_factory=Width)
    company: Company = field(default_factory=Company)
    stillness: Stillness = STILL


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The tracked heading, starting with `LOST`.

    Attributes:
        status: ``tracking`` if there is a heading, ``searching`` if there was a heading or if one
            awaits confirmation, or ``lost`` if no heading was found.
        heading_deg: Steadied panorama azimuth of the camera's axis, in degrees within (-180, 180],
            or None unless tracking.
        raw: Result of the last picture, or None before the first picture.
        sitter: The sitter or another person in the picture, or None if the picture shows nobody.
        confidence: Probability that the turn is right to within 3 degrees, 0 to 1. It is lower if
            no person is reliably detected, and 0 unless tracking.
        fov_deg: The camera's horizontal field of view, in degrees, either given or estimated, or
            None if unknown.
        left_behind: Whether the camera was left behind while the photographer walks.
        background_deg: Steadied panorama azimuth of the background behind the sitter, in degrees
            within (-180, 180], or None unless tracking.
    """

    status: Status = "lost"
    heading_deg: float | None = None
    raw: Heading | None = None
    sitter: Sitter | None = None
    confidence: float = 0.0
    fov_deg: float | None = None
    left_behind: bool = False
    since_s: float = 0.0
    background_deg: float | None = None
    memory: TrackMemory = field(default_factory=TrackMemory, repr=False)

    @property
    def confirmed(self) -> bool:
        """Whether pictures at least 10 degrees apart agree on the heading."""
        return self.status == "tracking" and self.memory.confirmed_s is not None

    @property
    def pending(self) -> bool:
        """Whether another search would provide more information, even on the same picture.

        True while a heading awaits confirmation, and until everything has been searched.
        """
        return self.memory.rival is not None or 0 < self.memory.misses <= _PATIENCE

    def turn_deg(
        self, looks: Looks = Looks.SITTER, mode: Mode = Mode.WALK, front_deg: float = 0.0
    ) -> float | None:
        """Return the sitter's turn, in degrees within (-180, 180], or None unless tracking."""
        if self.heading_deg is None:
            return None
        behind = self.heading_deg if self.background_deg is None else self.background_deg
        return turn_of_heading(
            self.heading_deg,
            looks=looks,
            mode=mode,
            sitter_deg=difference(behind, self.heading_deg),
            front_deg=front_deg,
        )


LOST: Final = Track()
"""The track before the first picture."""


def track(
    frame: Bytes,
    index: HeadingIndex,
    fov_deg: float | None,
    state: Track,
    now_s: float,
    *,
    sees_sitter: bool = True,
    asked_deg: float | None = None,
    seeing: Seeing = SEEING,
) -> Track:
    """Update the track with a new picture.

    Args:
        frame: (H, W, 3) uint8. sRGB picture, not mirrored.
        fov_deg: The camera's horizontal field of view, in degrees, or None to estimate it.
        state: Track after the previous picture.
        now_s: Time of the picture, in seconds from any origin.
        sees_sitter: Whether the person in the picture is the sitter (see
            `app.core.localization.heading_conversion.sees_sitter`). A person never counts as
            background.
        asked_deg: Distance to the light, in degrees, as in
            `app.core.localization.live.temporal_filters.watch`, or None if no turn is requested.
    """
    memory = state.memory
    lens_deg = memory.width.known_deg if fov_deg is None else fov_deg
    guess = lens_deg or memory.width.likely_deg or assumed_fov((frame.shape[1], frame.shape[0]))
    company = _company(frame, guess, state, now_s, seeing)
    memory = replace(memory, company=company)
    search_deg = None if fov_deg is None and _width_due(memory, now_s) else lens_deg
    match = _look(frame, index, search_deg, memory, now_s, sees_sitter, seeing)
    heading, memory = _checked(
        match, frame, guess, replace(state, memory=memory), now_s, sees_sitter
    )
    is_shown = match.heading_deg is not None and heading.heading_deg == match.heading_deg
    if search_deg is None and is_shown:
        memory = replace(memory, width=read(memory.width, match.fov_deg, now_s))
    stillness = watch(
        memory.stillness,
        frame,
        now_s,
        asked_deg=asked_deg,
        heading_deg=heading.heading_deg,
        sitter=company.latest,
    )
    memory = replace(memory, stillness=stillness)
    state = replace(
        state,
        raw=heading,
        sitter=company.sitter,
        left_behind=stillness.left_behind,
        fov_deg=memory.width.likely_deg if fov_deg is None else fov_deg,
        memory=memory,
    )
    return _judge(heading, state, now_s, sees_sitter)


def missed(state: Track, now_s: float) -> Track:
    """Update the track after a picture without a heading."""
    misses = state.memory.misses + 1
    steady = state.memory.steady
    recently = steady is not None and now_s - steady.time_s <= _FORGET_S
    confirmed_s = state.memory.confirmed_s if recently else None
    memory = replace(state.memory, misses=misses, rival=None, confirmed_s=confirmed_s)
    status: Status = "searching" if recently else "lost"
    return _without_heading(replace(state, memory=memory), status, now_s)


# -- looking ---------------------------------------------------------------------------------------


def _look(
    frame: Bytes,
    index: HeadingIndex,
    fov_deg: float | None,
    memory: TrackMemory,
    now_s: float,
    sees_sitter: bool,
    seeing: Seeing,
) -> Heading:
    near, sitter = _near(memory, now_s), memory.company.sitter
    angle = _sitter_deg(sitter, fov_deg or assumed_fov((frame.shape[1], frame.shape[0])))
    mask = None if sitter is None else background_mask(sitter, frame.shape[:2])
    away = not sees_sitter
    return seeing.heading(
        frame, index, fov_deg, near_deg=near, sitter_deg=angle, mask=mask, away=away
    )


def _width_due(memory: TrackMemory, now_s: float) -> bool:
    """Return whether to estimate the field of view: when due, and in every second full search."""
    if memory.width.known_deg is not None and _near(memory, now_s) is None:
        return memory.misses % 2 == 1
    return memory.width.due(now_s)


def _near(memory: TrackMemory, now_s: float) -> float | None:
    """Return the heading around which to search first, or None to search everywhere."""
    if memory.rival is not None:
        return memory.rival[0]
    if memory.steady is None or memory.misses >= _PATIENCE:
        return None
    return wrap(_predict(memory.steady, now_s))


def _predict(steady: Steady, now_s: float) -> float:
    """Extrapolate the heading, in unwrapped degrees, for a camera that keeps its speed."""
    pause = min(max(now_s - steady.time_s, 0.0), 0.3)
    return float(steady.measured[0] + steady.speed[0] * pause)


# -- comparing with earlier pictures ---------------------------------------------------------------


def _checked(
    heading: Heading,
    frame: Bytes,
    fov_deg: float,
    state: Track,
    now_s: float,
    sees_sitter: bool,
) -> tuple[Heading, TrackMemory]:
    """Confirm a doubtful heading, doubt a certain one, or carry one on from earlier pictures."""
    memory = state.memory
    just_checked = memory.confirmed_s is not None and now_s - memory.checked_s < _CHECK_S
    if heading.heading_deg is not None and just_checked:
        return heading, memory
    person, earlier = memory.company.latest, memory.clues
    sitter_deg = _sitter_deg(person, fov_deg) if sees_sitter else None
    background = background_of(frame, person, fov_deg)
    memory = replace(memory, checked_s=now_s)
    candidate = heading.candidate if heading.heading_deg is None else heading
    if candidate is not None and candidate.confidence >= _LEAST_CLUE:
        azimuth, confidence = candidate.heading_deg or 0.0, candidate.confidence
        clue = Clue(azimuth, confidence, candidate.zoom, sitter_deg, background, now_s)
        result = agreement(clue, earlier)
        if result.confirmed:
            confidence = max(confidence, _CONFIRMED)
            clues = remember(earlier, replace(clue, confidence=confidence))
            memory = replace(memory, clues=clues, confirmed_s=now_s)
            return replace(candidate, confidence=confidence), memory
        memory = replace(memory, clues=remember(earlier, clue))
        if candidate is heading and not result.doubted:
            return heading, memory
        if result.doubted:
            memory = replace(memory, confirmed_s=None)
    carried_deg = carried_on(background, sitter_deg, now_s, earlier)
    if carried_deg is None:
        # Either there was no heading, or it is doubted.
        return heading if heading.heading_deg is None else Heading("unsure", None), memory
    last = state.raw if state.raw is not None and state.raw.heading_deg is not None else UNSURE
    carried = replace(last, status="found", heading_deg=carried_deg, inliers=0)
    return replace(carried, confidence=_CARRIED, fov_deg=fov_deg), memory


# -- believing -------------------------------------------------------------------------------------


def _judge(heading: Heading, state: Track, now_s: float, sees_sitter: bool) -> Track:
    if heading.heading_deg is None:
        return missed(state, now_s)
    memory = state.memory
    if _follows(heading.heading_deg, memory, now_s):
        return _believe(heading.heading_deg, state, now_s, sees_sitter, afresh=False)
    confirmed = memory.confirmed_s == now_s
    if not confirmed:
        state = replace(state, memory=replace(memory, confirmed_s=None))
    if (
        confirmed
        or _seen_twice(heading.heading_deg, memory, now_s)
        or _beyond_doubt(heading, memory, now_s)
    ):
        return _believe(heading.heading_deg, state, now_s, sees_sitter, afresh=True)
    memory = replace(state.memory, rival=(heading.heading_deg, now_s))
    return _without_heading(replace(state, memory=memory), "searching", now_s)


def _follows(heading_deg: float, memory: TrackMemory, now_s: float) -> bool:
    """Return whether a turning camera could have reached a heading since the last heading."""
    steady = memory.steady
    if steady is None or now_s - steady.time_s > _FORGET_S:
        return False
    away = abs(difference(heading_deg, _predict(steady, now_s)))
    return away <= _STEP_DEG + _STEP_PER_S * max(now_s - steady.time_s, 0.0)


def _seen_twice(heading_deg: float, memory: TrackMemory, now_s: float) -> bool:
    if memory.rival is None or now_s - memory.rival[1] > _FORGET_S:
        return False
    away = abs(difference(heading_deg, memory.rival[0]))
    return away <= _STEP_DEG + _STEP_PER_S * max(now_s - memory.rival[1], 0.0)


def _beyond_doubt(heading: Heading, memory: TrackMemory, now_s: float) -> bool:
    """Return whether one picture is enough because it is certain and nothing contradicts it."""
    steady = memory.steady
    is_tracking = steady is not None and memory.misses < _PATIENCE
    fresh = steady is not None and now_s - steady.time_s <= _FORGET_S
    return heading.confidence >= _CERTAIN and not (is_tracking and fresh)


def _believe(
    heading_deg: float, state: Track, now_s: float, sees_sitter: bool, *, afresh: bool
) -> Track:
    sitter_deg = (_sitter_deg(state.sitter, state.fov_deg) or 0.0) if sees_sitter else 0.0
    steady = state.memory.steady
    if steady is None or afresh:
        steady = Steady.at(np.array([heading_deg, heading_deg + sitter_deg]), now_s)
    else:
        heading = steady.measured[0] + difference(heading_deg, float(steady.measured[0]))
        behind = heading_deg + sitter_deg
        behind = steady.measured[1] + difference(behind, float(steady.measured[1]))
        steady = steadied(steady, np.array([heading, behind]), now_s, _LEASH)
    confidence = _confidence(state, now_s, sees_sitter, afresh)
    memory = replace(state.memory, steady=steady, misses=0, rival=None)
    return replace(
        state,
        status="tracking",
        heading_deg=wrap(float(steady.position[0])),
        background_deg=wrap(float(steady.position[1])),
        confidence=confidence,
        since_s=state.since_s if state.status == "tracking" else now_s,
        memory=memory,
    )


def _confidence(state: Track, now_s: float, sees_sitter: bool, afresh: bool) -> float:
    """Return the confidence over the last pictures, smoothed to prevent flicker."""
    confidence = state.raw.confidence if state.raw is not None else 0.0
    if sees_sitter:
        confidence *= _NO_SITTER if state.sitter is None else state.sitter.confidence
    before = state.memory.steady
    if afresh or before is None or state.status != "tracking":
        return confidence
    share = math.exp(-max(now_s - before.time_s, 0.0) / _CONFIDENCE_S)
    return confidence + (state.confidence - confidence) * share


def _without_heading(state: Track, status: Status, now_s: float) -> Track:
    return replace(
        state,
        status=status,
        heading_deg=None,
        background_deg=None,
        confidence=0.0,
        since_s=state.since_s if state.status == status else now_s,
    )


# -- the sitter ------------------------------------------------------------------------------------


def _company(frame: Bytes, fov_deg: float, state: Track, now_s: float, seeing: Seeing) -> Company:
    company = state.memory.company
    if state.status == "tracking" and not company.due(now_s):
        return company
    try:
        sitter = seeing.sitter(frame, fov_deg, company.near(now_s))
    except CoreError:
        # Without the head detector, the heading is still useful.
        sitter = None
    return update_company(company, sitter, now_s)


def _sitter_deg(sitter: Sitter | None, fov_deg: float | None) -> float | None:
    """Return the sitter's angle from the axis, in degrees, for the latest field of view."""
    if sitter is None or fov_deg is None:
        return None
    return offset_angle(sitter.column, 1, fov_deg)
