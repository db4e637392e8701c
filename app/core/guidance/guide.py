"""Choose the next step in a turn, as a pure function of goal, arc, heading and previous state.

`guide` takes the current reading and the `GuideMemory` returned by the previous call, and returns
the numbers to show and the next memory. `app.words.guidance` writes the words. Time enters only
through the reading's `time_s`. The goal, the current turn and the ends of the arc are rounded to
whole degrees first. All other numbers are differences between them, so the numbers on screen always
add up.

The direction is the shorter way round. It is kept until the other way is 10 degrees shorter, so
a sitter who is half-way round is not sent back and forth. After an overshoot, a sitter who entered
the arc on one side and left it on the other sees the distance back *to the arc*, just as they first
saw the distance into it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from app.core.base.angles import Direction, direction_of, ends_of, whole, wrap

HOLD_DEG: Final = 2
"""Maximum distance from the goal, in degrees, that needs no correction."""

KEEP_DEG: Final = 10
"""Amount, in degrees, by which the other way round must be shorter to change the direction."""

LOCK_DEG: Final = 1
"""Distance outside the light, in degrees, at which the sitter counts as having left the light."""

LOST_AFTER_S: Final = 1.0
"""Time, in seconds, for which the last number stays on screen once the heading is lost."""

NOSE_DEG: Final = 8
"""Tolerance for the direction of the nose, in degrees. A face cannot be read more precisely."""

_BESIDE_DEG: Final = 5  # largest offset of the lens from its goal at which the nose is read
_SETTLE_DEG: Final = 0.7  # a number on screen stays while the heading is within this distance
_NOSE_SETTLE_DEG: Final = 3.0  # the same for numbers read from a face
_WELL_DEG: Final = 3.0  # how far inside the arc the nose is sent
# a head sways by this much, so it is not reliably lit closer to the arc's ends
_SWAYS_DEG: Final = 1.5
# A face's yaw has an error of 1.5 degrees, on a head that sways. In an arc this narrow, the mean of
# the faces since the last movement decides.
_NARROW_DEG: Final = 10.0
_STILL_S: Final = 2.5  # time span that these faces must cover
_KEPT_S: Final = 6.0
_MOVED_DEG: Final = 4.0  # a face that differs more from later faces is from before a movement
_SPARED_DEG: Final = 2.0  # the middle of the arc counts as lit, however narrow the arc is
_OUT_DEG: Final = 1.0  # this far outside the light, no more faces are awaited
_LEFT_DEG: Final = 0.5  # a lit face stays lit until it is outside by more than this
_BEYOND_DEG: Final = 90  # beyond this distance from the goal, the turn is not an overshoot


class HeadingSource(StrEnum):
    """Source and condition of the heading."""

    NONE = "none"
    STARTING = "starting"
    LIVE = "live"
    AWAY = "away"


class Phase(StrEnum):
    """Phase of the guidance, as shown on screen."""

    NO_WEBCAM = "no webcam"
    STARTING = "starting"
    AWAY = "away"
    LOST = "lost"
    FEW_DETAILS = "few details"
    LEFT = "left behind"
    TURN = "turn"
    INSIDE = "inside"
    HOLD = "hold"
    BEYOND = "beyond"
    NOSE = "nose"


LOST: Final = (Phase.LOST, Phase.FEW_DETAILS)
"""The phases in which the picture has no heading."""


@dataclass(frozen=True, slots=True)
class Goal:
    """The target of a turn.

    Attributes:
        turn_deg: Turn that the lens should reach, in degrees, positive clockwise.
        arc_deg: Tolerance arc, (from, to) clockwise, in degrees. If the user chose their own turn,
            this is None or an arc that does not contain the goal. In that case, only the goal
            itself counts, to within `HOLD_DEG`.
        lamp: Instruction for the second light, such as "hold the LED panel in front, raised 28°, at
            full power", or an empty string if the light of the place is enough.
        yaw_deg: Turn of the face towards the sitter's own left, away from the lens, in degrees.
    """

    turn_deg: float
    arc_deg: tuple[float, float] | None = None
    lamp: str = ""
    yaw_deg: float = 0.0

    def facing(self, front_deg: float) -> tuple[float, tuple[float, float] | None]:
        """Return the goal and the arc of the nose as azimuths in the panorama, in degrees.

        Args:
            front_deg: Panorama azimuth of the photographer at turn 0, in degrees.
        """
        arc, nose = self.arc_deg, front_deg - self.yaw_deg
        face_arc = None if arc is None else (arc[0] + nose, arc[1] + nose)
        return wrap(self.turn_deg + nose), face_arc


@dataclass(frozen=True, slots=True)
class Reading:
    """Measurements at one moment.

    Attributes:
        turn_deg: The sitter's turn according to the heading, or None if no heading was found.
        time_s: Time of the reading, in seconds from any origin.
        left_behind: Whether the camera stays where it is while the photographer walks. Its view
            then reveals nothing about the sitter's turn.
        from_deg: Turn to start from if there is no heading, which is 0 at first and later the turn
            of the last photo.
        yaw_deg: Yaw of the face, as in `Goal`, or None if no yaw was read.
        few_details: Whether the picture shows too little to find a heading, like a bare wall.
    """

    turn_deg: float | None
    time_s: float
    source: HeadingSource = HeadingSource.LIVE
    left_behind: bool = False
    from_deg: float = 0.0
    yaw_deg: float | None = None
    few_details: bool = False


@dataclass(frozen=True, slots=True)
class GuideMemory:
    """State that each call passes to the next one, starting with `FRESH`.

    Attributes:
        goal: Goal, reach of the arc on both sides, and yaw, or None before the first call.
        way: Direction on screen: 1 for clockwise, -1 for counter-clockwise, or 0 if there is none
            yet.
        approach: Direction in which the arc was or will be entered, or 0 if the turn started inside
            the arc.
        shown_deg: Last turn on screen, in whole degrees.
        turn_deg: Last turn, in degrees.
        seen_s: Time of the last heading, in seconds, or None if there is none.
        inside: Whether the turn was inside the arc.
        hold: Whether the turn was at the goal.
        nose: As in `Guide`, but steadied.
        faces: Time, in seconds, and yaw, in degrees, of each face since the last movement of the
            head, newest first.
        on_target: Whether the nose was in the light.
    """

    goal: tuple[int, ...] | None = None
    way: int = 0
    approach: int | None = None
    shown_deg: int | None = None
    turn_deg: float = 0.0
    seen_s: float | None = None
    inside: bool = False
    hold: bool = False
    nose: int | None = None
    faces: tuple[tuple[float, float], ...] = ()
    on_target: bool = False


FRESH: Final = GuideMemory()
"""The memory before the first call."""


@dataclass(frozen=True, slots=True)
class Guide:
    """Instructions for one moment.

    Attributes:
        goal, now: Goal and current turn, in whole degrees within (-180, 180]. `now` is None if
            there is no heading.
        to_go: Angle from `now` to `goal` in the direction on screen, positive clockwise, in
            (-360, 360). It equals goal - now except for full circles.
        number: The large number on screen, in whole degrees in `direction`. It is the distance to
            the goal or back to the light, or the angle that the nose still has to turn. Without a
            webcam, it is the whole turn. It is None if no number may be shown.
        has_arc: Whether there is light to turn into. This is False for a style out of reach and for
            a turn chosen by the user.
        inside: Whether the turn is inside the arc.
        hold: Whether the turn is at the goal.
        beyond: Whether the turn has gone through the arc and out at its far end.
        until_light: Distance to the arc in the direction on screen, in whole degrees. It is 0
            inside the arc and stays 0 until the sitter counts as having left the arc.
        lamp: As in `Goal`.
        nose: Angle that the nose still has to turn towards the sitter's left, in whole degrees, or
            None if the nose should point at the lens or no face was read.
        yaw: As in `Goal`, but in whole degrees.
        start: Turn, in whole degrees, from which the whole turn is counted if there is no heading.
    """

    phase: Phase
    goal: int
    now: int | None = None
    to_go: int | None = None
    number: int | None = None
    direction: Direction = "none"
    has_arc: bool = False
    inside: bool = False
    hold: bool = False
    beyond: bool = False
    until_light: int | None = None
    lamp: str = ""
    nose: int | None = None
    yaw: int = 0
    start: int = 0

    @property
    def further(self) -> int:
        """Degrees that the face alone still has to turn towards the sitter's left, or 0 to hold."""
        # Towards the sitter's left is counter-clockwise.
        number = self.number or 0
        return -number if self.direction == "clockwise" else number


@dataclass(frozen=True, slots=True)
class _Target:
    """Goal and arc in whole degrees, with the arc given as its reach on either side of the goal.

    Attributes:
        ends: Reach on either side before rounding, in degrees, which is used for the nose.
    """

    goal: int
    before: int
    after: int
    has_arc: bool = False
    lamp: str = ""
    yaw: int = 0
    ends: tuple[float, float] = (HOLD_DEG, HOLD_DEG)

    @property
    def key(self) -> tuple[int, ...]:
        return self.goal, self.before, self.after, self.yaw

    @property
    def everywhere(self) -> bool:
        return self.before + self.after >= 360

    def outside(self, way: int, to_go: int) -> int:
        """Return the distance to the arc in direction `way`, given the distance to the goal."""
        if self.everywhere:
            return 0
        near, far = (self.before, self.after) if way > 0 else (self.after, self.before)
        return 0 if to_go <= near or 360 - to_go <= far else to_go - near

    def within(self, nose: float) -> float:
        """Return how many degrees inside the light the nose is, given its angle from the goal."""
        return min(nose + self.ends[0], self.ends[1] - nose)

    def further(self, past: float, off: float) -> float:
        """Return how many degrees the nose must still turn left if the lens is `past` the goal."""
        well = min(_WELL_DEG, sum(self.ends) / 2)
        return off + past - min(max(past, well - self.ends[0]), self.ends[1] - well)


def guide(goal: Goal, reading: Reading, memory: GuideMemory = FRESH) -> tuple[Guide, GuideMemory]:
    """Return the instructions for this moment and the `memory` for the next call."""
    target = _target(goal)
    if memory.goal != target.key:
        memory = GuideMemory(goal=target.key, shown_deg=memory.shown_deg, seen_s=memory.seen_s)
    if reading.source is HeadingSource.LIVE and reading.left_behind:
        blank = replace(memory, shown_deg=None, seen_s=None, inside=False, hold=False)
        return _silent(target, Phase.LEFT), blank
    if reading.source is HeadingSource.LIVE and reading.turn_deg is not None:
        shown_deg = _settled(reading.turn_deg, memory.shown_deg)
        turn, now = reading.turn_deg, reading.time_s
        memory = _looked_at(target, reading, memory)
        memory = replace(memory, shown_deg=shown_deg, turn_deg=turn, seen_s=now)
        return _turning(target, memory, shown_deg)
    if reading.source is not HeadingSource.LIVE:
        return _without(target, reading), replace(memory, shown_deg=None, seen_s=None)
    since = None if memory.seen_s is None else reading.time_s - memory.seen_s
    if memory.shown_deg is not None and since is not None and since < LOST_AFTER_S:
        return _turning(target, memory, memory.shown_deg)
    phase = Phase.FEW_DETAILS if reading.few_details else Phase.LOST
    return _silent(target, phase), replace(memory, shown_deg=None)


def _target(goal: Goal) -> _Target:
    middle, aside = whole(goal.turn_deg), (goal.lamp, round(goal.yaw_deg))
    if goal.arc_deg is None:
        return _Target(middle, HOLD_DEG, HOLD_DEG, False, *aside)
    ends = ends_of(goal.arc_deg)
    if ends is None:
        return _Target(middle, 180, 180, True, *aside)
    before, after = (middle - ends[0]) % 360, (ends[1] - middle) % 360
    if before + after >= 360:
        return _Target(middle, HOLD_DEG, HOLD_DEG, False, *aside)
    near, far = wrap(middle - goal.arc_deg[0] - before), wrap(goal.arc_deg[1] - middle - after)
    return _Target(middle, before, after, True, *aside, (before + near, after + far))


def _settled(turn_deg: float, shown_deg: int | None) -> int:
    """Round the turn, but keep the previous number if the turn is still close enough to it."""
    if shown_deg is not None and abs(wrap(turn_deg - shown_deg)) <= _SETTLE_DEG:
        return shown_deg
    return whole(turn_deg)


def _looked_at(target: _Target, reading: Reading, memory: GuideMemory) -> GuideMemory:
    """Add the yaw of the face to the memory. A briefly missing face leaves it unchanged."""
    now, yaw, before = reading.time_s, reading.yaw_deg, memory.faces
    if not target.yaw or yaw is None:
        expired = not before or now - before[0][0] >= LOST_AFTER_S
        return replace(memory, nose=None, faces=()) if expired else memory
    if before and before[0][1] == yaw:
        before = before[1:]  # the same face as before
    faces = ((now, yaw), *(face for face in before if now - face[0] <= _KEPT_S))
    for count in range(2, len(faces)):
        if abs(faces[count][1] - _mean_yaw(faces[:count])) > _MOVED_DEG:
            faces = faces[:count]
            break
    off, nose = target.yaw - yaw, memory.nose
    still = nose is not None and abs(off - nose) <= _NOSE_SETTLE_DEG
    return replace(memory, nose=nose if still else round(off), faces=faces)


def _mean_yaw(faces: tuple[tuple[float, float], ...]) -> float:
    return sum(yaw for _, yaw in faces) / len(faces)


def _nose_to_go(target: _Target, memory: GuideMemory) -> int | None:
    """Return how many degrees the nose must still turn left, 0 if it is lit, or None if unsure."""
    past, faces = wrap(memory.turn_deg - target.goal), memory.faces
    off = target.yaw - faces[0][1]
    within = target.within(past + off)
    # The steady number may still be 0 after the head has swayed out.
    further = round(target.further(past, memory.nose or 0)) or round(target.further(past, off))
    if abs(off) > NOSE_DEG:
        return further
    if target.everywhere or not target.has_arc:
        return 0
    if sum(target.ends) >= _NARROW_DEG:
        return 0 if within >= _SWAYS_DEG else further
    off = target.yaw - _mean_yaw(faces)
    mean = target.within(past + off)
    waits = faces[0][0] - faces[-1][0] < _STILL_S
    if waits and mean >= -_OUT_DEG:
        return None
    half = sum(target.ends) / 2
    edge = max(min(_SWAYS_DEG, half - _SPARED_DEG), half / 4) - (
        _LEFT_DEG if memory.on_target else 0.0
    )
    if not waits and mean >= edge and within >= -_OUT_DEG:
        return 0
    gap = target.further(past, off)
    return round(gap) or (1 if gap > 0 else -1)


def _way(clockwise: int, before: int) -> int:
    """Return the direction to show, given the clockwise distance and the last direction."""
    if clockwise == 0:
        return 0
    if before == 0:
        return 1 if clockwise <= 180 else -1
    same_way = clockwise if before > 0 else 360 - clockwise
    return before if (360 - same_way) > same_way - KEEP_DEG else -before


def _turning(target: _Target, memory: GuideMemory, now: int) -> tuple[Guide, GuideMemory]:
    clockwise = (target.goal - now) % 360
    way = _way(clockwise, memory.way)
    to_go = clockwise if way >= 0 else 360 - clockwise
    until, away = target.outside(way, to_go), min(to_go, 360 - to_go)
    if memory.nose is not None and away <= _BESIDE_DEG + (LOCK_DEG if memory.hold else 0):
        # The nose makes up for the lens's offset.
        until = away = 0
    inside, hold = _locked(memory, until, away)
    until = 0 if inside else until
    beyond, approach = _passed(memory.approach, way, to_go, inside)
    next_memory = replace(memory, way=way, approach=approach, inside=inside, hold=hold)
    phase = Phase.TURN
    if inside:
        phase = Phase.HOLD if hold else Phase.INSIDE
    elif beyond:
        phase = Phase.BEYOND
    guidance = Guide(
        phase=phase,
        goal=target.goal,
        now=now,
        to_go=way * to_go,
        number=to_go,
        direction=direction_of(way),
        has_arc=target.has_arc,
        inside=inside,
        hold=phase is Phase.HOLD,
        beyond=beyond,
        until_light=until,
        lamp=target.lamp,
        nose=memory.nose,
        yaw=target.yaw,
    )
    if inside and memory.nose is not None:
        further = _nose_to_go(target, memory)
        next_memory = replace(next_memory, on_target=further == 0)
        guidance = guidance if further == 0 else _aside(guidance, further or 0)
    return guidance, next_memory


def _aside(guidance: Guide, off: int) -> Guide:
    """Return the guide for a turn of the face alone, when the lens is right but the nose is not."""
    return replace(
        guidance,
        phase=Phase.NOSE,
        number=abs(off),
        # Towards the sitter's left is counter-clockwise.
        direction=direction_of(-off),
        inside=False,
        hold=False,
    )


def _locked(memory: GuideMemory, until: int, away: int) -> tuple[bool, bool]:
    """Return, with hysteresis, whether the turn is in the light and whether it is at the goal."""
    inside = until <= (LOCK_DEG if memory.inside else 0)
    return inside, inside and away <= HOLD_DEG + (LOCK_DEG if memory.hold else 0)


def _passed(approach: int | None, way: int, to_go: int, inside: bool) -> tuple[bool, int | None]:
    """Return whether the arc was left at its far end, and the direction of entry."""
    if inside:
        return False, 0 if approach is None else approach
    if approach is None or way == approach or to_go > _BEYOND_DEG:
        return False, way
    return True, approach


def _silent(target: _Target, phase: Phase) -> Guide:
    """Return a guide without a number."""
    return Guide(phase, target.goal, has_arc=target.has_arc, lamp=target.lamp)


def _without(target: _Target, reading: Reading) -> Guide:
    """Return a guide for the whole turn, which is made by eye when there is no heading."""
    if reading.source is HeadingSource.AWAY:
        return _silent(target, Phase.AWAY)
    start = whole(reading.from_deg)
    to_go = whole(target.goal - start)
    starting = reading.source is HeadingSource.STARTING
    return replace(
        _silent(target, Phase.STARTING if starting else Phase.NO_WEBCAM),
        number=abs(to_go),
        direction=direction_of(to_go),
        yaw=target.yaw,
        start=start,
    )
