"""A whole turn at the demo location: goal, photographer, phone and tracker, drawn and put together.

The goals are those of the styles that the location's first spot can give, each with its tolerance
arc. What the photographer's camera sees is rendered from the location's views, smeared while he
walks, spoilt as a phone would, and looked at by the program's own tracker; the guidance's words are
all that he knows. Everything is drawn from the run's number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.paths import resources
from app.core.guidance.guide import Goal
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading_conversion import offset_angle
from app.core.localization.sitter import Sitter
from app.core.localization.tracking import LOST, SEEING, Seeing, Track, track
from app.core.localization.views import Lens
from app.core.solver.place_light import prepare
from app.core.solver.solve import solve_all
from app.core.solver.style_pack import load_named_pack
from app.core.solver.turn_choice import LIMITS, Objective
from benchmarks.scripted_turn.phone import Disturbance, disturbed, random_disturbance, swept
from benchmarks.scripted_turn.photographer import Habits, Photographer, random_habits
from benchmarks.scripted_turn.scene_files import probe_environment
from benchmarks.scripted_turn.scene_views import SceneViews, Stand
from benchmarks.scripted_turn.turn_loop import Answer, Outcome, follow

if TYPE_CHECKING:
    from numpy.typing import NDArray

TRACKING_S: Final = 0.060
"""How long an answer takes that is found near the last heading."""

SEARCHING_S: Final = 0.700
"""How long one takes that is looked for everywhere."""

_SIZE: Final = (640, 480)
_PAUSE_S: Final = 0.16  # from picture to picture that is looked at: the program manages more
_FOVS_DEG: Final = (45.0, 65.0)
_SHUTTERS_S: Final = (1 / 200, 1 / 60)
_SITTER_DEG: Final = 0.7
_SEED: Final = 20190


@dataclass(frozen=True, slots=True)
class World:
    """The demo location.

    Attributes:
        goals: tuple of (str, Goal). Styles that it can give, and where.
    """

    views: SceneViews
    index: HeadingIndex
    goals: tuple[tuple[str, Goal], ...]


@dataclass(frozen=True, slots=True)
class Run:
    """What is drawn for one run.

    Attributes:
        start_deg: The turn at which he begins, deg.
        fov_deg, fov_known: The phone's horizontal field of view, deg, and whether the tracker is
            told.
    """

    number: int
    style: str
    goal: Goal
    start_deg: float
    habits: Habits
    phone: Disturbance
    fov_deg: float
    fov_known: bool
    shutter_s: float


def demo_world(objective: Objective = "picture") -> World:
    """Read the demo location and solve its first spot.

    Args:
        objective: Whose turns and arcs are the goals. The paper's arcs are not cut short by a
            grade; they try the guidance alone.

    Raises:
        CoreError: When the program's own files are missing or damaged.
    """
    folder = resources() / "demo" / "location"
    environment = probe_environment(folder)
    light = prepare(environment)
    results = solve_all(load_named_pack("generic"), light.searched, objective)
    offered = [
        r for r in results if (r.attainable if objective == "picture" else r.match >= LIMITS.match)
    ]
    goals = tuple((r.name, Goal(r.turn_refined_deg, r.arc_deg)) for r in offered)
    return World(
        SceneViews(folder / "views", environment.radiance), build_index(light.display), goals
    )


def draw(number: int, place: World, known: float) -> Run:
    """Draw a run; the same number always gives the same."""
    chance = np.random.default_rng([_SEED, number])
    style, goal = place.goals[number % len(place.goals)]
    return Run(
        number,
        style,
        goal,
        float(chance.uniform(-180.0, 180.0)),
        random_habits(chance),
        random_disturbance(chance),
        float(chance.uniform(*_FOVS_DEG)),
        bool(chance.uniform() < known),
        float(chance.uniform(*_SHUTTERS_S)),
    )


class Phone:
    """Renders what the camera sees, and spoils it.

    Attributes:
        sitter_deg: Where the sitter is from the axis of the last picture, deg.
    """

    def __init__(self, views: SceneViews, run: Run) -> None:
        self._views, self._run = views, run
        self._lens = Lens(run.fov_deg, _SIZE)
        self._chance = np.random.default_rng([_SEED, run.number, 1])
        self.sitter_deg = 0.0

    def __call__(self, stand: Stand, sweep_deg_s: float) -> NDArray[np.uint8]:
        """Take a picture while the background moves by."""
        view = self._views.view(stand, self._lens)
        picture, self.sitter_deg = view.picture, view.sitter_deg
        moved = math.radians(sweep_deg_s * self._run.shutter_s) * self._lens.focal_px
        return disturbed(swept(picture, moved), self._run.phone, self._chance)


class Follower:
    """The program's tracker; it takes 60 ms near the last heading and 700 ms everywhere.

    Args:
        fov_deg: Of the camera, deg; None when the tracker has to find out.
    """

    def __init__(self, index: HeadingIndex, fov_deg: float | None, seeing: Seeing = SEEING) -> None:
        self._index, self._fov_deg, self._seeing = index, fov_deg, seeing
        self._state: Track = LOST

    def __call__(self, picture: NDArray[np.uint8], taken_s: float) -> Answer:
        """Look at a picture."""
        tracking = self._state.status == "tracking"
        self._state = track(
            picture, self._index, self._fov_deg, self._state, taken_s, seeing=self._seeing
        )
        takes = TRACKING_S if tracking else SEARCHING_S
        return Answer(self._state.turn_deg(), takes, self._state.left_behind)


def _told_sitter(phone: Phone, run: Run) -> Seeing:
    """Make a tracker that is told where the sitter is, give or take a little."""
    chance = np.random.default_rng([_SEED, run.number, 3])

    def sitter(frame: NDArray[np.uint8], fov_deg: float, near: Sitter | None) -> Sitter:
        angle = phone.sitter_deg + _SITTER_DEG * float(chance.standard_normal())
        true = math.tan(math.radians(angle)) / math.tan(math.radians(run.fov_deg) / 2.0)
        column = 0.5 + 0.5 * true
        box = (column - 0.06, 0.35, column + 0.06, 0.55)
        return Sitter(column, offset_angle(column, 1, fov_deg), box)

    return Seeing(sitter=sitter)


def run_turn(run: Run, place: World, limit_s: float, told: bool = False) -> Outcome:
    """Let one photographer turn.

    Args:
        told: Whether the tracker is told where the sitter is, give or take 0.7 deg, instead of
            looking: to test the rest by itself.
    """
    person = Photographer(run.habits, run.start_deg, np.random.default_rng([_SEED, run.number, 2]))
    phone = Phone(place.views, run)
    seeing = _told_sitter(phone, run) if told else SEEING
    follower = Follower(place.index, run.fov_deg if run.fov_known else None, seeing)
    return follow(run.goal, phone, follower, person, limit_s=limit_s, pause_s=_PAUSE_S)
