"""Headings of several pictures: confirmed, doubted, remembered and carried on."""

from __future__ import annotations

from typing import Final

import pytest

from app.core.base.angles import difference, wrap
from app.core.localization.live.background_texture import background_of
from app.core.localization.live.several_frames import (
    Agreement,
    Clue,
    agreement,
    carried_on,
    remember,
)
from app.core.localization.views import Lens, look
from tests.helpers.demo_place import demo_panorama

LENS: Final = Lens(60.0, (640, 480))


def clue(
    axis: float,
    error: float = 0.0,
    confidence: float = 0.5,
    time_s: float = 0.0,
    sitter_deg: float | None = None,
    zoom: float = 1.0,
) -> Clue:
    """Return a clue whose heading is wrong by `error`. The panorama itself is the scene."""
    background = background_of(look(demo_panorama(), axis, LENS), None, LENS.fov_deg)
    return Clue(wrap(axis + error), confidence, zoom, sitter_deg, background, time_s)


def test_two_doubtful_headings_confirm_each_other() -> None:
    assert agreement(clue(32.0), (clue(20.0),)) == Agreement(confirmed=True)
    assert agreement(clue(32.0, 2.0), (clue(20.0),)).confirmed


@pytest.mark.parametrize("error", [-120.0, -20.0, 6.0, 40.0])
def test_headings_that_disagree_confirm_nothing(error: float) -> None:
    assert agreement(clue(32.0, error), (clue(20.0),)) == Agreement()


def test_near_pictures_confirm_nothing() -> None:
    """They show the same details, so they make the same errors."""
    assert agreement(clue(28.0), (clue(20.0),)) == Agreement()


def test_certain_headings_that_disagree_cast_doubt() -> None:
    earlier = (clue(20.0, confidence=0.95), clue(26.0, confidence=0.95))
    assert agreement(clue(32.0, 6.0, confidence=0.95), earlier).doubted
    assert agreement(clue(32.0, 0.5, confidence=0.95), earlier) == Agreement(confirmed=True)
    # If as many agree as disagree, the newest counts like any other.
    mixed = (clue(20.0, confidence=0.95), clue(26.0, 6.0, confidence=0.95))
    assert not agreement(clue(32.0, 0.0, confidence=0.95), mixed).doubted


def test_a_camera_that_is_carried_turns_more_than_its_pictures() -> None:
    """With a zoom of 1.5, pictures 12 deg apart belong to a turn of 18 deg around the sitter."""
    earlier = (clue(20.0, zoom=1.5, sitter_deg=0.0),)
    carried = clue(32.0, 6.0, zoom=1.5, sitter_deg=0.0)
    assert agreement(carried, earlier).confirmed
    # The sitter moved by 12 deg in the picture: the camera turned on the spot.
    panned = clue(32.0, 0.0, zoom=1.5, sitter_deg=-12.0)
    assert agreement(panned, earlier).confirmed
    assert not agreement(clue(32.0, 6.0, zoom=1.5, sitter_deg=-12.0), earlier).confirmed


def test_one_clue_per_direction_is_remembered() -> None:
    clues: tuple[Clue, ...] = ()
    for axis in (20.0, 21.0, 32.0, 33.0, 50.0):
        clues = remember(clues, clue(axis, time_s=axis / 20.0))
    assert [round(one.heading_deg) for one in clues] == [20, 32, 50]
    weaker = remember(clues, clue(51.0, confidence=0.2, time_s=3.0))
    assert [round(one.heading_deg) for one in weaker] == [20, 32, 50]
    stronger = remember(clues, clue(51.0, confidence=0.9, time_s=3.0))
    assert [round(one.heading_deg) for one in stronger] == [20, 32, 51]
    later = remember(clues, clue(50.5, time_s=9.0))
    assert later[-1].time_s == 9.0
    assert len(later) == 3
    assert remember(clues, clue(90.0, time_s=100.0))[0].heading_deg == pytest.approx(90.0)
    slow: tuple[Clue, ...] = ()
    for number in range(30):
        slow = remember(slow, clue(20.0 + 0.5 * number, time_s=0.5 * number))
    assert slow[-1].heading_deg - slow[0].heading_deg > 10.0, "a slow turn leaves clues behind"
    many: tuple[Clue, ...] = ()
    for number in range(20):
        many = remember(many, clue(10.0 * number))
    assert len(many) == 8


@pytest.mark.parametrize("turn", [-18.0, -9.0, 5.0, 18.0])
def test_a_certain_heading_is_carried_on(turn: float) -> None:
    certain = clue(20.0, confidence=0.95)
    found = carried_on(clue(20.0 + turn).background, None, 1.0, (certain,))
    assert found is not None
    assert difference(found, 20.0 + turn) == pytest.approx(0.0, abs=0.3)


def test_nothing_uncertain_is_carried_on() -> None:
    background = clue(28.0).background
    assert carried_on(background, None, 1.0, ()) is None
    assert carried_on(background, None, 1.0, (clue(20.0, confidence=0.5),)) is None
    assert carried_on(background, None, 9.0, (clue(20.0, confidence=0.95),)) is None
    far = clue(44.0).background
    assert carried_on(far, None, 1.0, (clue(20.0, confidence=0.95),)) is None
    two = (clue(20.0, confidence=0.95), clue(24.0, 6.0, confidence=0.95))
    assert carried_on(background, None, 1.0, two) is None
    # On the spot or around the sitter: with this zoom, it makes too much of a difference.
    assert carried_on(clue(36.0).background, None, 1.0, (clue(20.0, 0, 0.95, zoom=1.5),)) is None
