"""A film put together of what its frames show."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.errors import ProbeError
from app.core.faces.face_on_head import head_map
from app.core.faces.finder import Face
from app.core.faces.pose import HeadPose
from app.core.localization.views import Lens, look
from app.core.measure.film.film import Film, FilmReader, Glimpse, read_turn
from app.core.measure.film.headings import background, step
from app.core.solver.transport import render
from app.core.styles.style_pack_file import load_named_pack
from app.words.remarks import sentences
from tests.unit.test_facing import place
from tests.unit.test_measure_film_light import lamp

FACE = Face(np.zeros((468, 3), np.float32), 0.9)


def glimpse(nose_deg: float, yaw_deg: float, number: int) -> Glimpse:
    """A face under a lamp that stands at azimuth 0, its nose at an azimuth."""
    head = head_map()
    light = np.roll(lamp(10, 32), -round(nose_deg / 5.625), axis=1).astype(np.float32)
    grey = np.zeros(head.side**2, np.float32)
    grey[head.transport.pixels] = render(head.transport, light)
    pose = HeadPose(yaw_deg, 0.0, 0.0, np.eye(3))
    return Glimpse(0.5 * number, FACE, pose, grey, np.ones(grey.size, bool))


def stood_still(yaws: list[float]) -> Film:
    behind = background(look(place("interior").display, 30.0, Lens(60.0, (480, 270))), None)
    count = len(yaws)
    return read_turn(
        [glimpse(-yaw, yaw, number) for number, yaw in enumerate(yaws)],
        [behind] * count,
        [step(behind, behind, None)] * (count - 1),
    )


def test_a_camera_that_stands_still_sees_the_turns_of_the_face() -> None:
    film = stood_still([float(yaw) for yaw in range(-48, 50, 4)])
    assert film.still
    assert np.abs(film.noses_deg - np.arange(48, -50, -4)).max() < 1.0
    assert 14 <= film.visible.sum() <= 20
    assert any("stood still" in note for note in sentences(film.notes))
    assert any("over only" in note for note in sentences(film.notes))
    for result in film.results(load_named_pack("generic")):
        assert abs(result.turn_deg) <= 56.25


def test_neither_turns() -> None:
    with pytest.raises(ProbeError, match="does not turn"):
        stood_still([0.0] * 12)


def test_nothing_yet() -> None:
    with FilmReader() as reader, pytest.raises(ProbeError, match="No face"):
        reader.film()
