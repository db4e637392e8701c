"""A whole turn at the demo location: random goal, photographer, phone and tracker.

The goals are those of the styles that the location's first spot gives, each with its tolerance arc.
The camera's view is rendered from the location's views, blurred while he walks, disturbed like a
phone's, and processed by the program's own tracker; he knows only the guidance's words. Everything
is drawn from the run's number.

If the goal has a turned face, it is short, broad or the best. The face is read on a portrait in the
place's light, only at angles that portraits cover; the location's own views show no face from the
side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.colour import face_exposure, luminance, srgb_encode
from app.core.base.paths import resources
from app.core.faces.finder import find_faces
from app.core.faces.pose import head_pose
from app.core.guidance.guide import Goal
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading_conversion import offset_angle
from app.core.localization.live.tracking import LOST, SEEING, Seeing, Track, track
from app.core.localization.sitter import Sitter
from app.core.localization.views import Lens
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.head_views import YAWS
from app.core.portrait.light import PortraitLight, portrait_light
from app.core.portrait.portrait_file import load_portrait
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.lens.view_tables import views_of
from app.core.solver.place_light import prepare
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS, Objective
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.heading.scripted_turn.phone import Disturbance, disturbed, random_disturbance, swept
from benchmarks.heading.scripted_turn.photographer import Habits, Photographer, Poser, random_habits
from benchmarks.heading.scripted_turn.scene_files import probe_environment
from benchmarks.heading.scripted_turn.scene_views import SceneViews, Stand
from benchmarks.heading.scripted_turn.turn_loop import Answer, Outcome, follow

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

TRACKING_S: Final = 0.060
"""Time of an answer near the last heading."""

SEARCHING_S: Final = 0.700
"""Time of an answer from the full search."""

_SIZE: Final = (640, 480)
_PAUSE_S: Final = 0.16  # between two processed pictures: the program is faster
_FOVS_DEG: Final = (45.0, 65.0)
_SHUTTERS_S: Final = (1 / 200, 1 / 60)
_SITTER_DEG: Final = 0.7
_FACE_DEG: Final = 1.5  # between two pictures
_SEED: Final = 20190


@dataclass(frozen=True, slots=True)
class World:
    """The demo location.

    Attributes:
        goals: Styles that it gives, and their goals.
        yaw_arcs_deg: For each, the yaws (from, to) at which the picture is about equally good.
    """

    views: SceneViews
    index: HeadingIndex
    goals: tuple[tuple[str, Goal], ...]
    yaw_arcs_deg: tuple[tuple[float, float], ...]
    light: PortraitLight = field(repr=False)


@dataclass(frozen=True, slots=True)
class Run:
    """Random values of one run.

    Attributes:
        start_deg: Turn at the start, deg.
        fov_deg, fov_known: The phone's horizontal field of view, deg, and whether the tracker knows
            it.
    """

    number: int
    style: str
    goal: Goal
    yaw_arc_deg: tuple[float, float]
    start_deg: float
    habits: Habits
    phone: Disturbance
    fov_deg: float
    fov_known: bool
    shutter_s: float


def demo_world(objective: Objective = "picture", aside: bool = False) -> World:
    """Read the demo location and solve its first spot.

    Args:
        objective: Objective for turns and arcs of the goals. The paper's arcs are not limited by a
            grade; they test the guidance alone.
        aside: Whether the goals are those with the face turned aside.

    Raises:
        CoreError: If the program's own files are missing or damaged.
    """
    folder = resources() / "demo" / "location"
    environment = probe_environment(folder)
    light = prepare(environment)
    pack = load_named_pack("generic")
    results: Sequence[StyleResult]
    if aside:
        tables = views_of(pack, "generic")
        wishes = [LensWish(yaw) for yaw in ("short", "broad", "auto")]
        found = [solve_lens(pack, tables, light.searched, wish) for wish in wishes]
        results = [r for each in found for r in each if r.attainable and r.yaw_deg]
    else:
        results = solve_all(pack, light.searched, objective)
        fair = objective == "picture"
        results = [r for r in results if (r.attainable if fair else r.match >= LIMITS.match)]
    return World(
        SceneViews(folder / "views", environment.radiance),
        build_index(light.display),
        tuple((r.name, Goal(r.turn_refined_deg, r.arc_deg, yaw_deg=r.yaw_deg)) for r in results),
        tuple(r.yaw_arc_deg for r in results),
        portrait_light(environment.radiance),
    )


def draw(number: int, place: World, known: float) -> Run:
    """Draw a run; the same number always gives the same."""
    chance = np.random.default_rng([_SEED, number])
    which = number % len(place.goals)
    style, goal = place.goals[which]
    return Run(
        number,
        style,
        goal,
        place.yaw_arcs_deg[which],
        float(chance.uniform(-180.0, 180.0)),
        random_habits(chance),
        random_disturbance(chance),
        float(chance.uniform(*_FOVS_DEG)),
        bool(chance.uniform() < known),
        float(chance.uniform(*_SHUTTERS_S)),
    )


class Phone:
    """Renders the camera's view, and disturbs it.

    Attributes:
        sitter_deg: Angle of the sitter from the axis of the last picture, deg.
    """

    def __init__(self, views: SceneViews, run: Run) -> None:
        self._views, self._run = views, run
        self._lens = Lens(run.fov_deg, _SIZE)
        self._chance = np.random.default_rng([_SEED, run.number, 1])
        self.sitter_deg = 0.0

    def __call__(self, stand: Stand, sweep_deg_s: float) -> NDArray[np.uint8]:
        """Take a picture while the background moves."""
        view = self._views.view(stand, self._lens)
        picture, self.sitter_deg = view.picture, view.sitter_deg
        moved = math.radians(sweep_deg_s * self._run.shutter_s) * self._lens.focal_px
        return disturbed(swept(picture, moved), self._run.phone, self._chance)


class Follower:
    """The program's tracker; it takes 60 ms near the last heading and 700 ms everywhere.

    Args:
        fov_deg: Field of view of the camera, deg; None to estimate it.
    """

    def __init__(self, index: HeadingIndex, fov_deg: float | None, seeing: Seeing = SEEING) -> None:
        self._index, self._fov_deg, self._seeing = index, fov_deg, seeing
        self._state: Track = LOST

    def __call__(self, picture: NDArray[np.uint8], taken_s: float) -> Answer:
        """Track a picture."""
        tracking = self._state.status == "tracking"
        self._state = track(
            picture, self._index, self._fov_deg, self._state, taken_s, seeing=self._seeing
        )
        takes = TRACKING_S if tracking else SEARCHING_S
        return Answer(self._state.turn_deg(), takes, self._state.left_behind)


class Portrait:
    """Reads the sitter's face, with the program's errors on portraits in the same light.

    Args:
        nose_deg: Azimuth that the nose points to, deg.
    """

    def __init__(self, light: PortraitLight, nose_deg: float, chance: np.random.Generator) -> None:
        self._chance = chance
        self._off = _off_deg(light, nose_deg)

    def __call__(self, yaw_deg: float) -> float | None:
        """Return the truth plus the error between the nearest portraits; None if one is unread."""
        off = float(np.interp(yaw_deg, list(self._off), list(self._off.values())))
        read = yaw_deg + off + _FACE_DEG * float(self._chance.standard_normal())
        return None if math.isnan(off) else read


@lru_cache(maxsize=64)
def _off_deg(light: PortraitLight, nose_deg: float) -> dict[float, float]:
    """Return the error of each portrait's yaw, deg; nan if no face is found."""
    yaws = sorted([0.0, *YAWS, *(-yaw for yaw in YAWS)])
    read = {yaw: _read_yaw(yaw, light, nose_deg) for yaw in yaws}
    return {yaw: math.nan if found is None else found - yaw for yaw, found in read.items()}


def _read_yaw(yaw_deg: float, light: PortraitLight, nose_deg: float) -> float | None:
    drawn = load_portrait("generic", "medium", "short", yaw_deg)
    assert drawn is not None
    head = drawn[0].halved
    picture = portrait_picture(head, drawn[1], light, nose_deg)
    gain = face_exposure(luminance(picture[head.coverage > 0.5]))
    exposed = srgb_encode(np.clip(gain * picture, 0.0, 1.0))
    codes = np.asarray(np.round(255.0 * exposed), np.uint8)
    faces = find_faces(codes)
    return head_pose(faces[0], codes.shape[:2]).yaw_deg if faces else None


def _told_sitter(phone: Phone, run: Run) -> Seeing:
    """Return a tracker that gets the sitter's position with a small error."""
    chance = np.random.default_rng([_SEED, run.number, 3])

    def sitter(frame: NDArray[np.uint8], fov_deg: float, near: Sitter | None) -> Sitter:
        angle = phone.sitter_deg + _SITTER_DEG * float(chance.standard_normal())
        true = math.tan(math.radians(angle)) / math.tan(math.radians(run.fov_deg) / 2.0)
        column = 0.5 + 0.5 * true
        box = (column - 0.06, 0.35, column + 0.06, 0.55)
        return Sitter(column, offset_angle(column, 1, fov_deg), box)

    return Seeing(sitter=sitter)


def run_turn(
    run: Run, place: World, limit_s: float, told: bool = False, read: bool = True
) -> Outcome:
    """Let one photographer turn, and the sitter with him.

    Args:
        read: Whether the program reads faces; without that, there are only words for the nose.
        told: Whether the tracker gets the sitter's position, with an error of 0.7 deg, instead of
            detecting it: to test the rest alone.
    """
    chance = np.random.default_rng([_SEED, run.number, 2])
    poser = Poser(np.random.default_rng([_SEED, run.number, 4])) if run.goal.yaw_deg else None
    person = Photographer(run.habits, run.start_deg, chance, poser)
    face = None
    if poser is not None and read:
        nose = wrap(run.goal.turn_deg - run.goal.yaw_deg)
        face = Portrait(place.light, nose, np.random.default_rng([_SEED, run.number, 5]))
    phone = Phone(place.views, run)
    seeing = _told_sitter(phone, run) if told else SEEING
    follower = Follower(place.index, run.fov_deg if run.fov_known else None, seeing)
    return follow(run.goal, phone, follower, person, limit_s=limit_s, pause_s=_PAUSE_S, face=face)
