"""The simulation loop: a photographer, his camera, a tracker and the guidance.

The clock is the camera's. At every picture the photographer moves on, and an idle tracker takes the
newest picture; its answer comes after its computing time, and until then the screen shows the
previous one.
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
    """The tracker's answer for a picture.

    Attributes:
        turn_deg: Turn of the sitter, deg; None if nothing was found.
        yaw_deg: Yaw of the face from the lens, deg; None if none was read.
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
    """Locates a picture."""

    def __call__(self, picture: Bytes, taken_s: float) -> Answer:
        """Return the answer for a picture."""
        ...


class FaceReader(Protocol):
    """A stand-in for the face detector: yaw of the face, with its errors."""

    def __call__(self, yaw_deg: float) -> float | None:
        """Return the apparent yaw for a true yaw, deg; None if none is read."""
        ...


@dataclass(frozen=True, slots=True)
class Moment:
    """The state at one picture, for later inspection.

    Attributes:
        turn_deg, told_deg: His position, and the tracker's last answer, or None; deg.
    """

    time_s: float
    turn_deg: float
    told_deg: float | None
    number: int | None
    phase: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a turn.

    Attributes:
        turn_deg: Final direction of the sitter, in (-180, 180], deg.
        error_deg: Its angle clockwise from the goal, deg.
        first_deg: His first position with the message "You are in the light", deg; None if none.
        told_errors_deg: Answers minus the truth at the time of the picture, deg.
        yaw_deg: Final yaw of the face, deg.
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
    """The working tracker, and its display."""

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
        """Take a picture if there is time for it; return the current display."""
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
    """Let a photographer turn until the message to hold, or until the time is up.

    Args:
        pause_s: Least time between two of the tracker's pictures, seconds.
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
    """Return the turn whose correct nose direction equals the current one, deg."""
    off = 0.0 if person.sitter is None else person.sitter.sways(now_s) - goal.yaw_deg
    return wrap(person.turn_deg - off)


def _on(goal: Goal, turn_deg: float) -> bool:
    return goal.arc_deg is None or lies_on_arc(turn_deg, goal.arc_deg)
