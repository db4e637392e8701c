"""The scripted photographer, with a tracker that knows, one that errs, and one that is mute."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import difference, wrap
from app.core.guidance.guide import Goal
from benchmarks.heading.scripted_turn.photographer import Habits, Photographer, random_habits
from benchmarks.heading.scripted_turn.scene_views import Stand
from benchmarks.heading.scripted_turn.turn_loop import Answer, Moment, Outcome, follow

Bytes = NDArray[np.uint8]
GOAL = Goal(60.0, (48.0, 75.0))


class Notebook:
    """A camera whose picture says nothing, and a tracker that was told where it was taken."""

    def __init__(self, wrong_deg: float = 0.0, takes_s: float = 0.06, mute: bool = False) -> None:
        self.wrong_deg, self.takes_s, self.mute = wrong_deg, takes_s, mute
        self.stands: list[Stand] = []
        self.sweeps: list[float] = []

    def picture(self, stand: Stand, sweep_deg_s: float) -> Bytes:
        self.stands.append(stand)
        self.sweeps.append(sweep_deg_s)
        return np.zeros((2, 2, 3), np.uint8)

    def answer(self, picture: Bytes, taken_s: float) -> Answer:
        turn = None if self.mute else wrap(self.stands[-1].turn_deg + self.wrong_deg)
        return Answer(turn, self.takes_s)


def ended(
    notebook: Notebook, habits: Habits, start: float = -40.0, seed: int = 0, limit_s: float = 60.0
) -> Outcome:
    person = Photographer(habits, start, np.random.default_rng(seed))
    return follow(GOAL, notebook.picture, notebook.answer, person, limit_s=limit_s)


@pytest.mark.parametrize("seed", range(12))
def test_he_arrives_where_a_true_number_leads_him(seed: int) -> None:
    chance = np.random.default_rng(seed)
    habits = random_habits(chance)
    outcome = ended(Notebook(), habits, float(chance.uniform(-180.0, 180.0)), seed)
    assert outcome.done
    assert outcome.inside
    assert abs(outcome.error_deg) < 3.6  # "Hold it" stays up to 3 deg, and numbers are whole
    assert outcome.error_deg == difference(outcome.turn_deg, GOAL.turn_deg)
    assert outcome.walks >= 1
    assert outcome.seconds > habits.delay_s


def test_a_wrong_number_leads_him_wrong() -> None:
    outcome = ended(Notebook(wrong_deg=25.0), Habits())
    assert outcome.done
    assert not outcome.inside
    assert outcome.error_deg == pytest.approx(-25.0, abs=4.0)


def test_without_a_number_he_stays_where_he_is_and_points_elsewhere() -> None:
    notebook = Notebook(mute=True, takes_s=0.7)
    outcome = ended(notebook, Habits(), limit_s=12.0)
    assert not outcome.done
    assert outcome.turn_deg == -40.0
    assert outcome.unsure == outcome.looked > 10
    aims = [stand.aim_deg for stand in notebook.stands]
    assert max(aims) - min(aims) > 2.0


def test_he_acts_after_his_delay_and_at_his_speed() -> None:
    habits = Habits(delay_s=0.8, speed_deg_s=10.0, fps=20.0)
    moments = ended(Notebook(), habits).trace
    turns = np.array([m.turn_deg for m in moments])
    times = np.array([m.time_s for m in moments])
    moved = np.flatnonzero(np.diff(turns) != 0.0)
    shown = next(m.time_s for m in moments if m.number is not None)
    assert times[moved[0]] >= shown + habits.delay_s - 0.051
    assert np.abs(np.diff(turns) / np.diff(times)).max() == pytest.approx(10.0)


def test_he_first_stops_two_to_six_degrees_beside() -> None:
    stops = []
    for seed in range(20):
        habits = Habits(delay_s=0.3, speed_deg_s=20.0, fps=24.0)
        turns = np.array([m.turn_deg for m in ended(Notebook(0.0, 0.001), habits, seed=seed).trace])
        still = np.flatnonzero((np.diff(turns) == 0.0) & (np.abs(turns[:-1] + 40.0) > 1.0))
        stops.append(turns[still[0]] - GOAL.turn_deg)
    beside = np.abs(stops)
    # The number is whole, and some hundredths of a second old.
    assert beside.min() > 2.0 - 1.6
    assert beside.max() < 6.0 + 1.6
    assert beside.max() - beside.min() > 2.0
    assert min(stops) < 0.0 < max(stops)


def test_where_he_stands_stays_within_what_he_can_do() -> None:
    for aim, metres in ((10.0, 1.2), (-10.0, 2.5)):
        notebook = Notebook()
        ended(notebook, replace(Habits(), aim_deg=aim, distance_m=metres))
        stands = notebook.stands
        assert all(1.2 <= s.distance_m <= 2.5 for s in stands)
        assert all(abs(s.aim_deg) <= 10.6 for s in stands)
        assert all(abs(s.pitch_deg) < 3.0 and abs(s.roll_deg) < 2.0 for s in stands)
        assert len({s.aim_deg for s in stands}) > 10
        assert max(abs(s) for s in notebook.sweeps) == pytest.approx(25.0)


def test_a_busy_tracker_looks_at_fewer_pictures() -> None:
    quick, slow = Notebook(takes_s=0.06), Notebook(takes_s=0.7)
    one, other = (ended(n, Habits(fps=20.0)) for n in (quick, slow))
    assert one.looked / one.seconds == pytest.approx(10.0, rel=0.15)  # every second picture
    assert other.looked / other.seconds < 1.6


def test_drawn_photographers_are_as_different_as_people() -> None:
    chance = np.random.default_rng(1)
    drawn = [random_habits(chance) for _ in range(300)]
    for values, least, most in (
        ([h.delay_s for h in drawn], 0.3, 0.8),
        ([h.speed_deg_s for h in drawn], 10.0, 40.0),
        ([h.distance_m for h in drawn], 1.2, 2.5),
        ([h.aim_deg for h in drawn], -10.0, 10.0),
        ([h.fps for h in drawn], 15.0, 24.0),
    ):
        assert least <= min(values)
        assert max(values) <= most
        assert max(values) - min(values) > 0.9 * (most - least)


def test_it_can_be_watched_and_is_the_same_again() -> None:
    told: list[Moment] = []
    person = Photographer(Habits(), -40.0, np.random.default_rng(4))
    notebook = Notebook()
    outcome = follow(GOAL, notebook.picture, notebook.answer, person, watch=told.append)
    assert tuple(told) == outcome.trace
    assert told[-1].phase == "hold"
    assert ended(Notebook(), Habits(), seed=4) == outcome
