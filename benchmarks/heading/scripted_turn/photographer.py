"""A scripted photographer, and a sitter, who follow only the guidance.

He sees the screen (`app.core.guidance.guide.Guide`): a number, a direction, a word. He acts on it
after a delay, walks at his own speed towards the goal by the number, and stops 2 to 6 deg beside
it, on either side, however short the way was. Then he waits until the number is still, and
corrects. He is done when he stands and reads "Hold it".

If the nose should not point to the lens, he passes on the screen's instruction, and waits until the
sitter, who turns by about that much, is still.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.core.base.angles import wrap
from app.core.guidance.guide import Guide, Phase
from benchmarks.heading.scripted_turn.scene_views import Stand

if TYPE_CHECKING:
    import numpy as np

SETTLE_S: Final = 0.3
"""Time of standing still before a number is read."""

_DELAY_S: Final = (0.3, 0.8)
_SPEED_DEG_S: Final = (10.0, 40.0)
_BESIDE_DEG: Final = (2.0, 6.0)
_DISTANCE_M: Final = (1.2, 2.5)
_AIM_DEG: Final = 10.0

_HOLDS_S: Final = 0.5  # time of that message before he presses
_WAITS_S: Final = 1.5  # time without a number before he points the camera elsewhere
_WANDERS_DEG: Final = 1.5
_SITTER_S: Final = (0.4, 1.0)
_SITTER_DEG_S: Final = 40.0
_TURNS: Final = (0.8, 1.2)  # of the instruction; nobody knows an angle more precisely
_SWAYS_DEG: Final = 1.5
_STEPS_M: Final = 0.06


@dataclass(frozen=True, slots=True)
class Habits:
    """The photographer's way of moving and holding the camera.

    Attributes:
        aim_deg: Aim to the right of the sitter, deg.
        shake_deg: Amplitude of the hands' tremble, deg.
        fps: Pictures per second of the camera.
    """

    delay_s: float = 0.5
    speed_deg_s: float = 25.0
    distance_m: float = 1.5
    aim_deg: float = 0.0
    shake_deg: float = 0.3
    fps: float = 20.0


def random_habits(chance: np.random.Generator) -> Habits:
    """Draw a photographer.

    Returns:
        Delay 0.3 to 0.8 s, 10 to 40 deg/s, 1.2 to 2.5 m, aim within 10 deg, 15 to 24 pictures per
        second, all uniform.
    """
    return Habits(
        delay_s=float(chance.uniform(*_DELAY_S)),
        speed_deg_s=float(chance.uniform(*_SPEED_DEG_S)),
        distance_m=float(chance.uniform(*_DISTANCE_M)),
        aim_deg=float(chance.uniform(-_AIM_DEG, _AIM_DEG)),
        shake_deg=float(chance.uniform(0.1, 0.5)),
        fps=float(chance.uniform(15.0, 24.0)),
    )


@dataclass(frozen=True, slots=True)
class _Shown:
    """The screen's content, its time, and his position."""

    time_s: float
    turn_deg: float
    guide: Guide

    @property
    def to_go(self) -> int | None:
        """Angle from number and direction, positive clockwise; None without a number."""
        if self.guide.phase not in (Phase.TURN, Phase.INSIDE, Phase.HOLD, Phase.BEYOND):
            return None
        sign = {"clockwise": 1, "counter-clockwise": -1}.get(self.guide.direction, 0)
        return sign * (self.guide.number or 0)

    def nose_deg(self, told: bool) -> float:
        """Return the rest of the nose's turn towards the sitter's left, as on screen."""
        if self.guide.phase is Phase.NOSE:
            # Towards the sitter's left is counter-clockwise.
            return self.guide.further
        asked = self.guide.inside and not told and self.guide.nose is None
        return self.guide.yaw if asked else 0


class Poser:
    """Turns the nose on instruction, late and roughly; the eyes stay on the lens.

    Attributes:
        yaw_deg: Turn of the face towards the sitter's own left of the lens, without the sway.
    """

    def __init__(self, chance: np.random.Generator) -> None:
        self.yaw_deg = 0.0
        self.told = False
        self.still_s = 0.0
        self._chance = chance
        self._moves: tuple[float, float, float] | None = None  # when, from, to

    def hear(self, further_deg: float, now_s: float) -> None:
        """Hear an instruction to turn the nose further to the left."""
        self.told = True
        starts = now_s + float(self._chance.uniform(*_SITTER_S))
        by = further_deg * float(self._chance.uniform(*_TURNS))
        self._moves = (starts, self.yaw_deg, self.yaw_deg + by)
        self.still_s = starts + abs(by) / _SITTER_DEG_S

    def move(self, now_s: float) -> None:
        """Advance by a moment."""
        if self._moves is not None:
            starts, before, after = self._moves
            length = max(self.still_s - starts, 1e-6)
            share = min(max((now_s - starts) / length, 0.0), 1.0)
            self.yaw_deg = before + share * (after - before)

    def sways(self, now_s: float) -> float:
        """Return the direction of the nose at a moment, deg."""
        return self.yaw_deg + _SWAYS_DEG * math.sin(0.9 * now_s)


@dataclass(slots=True)
class _Walk:
    """A walk: its target, unwrapped deg, and the offset at which he will stop."""

    to_deg: float
    beside_deg: float


class Photographer:
    """Follows the screen, late and roughly.

    Args:
        chance: Randomness of stops and tremble.
        sitter: Turns the nose on his instruction; None for a nose towards the lens.

    Attributes:
        turn_deg: His position, unwrapped deg.
    """

    def __init__(
        self,
        habits: Habits,
        turn_deg: float,
        chance: np.random.Generator,
        sitter: Poser | None = None,
    ) -> None:
        self.habits = habits
        self.sitter = sitter
        self.turn_deg = turn_deg
        self.done = False
        self.walks = 0
        self._chance = chance
        self._shown: deque[_Shown] = deque()
        self._walk: _Walk | None = None
        self._stood_s = 0.0
        self._held_s: float | None = None
        self._pan_deg = 0.0
        self._phases = chance.uniform(0.0, 2.0 * math.pi, 8)

    @property
    def stands(self) -> bool:
        """Whether he stands still."""
        return self._walk is None

    @property
    def stood_s(self) -> float:
        """Time since when he has stood still, seconds."""
        return self._stood_s

    def look(self, shown: Guide, now_s: float) -> None:
        """See the screen, and act on it later."""
        self._shown.append(_Shown(now_s, self.turn_deg, shown))

    def move(self, now_s: float, step_s: float) -> None:
        """Advance by a moment.

        Args:
            now_s, step_s: End of the moment, and its length; seconds.
        """
        seen = self._seen(now_s)
        if self.sitter is not None:
            self.sitter.move(now_s)
        if seen is None or self.done:
            return
        if self._walk is not None:
            self._go(self._walk, seen, now_s, step_s)
        elif seen.time_s >= self._stood_s + SETTLE_S:
            self._decide(seen, now_s)

    def stand(self, now_s: float) -> Stand:
        """Return the camera's position at a moment, including the tremble."""
        wave = [math.sin(now_s * (1.3 + 0.9 * n) + p) for n, p in enumerate(self._phases)]
        habits, shake = self.habits, self.habits.shake_deg
        aim = habits.aim_deg + self._pan_deg + _WANDERS_DEG * wave[0]
        aim = min(max(aim, -_AIM_DEG), _AIM_DEG)
        distance = habits.distance_m + _STEPS_M * wave[1]
        return Stand(
            wrap(self.turn_deg + 0.3 * shake * wave[2]),
            min(max(distance, _DISTANCE_M[0]), _DISTANCE_M[1]),
            aim + shake * 0.5 * (wave[5] + wave[7]),
            2.0 * wave[3] + shake * wave[6],
            1.5 * wave[4],
        )

    def _seen(self, now_s: float) -> _Shown | None:
        """Return the last screen that he has had time to notice."""
        while len(self._shown) > 1 and self._shown[1].time_s <= now_s - self.habits.delay_s:
            self._shown.popleft()
        first = self._shown[0] if self._shown else None
        return first if first is not None and first.time_s <= now_s - self.habits.delay_s else None

    def _go(self, walk: _Walk, seen: _Shown, now_s: float, step_s: float) -> None:
        to_go = seen.to_go
        if to_go is not None:
            walk.to_deg = seen.turn_deg + to_go
        left = walk.to_deg + walk.beside_deg - self.turn_deg
        step = self.habits.speed_deg_s * step_s
        if abs(left) <= step or to_go is None:
            self.turn_deg += left if to_go is not None else 0.0
            self._walk, self._stood_s = None, now_s
        else:
            self.turn_deg += math.copysign(step, left)

    def _decide(self, seen: _Shown, now_s: float) -> None:
        """Decide while standing: press, walk again, or search for a background."""
        if self.sitter is not None and self._waits_for(self.sitter, seen, now_s):
            return
        if seen.guide.hold:
            self._held_s = now_s if self._held_s is None else self._held_s
            self.done = now_s - self._held_s >= _HOLDS_S
            return
        self._held_s = None
        to_go = seen.to_go
        if to_go is None:
            if now_s - self._stood_s > _WAITS_S:
                self._pan_deg = float(self._chance.uniform(-5.0, 5.0)) - self.habits.aim_deg * 0.5
                self._stood_s = now_s
            return
        beside = float(self._chance.uniform(*_BESIDE_DEG) * self._chance.choice((-1.0, 1.0)))
        self._walk = _Walk(seen.turn_deg + to_go, beside)
        self.walks += 1

    def _waits_for(self, sitter: Poser, seen: _Shown, now_s: float) -> bool:
        """Pass on the instruction for the nose; return whether the sitter is still turning."""
        if seen.time_s < sitter.still_s + SETTLE_S:
            return True
        further = seen.nose_deg(sitter.told)
        if further:
            sitter.hear(further, now_s)
        return bool(further)
