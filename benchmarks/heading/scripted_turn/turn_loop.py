"""Time passes: a photographer, his camera, a tracker and the guidance, from picture to picture.

The clock is the camera's. At every picture the photographer moves on, and if the tracker has
nothing to do it takes the newest picture; its answer comes after the time that such an answer
takes, and until then the screen shows what the last one said.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import difference, lies_on_arc, wrap
from app.core.guidance.guide import FRESH, Goal, Guide, GuideMemory, Reading, guide
from benchmarks.heading.scripted_turn.photographer import SETTLE_S

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.heading.scripted_turn.photographer import Photographer
    from benchmarks.heading.scripted_turn.scene_views import Stand

Bytes: TypeAlias = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Answer:
    """What the tracker made of a picture.

    Attributes:
        turn_deg: How far the sitter has turned, deg; None where nothing was found.
        yaw_deg: How the face is turned from the lens, deg; None where none is read.
    """

    turn_deg: float | None
    takes_s: float
    left_behind: bool = False
    yaw_deg: float | None = None


class Camera(Protocol):
    """Takes a picture."""

    def __call__(self, stand: Stand, sweep_deg_s: float) -> Bytes:
        """Return (H, W, 3) uint8 sRGB; the camera sweeps over the background at that speed."""
        ...


class Tracker(Protocol):
    """Looks at a picture."""

    def __call__(self, picture: Bytes, taken_s: float) -> Answer:
        """Return where it was taken."""
        ...


class FaceReader(Protocol):
    """Looks at a face."""

    def __call__(self, yaw_deg: float) -> float | None:
        """Return how it seems turned that is so turned, deg; None where none is read."""
        ...


@dataclass(frozen=True, slots=True)
class Moment:
    """One picture's time, to look at afterwards.

    Attributes:
        turn_deg, told_deg: float, float or None. Where he is, and what the tracker said last; deg.
    """

    time_s: float
    turn_deg: float
    told_deg: float | None
    number: int | None
    phase: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a turn ended.

    Attributes:
        turn_deg: Where the sitter faces at the end, in (-180, 180], deg.
        error_deg: How far that is clockwise of the goal, deg.
        first_deg: float or None. Where he first stood and was told "You are in the light", deg.
        told_errors_deg: What it said less the truth when the picture was taken, deg.
        yaw_deg: How the face is turned at the end, deg.
    """

    done: bool
    turn_deg: float
    error_deg: float
    inside: bool
    first_deg: float | None
    first_inside: bool | None
    seconds: float
    walks: int
    looked: int
    told_errors_deg: tuple[float, ...] = field(repr=False)
    unsure: int = 0
    trace: tuple[Moment, ...] = field(default=(), repr=False)
    yaw_deg: float = 0.0


@dataclass(slots=True)
class _Screen:
    """The tracker at work, and what the screen shows of it."""

    goal: Goal
    camera: Camera
    tracker: Tracker
    pause_s: float
    face: FaceReader | None = None
    memory: GuideMemory = FRESH
    said: Answer | None = None
    coming: tuple[float, Answer] | None = None
    free_s: float = 0.0
    errors: list[float] = field(default_factory=list)
    looked: int = 0

    def at(self, now_s: float, person: Photographer, sweep_deg_s: float) -> Guide | None:
        """Take a picture if there is time for it; return what is shown by now."""
        if self.coming is not None and self.coming[0] <= now_s:
            self.said, self.coming = self.coming[1], None
        if self.coming is None and now_s >= self.free_s:
            stand = person.stand(now_s)
            answer = self.tracker(self.camera(stand, sweep_deg_s), now_s)
            if self.face is not None and person.sitter is not None:
                answer = replace(answer, yaw_deg=self.face(person.sitter.sways(now_s)))
            self.coming = (now_s + answer.takes_s, answer)
            self.free_s = now_s + self.pause_s
            self.looked += 1
            if answer.turn_deg is not None:
                self.errors.append(difference(answer.turn_deg, stand.turn_deg))
        if self.said is None:
            return None
        behind, yaw = self.said.left_behind, self.said.yaw_deg
        reading = Reading(self.said.turn_deg, now_s, left_behind=behind, yaw_deg=yaw)
        shown, self.memory = guide(self.goal, reading, self.memory)
        return shown


def follow(
    goal: Goal,
    camera: Camera,
    tracker: Tracker,
    person: Photographer,
    *,
    limit_s: float = 60.0,
    pause_s: float = 0.0,
    face: FaceReader | None = None,
    watch: Callable[[Moment], None] | None = None,
) -> Outcome:
    """Let a photographer turn until he is told to hold it, or the time is over.

    Args:
        pause_s: From one picture that the tracker takes to the next at least, seconds.
    """
    screen = _Screen(goal, camera, tracker, pause_s, face)
    step, now, before = 1.0 / person.habits.fps, 0.0, person.turn_deg
    trace: list[Moment] = []
    first: float | None = None
    while now < limit_s and not person.done:
        shown = screen.at(now, person, (person.turn_deg - before) / step)
        if shown is not None:
            person.look(shown, now)
            settled = person.stands and now >= person.stood_s + SETTLE_S
            if first is None and shown.inside and settled:
                first = _lit_from(goal, person, now)
        trace.append(_moment(now, person, screen, shown))
        if watch is not None:
            watch(trace[-1])
        before = person.turn_deg
        now += step
        person.move(now, step)
    outcome = _outcome(goal, person, now, first)
    return replace(
        outcome,
        looked=screen.looked,
        told_errors_deg=tuple(screen.errors),
        unsure=screen.looked - len(screen.errors),
        trace=tuple(trace),
    )


def _moment(now_s: float, person: Photographer, screen: _Screen, shown: Guide | None) -> Moment:
    told = None if screen.said is None else screen.said.turn_deg
    number, phase = (None, "") if shown is None else (shown.number, str(shown.phase))
    return Moment(now_s, wrap(person.turn_deg), told, number, phase)


def _outcome(goal: Goal, person: Photographer, now_s: float, first: float | None) -> Outcome:
    turn = wrap(person.turn_deg)
    return Outcome(
        done=person.done,
        turn_deg=turn,
        error_deg=difference(turn, goal.turn_deg),
        inside=_on(goal, _lit_from(goal, person, now_s)),
        first_deg=first,
        first_inside=None if first is None else _on(goal, first),
        yaw_deg=0.0 if person.sitter is None else person.sitter.yaw_deg,
        seconds=now_s,
        walks=person.walks,
        looked=0,
        told_errors_deg=(),
    )


def _lit_from(goal: Goal, person: Photographer, now_s: float) -> float:
    """The turn at which the nose would point where it does if it were turned as wanted, deg."""
    off = 0.0 if person.sitter is None else person.sitter.sways(now_s) - goal.yaw_deg
    return wrap(person.turn_deg - off)


def _on(goal: Goal, turn_deg: float) -> bool:
    return goal.arc_deg is None or lies_on_arc(turn_deg, goal.arc_deg)
