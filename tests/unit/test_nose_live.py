"""From a picture of a turned head to what is said of its nose: one sign from end to end."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.faces.finder import find_faces
from app.core.faces.pose import head_pose
from app.core.guidance.guide import Goal, Guide, Phase, Reading, guide
from app.core.portrait.head import Head, load_head
from app.core.solver.place_light import Facing, picture_at, prepare
from app.words.guidance import guide_words

_SIZE = (640, 640)


@cache
def head() -> Head:
    return load_head("generic")


def read(yaw_deg: float) -> float:
    """Yaw that a face shows whose head was drawn at a yaw, deg."""
    light = prepare(read_environment(resources() / "demo" / "scenes" / "studio.exr"))
    aside, facing = head().turned(yaw_deg), Facing(light, 40.0)
    linear = picture_at(aside.transport, light, facing.turn_deg)
    (shown,) = aside.portraits([linear], _SIZE, [facing], quick=True)
    (face,) = find_faces(np.ascontiguousarray(shown))
    return head_pose(face, _SIZE).yaw_deg


def told(goal_deg: float, yaw_deg: float) -> Guide:
    goal = Goal(96.0, (79.0, 111.0), yaw_deg=goal_deg)
    return guide(goal, Reading(96.0, 100.0, yaw_deg=yaw_deg))[0]


@pytest.mark.parametrize("yaw", [30.0, -30.0, 15.0])
def test_a_nose_that_points_as_asked_is_right(yaw: float) -> None:
    shown = read(yaw)
    assert shown == pytest.approx(yaw, abs=4.0)
    assert told(yaw, shown).phase is Phase.HOLD


@pytest.mark.parametrize(("yaw", "headline"), [(15.0, "left"), (45.0, "right")])
def test_a_nose_that_does_not_is_sent_the_right_way(yaw: float, headline: str) -> None:
    for side in (1.0, -1.0):
        shown = told(side * 30.0, read(side * yaw))
        other = {"left": "right", "right": "left"}[headline]
        assert guide_words(shown).headline == f"nose to their {headline if side > 0 else other}"
        assert shown.number == pytest.approx(15, abs=5)
