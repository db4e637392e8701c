"""What to do next during a turn: a pure function of goal, arc, heading and the last state.

`guide` takes the current reading and the `GuideMemory` that the last call returned, and returns the
numbers that the screen shows together with the next memory; `app.words.guidance` makes the words.
Nothing here knows of time but the seconds that are handed in, and nothing is rounded apart: the
whole degrees of goal, now and the arc's ends are made first, and everything else is a difference of
these.

Which way round: the shorter one, kept until the other is 10 deg shorter, so that a sitter half-way
round is not sent to and fro. Too far: whoever came into the arc from one side and left it at the
other is told how far it is back *to the arc*, as before it was said how far it was into it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from app.core.base.angles import Direction, direction_of, ends_of, whole, wrap

HOLD_DEG: Final = 2
"""So near to the goal there is nothing to correct."""

KEEP_DEG: Final = 10
"""The other way round has to be shorter by so much before the way changes."""

LOCK_DEG: Final = 1
"""Whoever is in the light has left it only when they are further out than this."""

LOST_AFTER_S: Final = 1.0
"""So long the last number stays when no heading is found."""

NOSE_DEG: Final = 8
"""So far the nose may be off: a face does not tell it more closely."""

_BESIDE_DEG: Final = 5  # so far the lens may stand beside its goal where the nose is read
_SETTLE_DEG: Final = 0.7  # a shown number stays while the heading is within this of it
_NOSE_SETTLE_DEG: Final = 3.0  # the same, of what a face tells
_WELL_DEG: Final = 3.0  # how far inside the arc the nose is sent
_SWAYS_DEG: Final = 1.5  # a head sways by this much: closer to the arc's ends it is not lit
# A face is read 1.5 deg off, of a head that sways. In light so narrow the mean decides of the faces
# since the head moved last.
_NARROW_DEG: Final = 10.0
_STILL_S: Final = 2.5  # how far back they have to reach
_KEPT_S: Final = 6.0
_MOVED_DEG: Final = 4.0  # so far from those after it, a face was read before the head moved
_SPARED_DEG: Final = 2.0  # the middle of the light stays lit, however narrow that is
_OUT_DEG: Final = 1.0  # so far out of the light, no further face is waited for
_LEFT_DEG: Final = 0.5  # what was lit stays so until it is out by so much
_BEYOND_DEG: Final = 90  # further from the goal than this, the turn is not just too far


class HeadingSource(StrEnum):
    """Where the heading comes from, and how that is."""

    NONE = "none"
    STARTING = "starting"
    LIVE = "live"
    AWAY = "away"


class Phase(StrEnum):
    """What the screen shows."""

    NO_WEBCAM = "no webcam"
    STARTING = "starting"
    AWAY = "away"
    LOST = "lost"
    LEFT = "left behind"
    TURN = "turn"
    INSIDE = "inside"
    HOLD = "hold"
    BEYOND = "beyond"
    NOSE = "nose"


@dataclass(frozen=True, slots=True)
class Goal:
    """Where to turn.

    Attributes:
        turn_deg: The turn of the lens to reach, deg, positive clockwise.
        arc_deg: tuple of float or None. Tolerance arc, (from, to) clockwise, deg. None, or an arc
            without the goal on it, where somebody chose a turn of their own: then only the goal
            itself counts, give or take `HOLD_DEG`.
        lamp: What is to be held there: "hold the LED panel in front, raised 28°, at full power";
            empty where the light of the place is enough.
        yaw_deg: How far the face turns toward the sitter's own left from the lens, deg.
    """

    turn_deg: float
    arc_deg: tuple[float, float] | None = None
    lamp: str = ""
    yaw_deg: float = 0.0

    def facing(self, front_deg: float) -> tuple[float, tuple[float, float] | None]:
        """Where the nose is to point, and its arc, as azimuths in the panorama, deg."""
        arc, nose = self.arc_deg, front_deg - self.yaw_deg
        face_arc = None if arc is None else (arc[0] + nose, arc[1] + nose)
        return wrap(self.turn_deg + nose), face_arc


@dataclass(frozen=True, slots=True)
class Reading:
    """What is known at one moment.

    Attributes:
        turn_deg: How far the sitter has turned, from the heading; None where none was found.
        left_behind: The camera stands where it stood while the photographer walks: what it sees
            says nothing of how far the sitter has turned.
        from_deg: Where the sitter was turned to before, without a heading: 0 at the start, later
            the turn of the last photograph.
        yaw_deg: How the face is turned, as in `Goal`; None where none is read.
    """

    turn_deg: float | None
    time_s: float
    source: HeadingSource = HeadingSource.LIVE
    left_behind: bool = False
    from_deg: float = 0.0
    yaw_deg: float | None = None


@dataclass(frozen=True, slots=True)
class GuideMemory:
    """What one call tells the next; begin with `FRESH`.

    Attributes:
        way: Way round that was shown: 1 clockwise, -1 counter-clockwise, 0 none yet.
        approach: int or None. Way by which the arc was, or is to be, entered; 0 for who was inside
            from the start.
        shown_deg: int or None. Whole degrees of the turn that was shown last.
        nose: As in the `Guide`, steady.
        faces: When each was read, s, and how it was turned, deg; the newest first, back to when
            the head moved.
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
"""Nothing has been shown yet."""


@dataclass(frozen=True, slots=True)
class Guide:
    """What to do at one moment.

    Attributes:
        goal, now: int, int or None. Whole degrees in (-180, 180]; None where no heading is shown.
        to_go: int or None. goal - now going the way that is shown: positive clockwise, in (-360,
            360), and equal to goal - now but for whole circles.
        number: The large number, whole degrees going in `direction`: to the goal, back to the
            light, or of the nose; without a webcam the whole turn. None where none may be shown.
        has_arc: Whether there is light to be in; not for a style out of reach, or a turn of one's
            own.
        until_light: int or None. Whole degrees to the arc on the way shown; 0 inside, and until it
            has been left.
        nose: int or None. Whole degrees that the nose has to go further toward the sitter's left;
            None where it is to point to the lens, or no face is read.
        lamp: As in the `Goal`.
        yaw: As in the `Goal`, whole degrees.
        start: Whole degrees that the whole turn counts from, where no heading is shown.
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
        """How much further to their left the nose alone has to go, deg; 0 to hold still."""
        # Toward one's left is counter-clockwise.
        number = self.number or 0
        return -number if self.direction == "clockwise" else number


@dataclass(frozen=True, slots=True)
class _Target:
    """Goal and arc in whole degrees; the arc as how far it reaches to both sides of the goal.

    Attributes:
        ends: How far to both sides before rounding, for the nose, deg.
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
        """How far it is to the arc, for who still has `to_go` degrees to the goal going `way`."""
        if self.everywhere:
            return 0
        near, far = (self.before, self.after) if way > 0 else (self.after, self.before)
        return 0 if to_go <= near or 360 - to_go <= far else to_go - near

    def within(self, nose: float) -> float:
        """How far within the light a nose is that points so far clockwise of the goal, deg."""
        return min(nose + self.ends[0], self.ends[1] - nose)

    def further(self, past: float, off: float) -> float:
        """How much further to the left the nose has to go, deg; the lens is `past` the goal."""
        well = min(_WELL_DEG, sum(self.ends) / 2)
        return off + past - min(max(past, well - self.ends[0]), self.ends[1] - well)


def guide(goal: Goal, reading: Reading, memory: GuideMemory = FRESH) -> tuple[Guide, GuideMemory]:
    """Find what to do, and what to hand to the next call as its `memory`."""
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
    return _silent(target, Phase.LOST), replace(memory, shown_deg=None)


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
    """Round, but do not flicker between two numbers when the heading lies between them."""
    if shown_deg is not None and abs(wrap(turn_deg - shown_deg)) <= _SETTLE_DEG:
        return shown_deg
    return whole(turn_deg)


def _looked_at(target: _Target, reading: Reading, memory: GuideMemory) -> GuideMemory:
    """Remember how the face is turned; one that is missed for a moment changes nothing."""
    now, yaw, before = reading.time_s, reading.yaw_deg, memory.faces
    if not target.yaw or yaw is None:
        expired = not before or now - before[0][0] >= LOST_AFTER_S
        return replace(memory, nose=None, faces=()) if expired else memory
    if before and before[0][1] == yaw:
        before = before[1:]  # the same face, handed in again
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
    """How much further to the left the nose has to go, deg: 0 if lit, None if not sure yet."""
    past, faces = wrap(memory.turn_deg - target.goal), memory.faces
    off = target.yaw - faces[0][1]
    within = target.within(past + off)
    # The steady number may say 0 of a head that has swayed out since.
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
    """Which way to show, where it is so many degrees clockwise and was shown `before`."""
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
        # The nose makes up for where the lens stands.
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
    """Where the lens is right and the nose is not, the face alone has to turn."""
    return replace(
        guidance,
        phase=Phase.NOSE,
        number=abs(off),
        # Toward one's left is counter-clockwise.
        direction=direction_of(-off),
        inside=False,
        hold=False,
    )


def _locked(memory: GuideMemory, until: int, away: int) -> tuple[bool, bool]:
    """Tell whether one is in the light, and at the goal; both are left later than entered."""
    inside = until <= (LOCK_DEG if memory.inside else 0)
    return inside, inside and away <= HOLD_DEG + (LOCK_DEG if memory.hold else 0)


def _passed(approach: int | None, way: int, to_go: int, inside: bool) -> tuple[bool, int | None]:
    """Tell whether the arc was left at its far end, and the way by which it was entered."""
    if inside:
        return False, 0 if approach is None else approach
    if approach is None or way == approach or to_go > _BEYOND_DEG:
        return False, way
    return True, approach


def _silent(target: _Target, phase: Phase) -> Guide:
    """Show no number."""
    return Guide(phase, target.goal, has_arc=target.has_arc, lamp=target.lamp)


def _without(target: _Target, reading: Reading) -> Guide:
    """Without a heading the whole turn stands at once, to be made by eye."""
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
