"""Following the camera: lost and found, jumps, covers, the sitter, and an unknown lens."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import difference, wrap
from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.guidance.guide import FRESH, Goal, Phase, Reading, guide
from app.core.guidance.who_moves import Mode
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading import Heading
from app.core.localization.heading_conversion import Looks, offset_angle
from app.core.localization.live.temporal_filters import Company, Width, read, update_company
from app.core.localization.live.tracking import LOST, Seeing, Track, missed, track
from app.core.localization.sitter import Sitter
from app.core.localization.views import Lens, look
from tests.helpers.demo_place import demo_panorama
from tests.helpers.lens_matrix import lens_matrix

Bytes = NDArray[np.uint8]
PICTURE: Final = np.zeros((48, 64, 3), np.uint8)
INDEX: Final[Any] = object()
NEAR_S: Final = 0.06
FULL_S: Final = 0.70
FOLDER: Final = resources() / "demo" / "location" / "views"


def person(angle_deg: float, fov_deg: float = 60.0) -> Sitter:
    share = np.tan(np.radians(angle_deg)) / np.tan(np.radians(fov_deg) / 2.0)
    column = float(0.5 + 0.5 * share)
    return Sitter(column, angle_deg, (column - 0.05, 0.3, column + 0.05, 0.5))


@dataclass
class World:
    """A camera whose heading at each moment a test decides on, and how long looking takes."""

    heading: Callable[[float], float | None]
    sitter: Callable[[float], float | None] = lambda _: None
    jitter: float = 0.0
    confidence: float = 0.97
    fov_deg: float = 60.0
    width_noise: float = 0.0
    now_s: float = 0.0
    state: Track = LOST
    fulls: int = 0
    nears: int = 0
    asked: list[float | None] = field(default_factory=list)
    sitters: list[float | None] = field(default_factory=list)
    chance: np.random.Generator = field(default_factory=lambda: np.random.default_rng(3))

    def find(self, _: Bytes, __: Any, fov_deg: float | None, **how: Any) -> Heading:
        near = how["near_deg"]
        self.fulls, self.nears = self.fulls + (near is None), self.nears + (near is not None)
        self.asked.append(fov_deg)
        self.sitters.append(how["sitter_deg"])
        truth = self.heading(self.now_s)
        if truth is None or (near is not None and abs(difference(truth, near)) > 75.0):
            return Heading("unsure", None)
        estimate = self.fov_deg * (1.0 + self.chance.normal(0.0, self.width_noise))
        value = wrap(truth + self.chance.normal(0.0, self.jitter))
        confidence = self.confidence
        return Heading(
            "found", value, inliers=60, confidence=confidence, fov_deg=fov_deg or estimate
        )

    def find_sitter(self, *_: Any) -> Sitter | None:
        angle = self.sitter(self.now_s)
        return None if angle is None else person(angle, self.fov_deg)

    def step(self, fov_deg: float | None = 60.0, **how: Any) -> Track:
        """Look at one picture, which takes the time that it takes."""
        fulls = self.fulls
        seeing = Seeing(self.find, self.find_sitter)
        self.state = track(PICTURE, INDEX, fov_deg, self.state, self.now_s, seeing=seeing, **how)
        self.now_s += FULL_S if self.fulls > fulls else NEAR_S
        return self.state

    def run(self, seconds: float, **how: Any) -> list[tuple[float, Track]]:
        stop, rows = self.now_s + seconds, []
        while self.now_s < stop:
            taken = self.now_s
            rows.append((taken, self.step(**how)))
        return rows


def test_found_at_once_and_followed_cheaply() -> None:
    world = World(lambda _: 100.0)
    first = world.step()
    assert (first.status, first.heading_deg, first.since_s) == ("tracking", 100.0, 0.0)
    assert first.fov_deg == 60.0
    world.run(3.0)
    assert world.fulls == 1
    assert world.state.since_s == 0.0
    assert LOST.turn_deg() is None


def test_the_same_picture_is_looked_at_again_until_everything_was_searched() -> None:
    """A still camera that was put elsewhere sends one picture only."""
    world = World(lambda _: 100.0)
    world.run(1.0)
    state = world.state
    for _ in range(4):
        state = missed(state, world.now_s)
        last = state
    assert last.memory.misses == 4
    assert not last.pending
    assert missed(world.state, world.now_s).pending


def test_a_doubtful_beginning_is_looked_at_twice() -> None:
    world = World(lambda _: 100.0, confidence=0.85)
    first = world.step()
    assert (first.status, first.heading_deg, first.pending) == ("searching", None, True)
    assert first.turn_deg() is None
    second = world.step()
    assert (second.status, second.heading_deg, second.pending) == ("tracking", 100.0, False)
    assert (world.fulls, world.nears) == (1, 1)


def shown_numbers(world: World, seconds: float) -> list[int]:
    memory, numbers = FRESH, []
    for now, state in world.run(seconds):
        shown, memory = guide(Goal(10.0), Reading(state.turn_deg(), now), memory)
        if shown.now is not None:
            numbers.append(shown.now)
    return numbers


@pytest.mark.parametrize("where", [-140.0, -140.5, 179.9, 33.3])
def test_the_number_stands_still_with_the_camera(where: float) -> None:
    """0.3 deg of jitter, a minute long, also where two whole degrees meet."""
    numbers = shown_numbers(World(lambda _: where, jitter=0.3), 60.0)
    assert len(numbers) > 900
    assert len(set(numbers[50:])) == 1
    assert abs(difference(numbers[-1], where - 180.0)) <= 1.0


@pytest.mark.parametrize("speed", [10.0, -20.0, 40.0])
def test_a_steady_turn_is_followed_without_lag(speed: float) -> None:
    """Pictures come late, 60 ms after one another; over a whole circle, with jitter."""
    world = World(lambda t: wrap(150.0 + speed * max(t - 2.0, 0.0)), jitter=0.3)
    rows = [(t, s) for t, s in world.run(2.0 + 400.0 / abs(speed)) if t > 2.0]
    behind = []
    for now, state in rows:
        assert state.heading_deg is not None
        truth = world.heading(now)
        assert truth is not None
        behind.append(np.sign(speed) * difference(truth, state.heading_deg))
    assert world.fulls == 1, "it is never lost"
    assert np.mean(behind) < 0.05 * abs(speed)
    assert np.mean(behind) < 0.5
    assert max(behind) < 1.0 + 3.5 * 0.3


def test_a_step_is_followed_in_one_picture() -> None:
    world = World(lambda t: 0.0 if t < 2.0 else 6.0)
    for now, state in world.run(4.0):
        if now >= 2.0:
            assert state.heading_deg == pytest.approx(6.0, abs=0.9)
    assert world.state.heading_deg == pytest.approx(6.0, abs=0.2)


def test_one_wrong_picture_changes_nothing() -> None:
    wrong = [False]
    world = World(lambda _: -60.0 if wrong[0] else 0.0)
    world.run(2.0)
    for _ in range(5):
        wrong[0] = True
        assert world.step().heading_deg is None, "nor is it shown"
        wrong[0] = False
        after = [world.step() for _ in range(8)]
        assert all(s.status == "tracking" and s.heading_deg == 0.0 for s in after[1:])
    assert world.fulls == 1


def test_wrong_pictures_that_disagree_are_seldom_believed() -> None:
    world = World(lambda _: 0.0)
    world.run(1.0)
    world.heading = lambda _: float(world.chance.uniform(-180.0, 180.0))
    world.confidence = 0.85
    shown = [s.heading_deg is not None for _, s in world.run(20.0)]
    assert np.mean(shown) < 0.2, "by chance two agree now and then"


@pytest.mark.parametrize("jump", [40.0, 90.0, 180.0, -120.0])
def test_a_kidnapped_camera_is_found_again(jump: float) -> None:
    world = World(lambda t: 20.0 if t < 2.0 else wrap(20.0 + jump), jitter=0.2)
    world.run(2.0)
    before = world.fulls
    while world.step().status != "tracking" or world.now_s < 2.0 + NEAR_S:
        assert world.now_s < 6.0
    assert world.state.heading_deg == pytest.approx(wrap(20.0 + jump), abs=1.5)
    assert world.fulls - before <= 1
    assert world.now_s - 2.0 < 1.2


def test_the_lens_is_covered_for_a_while() -> None:
    world = World(lambda t: None if 2.0 < t < 7.0 else 20.0 + (60.0 if t > 4.0 else 0.0))
    world.run(2.1)
    covered = [s for _, s in world.run(4.0)]
    assert covered[0].status == "searching"
    assert covered[-1].status == "lost"
    assert all(s.heading_deg is None and s.turn_deg() is None for s in covered)
    start = world.now_s
    while world.step().status != "tracking":
        assert world.now_s - start < 3.0
    assert world.state.heading_deg == 80.0
    assert world.state.since_s > 6.5


def test_a_short_cover_costs_no_full_search() -> None:
    world = World(lambda t: None if 2.0 < t < 2.0 + 1.5 * NEAR_S else 20.0)
    world.run(3.0)
    assert world.fulls == 1
    assert world.state.heading_deg == 20.0


def test_missed_keeps_what_was_learnt() -> None:
    world = World(lambda _: 20.0, lambda _: 5.0)
    world.run(1.0)
    state = missed(world.state, world.now_s)
    assert (state.status, state.heading_deg, state.background_deg) == ("searching", None, None)
    assert state.sitter is not None
    assert missed(state, world.now_s + 10.0).status == "lost"
    assert missed(LOST, 0.0).status == "lost"


# -- the sitter ------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [-15.0, 0.0, 15.0])
@pytest.mark.parametrize("heading", [-170.0, 10.0, 179.0])
def test_the_turn_in_every_mode(angle: float, heading: float) -> None:
    seen = World(lambda _: heading, lambda _: angle)
    seen.run(1.0)
    turn = wrap(heading + angle - 180.0)
    both = (Looks.SITTER, Mode.WALK), (Looks.PHOTOGRAPHER, Mode.SELFIE), (Looks.SITTER, Mode.SELFIE)
    for looks, mode in both:
        assert seen.state.turn_deg(looks, mode) == pytest.approx(turn, abs=1e-6)
    assert seen.state.turn_deg(front_deg=30.0) == pytest.approx(wrap(turn - 30.0), abs=1e-6)
    away = World(lambda _: heading, lambda _: angle)
    away.run(1.0, sees_sitter=False)
    assert away.state.turn_deg(Looks.PHOTOGRAPHER) == pytest.approx(heading, abs=1e-6)
    assert away.state.turn_deg(Looks.PHOTOGRAPHER, front_deg=20.0) == pytest.approx(
        wrap(heading - 20.0), abs=1e-6
    )


def test_a_camera_that_only_pans_changes_no_turn() -> None:
    def pan(t: float) -> float:
        return 10.0 * math.sin(2.0 * math.pi * t / 1.5)

    world = World(lambda t: 100.0 + pan(t), lambda t: -pan(t))
    turns = [s.turn_deg() for _, s in world.run(6.0)]
    assert all(t is not None and abs(difference(t, -80.0)) < 1e-6 for t in turns)
    headings = [s.heading_deg for _, s in world.run(3.0) if s.heading_deg is not None]
    assert max(headings) - min(headings) > 15.0


def test_where_the_sitter_is_goes_into_the_search() -> None:
    world = World(lambda _: 100.0, lambda _: 12.0)
    world.step()
    assert world.sitters[-1] == pytest.approx(12.0)
    world.step(sees_sitter=False)
    assert world.sitters[-1] == pytest.approx(12.0), "who carries it is on the sitter's line"
    alone = World(lambda _: 100.0)
    alone.step()
    assert alone.sitters == [None]


def test_nobody_in_the_picture_lowers_the_confidence() -> None:
    seen, alone = World(lambda _: 0.0, lambda _: 0.0), World(lambda _: 0.0)
    seen.run(1.0)
    alone.run(1.0)
    assert alone.state.confidence < 0.8 * seen.state.confidence
    perhaps = World(lambda _: 0.0)
    somebody = replace(person(0.0), confidence=0.5)
    perhaps.find_sitter = lambda *_: somebody  # type: ignore[method-assign]
    perhaps.run(1.0)
    assert perhaps.state.confidence == pytest.approx(0.5 * seen.state.confidence)
    away = World(lambda _: 0.0)
    away.run(1.0, sees_sitter=False)
    assert away.state.confidence == pytest.approx(seen.state.confidence)


def test_what_finds_heads_may_be_missing() -> None:
    def broken(*_: Any) -> Sitter | None:
        raise CoreError("The network is missing.")

    world = World(lambda _: 50.0)
    world.find_sitter = broken  # type: ignore[method-assign]
    assert world.step().heading_deg == 50.0


def test_what_only_once_looked_like_a_head_is_not_followed_for_long() -> None:
    """A lamp is followed, until searches of the whole picture mostly find somebody else."""
    state, now = Company(), 0.0
    state = update_company(state, person(24.0), now)
    assert state.sitter == person(24.0)
    for _ in range(60):
        now += 0.06
        # Looked for around the lamp it is the lamp; searched for everywhere it is the sitter.
        state = update_company(state, person(0.0 if state.near(now) is None else 24.0), now)
        if state.sitter == person(0.0):
            break
    assert state.sitter == person(0.0)
    assert now < 2.5
    # And one search of five that finds the lamp changes nothing.
    for lap in range(60):
        now += 0.06
        seen = person(24.0 if state.near(now) is None and lap < 20 else 0.0)
        state = update_company(state, seen, now)
        assert state.sitter == person(0.0)


def test_the_sitter_stays_for_a_moment_and_jumps_only_when_seen_twice() -> None:
    state = update_company(Company(), person(10.0), 0.0)
    assert update_company(state, None, 1.0).sitter == state.sitter
    assert update_company(state, None, 2.0).sitter is None
    other = update_company(state, person(-20.0), 0.1)
    assert other.sitter == state.sitter
    assert update_company(other, person(9.0), 0.2).sitter == person(9.0)
    assert update_company(other, person(-19.0), 0.2).sitter == person(-19.0)
    assert not Company(looked_s=1.0).due(1.1)
    assert state.due(0.1)


# -- the lens --------------------------------------------------------------------------------------


@pytest.mark.parametrize("fov", [42.0, 60.0, 78.0])
def test_an_unknown_lens_is_learnt(fov: float) -> None:
    world = World(lambda _: 0.0, lambda _: 10.0, fov_deg=fov, width_noise=0.04)
    first = world.step(None)
    assert first.fov_deg == pytest.approx(fov, rel=0.15)
    world.run(20.0, fov_deg=None)
    assert world.state.fov_deg == pytest.approx(fov, rel=0.04)
    assert world.asked[:3] == [None, None, None]
    known = [one for one in world.asked[3:] if one is not None]
    assert len(known) > 0.9 * len(world.asked[3:]), "what is known is cheaper to use"
    assert world.state.turn_deg() == pytest.approx(-170.0, abs=1.0)


def test_wild_estimates_do_not_matter() -> None:
    width = Width()
    for number, fov in enumerate([61.0, 110.0, 60.0, 59.0, 25.0, 61.0, 60.0]):
        width = read(width, fov, float(number))
    assert width.known_deg == 60.0
    assert not width.due(7.0)
    assert width.due(20.0)
    split = Width((40.0, 80.0, 41.0, 79.0), 0.0)
    assert split.known_deg is None
    assert split.due(0.0)


def test_another_lens_is_noticed_when_everything_is_searched() -> None:
    world = World(lambda _: 0.0, fov_deg=60.0)
    world.run(2.0, fov_deg=None)
    world.fov_deg = 40.0
    world.run(60.0, fov_deg=None)
    assert world.state.fov_deg == pytest.approx(40.0)


# -- a camera left behind --------------------------------------------------------------------------


def test_a_camera_left_behind_is_noticed() -> None:
    chance = np.random.default_rng(0)
    wall = cv2.GaussianBlur(chance.integers(0, 255, (240, 320, 3), np.uint8), (0, 0), 3.0)
    picture = np.asarray(np.clip((wall - 127.0) * 8.0 + 127.0, 0, 255), np.uint8)
    world = World(lambda _: 0.0, lambda t: -20.0 + 40.0 * min(t / 8.0, 1.0))
    seeing = Seeing(world.find, world.find_sitter)
    flags = []
    for _ in range(150):
        world.state = track(
            picture, INDEX, 60.0, world.state, world.now_s, asked_deg=40.0, seeing=seeing
        )
        world.now_s += NEAR_S
        flags.append(world.state.left_behind)
    assert not any(flags[:60])
    assert flags[-1]
    moved = track(picture, INDEX, 60.0, world.state, world.now_s, asked_deg=0.0, seeing=seeing)
    assert not moved.left_behind


# -- on the demo location --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def index() -> HeadingIndex:
    return build_index(demo_panorama())


def noisy(picture: Bytes, chance: np.random.Generator) -> Bytes:
    worn = picture + chance.normal(0.0, 4.0, picture.shape)
    return np.clip(worn, 0, 255).astype(np.uint8)


def nobody(*_: Any) -> None:
    return None


@pytest.mark.slow
def test_a_turn_in_the_demo_location(index: HeadingIndex) -> None:
    """20 deg/s at 10 pictures a second, a covered lens, and a jump to the other side."""
    lens, chance, now, state = Lens(60.0, (480, 360)), np.random.default_rng(1), 0.0, LOST
    seeing = Seeing(sitter=nobody)
    off = []
    for number in range(16):
        truth = wrap(150.0 + 2.0 * number)
        frame = noisy(look(demo_panorama(), truth, lens), chance)
        state = track(frame, index, 60.0, state, now, sees_sitter=False, seeing=seeing)
        assert state.heading_deg is not None
        off.append(abs(difference(state.heading_deg, truth)))
        now += 0.1
    assert max(off) < 1.0
    black = np.zeros((360, 480, 3), np.uint8)
    for _ in range(3):
        state = track(black, index, 60.0, state, now, sees_sitter=False, seeing=seeing)
        assert state.heading_deg is None
        now += 0.1
    frame = look(demo_panorama(), -60.0, lens)
    for _ in range(2):
        state = track(frame, index, 60.0, state, now, sees_sitter=False, seeing=seeing)
        now += 0.7
    assert state.heading_deg == pytest.approx(-60.0, abs=0.5)


@pytest.mark.slow
def test_a_real_view_with_the_sitter_beside_the_axis(index: HeadingIndex) -> None:
    """The sitter of the shipped views is in the middle; the camera pans 8 deg to the right."""
    lens = Lens(60.0, (512, 384))
    shipped = cv2.imread(str(FOLDER / "view-080-180.webp"))
    assert shipped is not None
    angle = np.radians(8.0)
    pan = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    warp = lens_matrix(lens) @ pan @ np.linalg.inv(lens_matrix(lens))
    panned = cv2.warpPerspective(shipped[..., ::-1].copy(), warp, lens.size)
    seeing = Seeing(sitter=lambda *_: person(-8.0))
    state = LOST
    for number in range(2):
        state = track(np.asarray(panned, np.uint8), index, 60.0, state, 0.1 * number, seeing=seeing)
    assert state.turn_deg() == pytest.approx(80.0, abs=0.8)
    assert state.heading_deg == pytest.approx(-92.0, abs=0.8)
    assert offset_angle(person(-8.0).column, 1, 60.0) == pytest.approx(-8.0)


def test_the_guidance_follows_a_track() -> None:
    world = World(lambda t: wrap(180.0 + 20.0 * t))
    memory, phases = FRESH, []
    for now, state in world.run(4.0):
        shown, memory = guide(Goal(60.0, (50.0, 70.0)), Reading(state.turn_deg(), now), memory)
        phases.append(shown.phase)
    assert phases[0] is Phase.TURN
    assert Phase.HOLD in phases
    assert phases[-1] is Phase.BEYOND


# -- several frames --------------------------------------------------------------------------------


class Pan:
    """A camera that turns on the spot in the demo location. There is no person in the picture.

    A test provides `heading`, which receives the true azimuth and returns the search result.
    """

    def __init__(self, heading: Callable[[float], Heading]) -> None:
        self.heading = heading
        self.state: Track = LOST
        self.now_s = 0.0

    def look(self, azimuth: float) -> Track:
        frame = look(demo_panorama(), azimuth, Lens(60.0, (320, 240)))
        seeing = Seeing(lambda *_, **__: self.heading(azimuth), nobody)
        self.state = track(frame, INDEX, 60.0, self.state, self.now_s, seeing=seeing)
        self.now_s += 0.3
        return self.state


def sure(azimuth: float, confidence: float = 0.97) -> Heading:
    return Heading("found", wrap(azimuth), inliers=40, confidence=confidence, fov_deg=60.0)


def doubtful(azimuth: float, confidence: float = 0.5) -> Heading:
    return replace(Heading("unsure", None), candidate=sure(azimuth, confidence))


def test_doubtful_headings_count_once_the_camera_has_turned() -> None:
    pan = Pan(doubtful)
    assert [pan.look(100.0 + step).heading_deg for step in (0.0, 4.0, 8.0)] == [None] * 3
    state = pan.look(112.0)
    assert state.heading_deg == pytest.approx(112.0, abs=0.1)
    assert state.confirmed


@pytest.mark.parametrize("wrong", [-1.0, 0.0, 2.0])
def test_doubtful_headings_that_do_not_turn_along_stay_doubtful(wrong: float) -> None:
    pan = Pan(lambda azimuth: doubtful(30.0 + wrong * (azimuth - 100.0)))
    states = [pan.look(100.0 + 4.0 * step) for step in range(7)]
    assert all(state.heading_deg is None for state in states)


def test_a_certain_heading_is_likely_until_the_camera_has_turned() -> None:
    pan = Pan(sure)
    assert not any(pan.look(100.0 + step).confirmed for step in (0.0, 3.0, 6.0))
    assert pan.state.status == "tracking"
    assert pan.look(112.0).confirmed
    assert pan.look(113.0).confirmed, "it stays confirmed while the camera is followed"
    for _ in range(8):
        pan.heading = lambda _: Heading("unsure", None)
        pan.look(200.0)
    assert not pan.state.confirmed


def test_one_wrong_heading_of_several_is_not_shown() -> None:
    """It drifts by less than a turning camera could, so nothing else contradicts it."""
    pan = Pan(sure)
    for step in range(4):
        pan.look(100.0 + 4.0 * step)
    pan.heading = lambda azimuth: sure(azimuth + 7.0)
    pan.now_s += 0.5
    state = pan.look(118.0)
    assert state.heading_deg == pytest.approx(118.0, abs=1.5), "carried on from earlier headings"


def test_a_heading_is_carried_past_a_bare_wall_for_a_while() -> None:
    pan = Pan(sure)
    for step in range(4):
        pan.look(100.0 + 4.0 * step)
    pan.heading = lambda _: Heading("unsure", None)
    for azimuth in (116.0, 122.0, 128.0):
        state = pan.look(azimuth)
        assert state.heading_deg == pytest.approx(azimuth, abs=1.5)
        assert state.confidence < 0.9
    pan.heading = lambda _: Heading("unsure", None, few_details=True)
    state = pan.look(140.0)
    assert state.heading_deg is None, "too far from the last certain heading"
    assert state.raw is not None
    assert state.raw.few_details
    pan.now_s += 6.0
    assert pan.look(118.0).heading_deg is None, "too long ago"
