"""Which way a face looks in a place, and what it shows of a style, on the app’s own portraits."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.base.paths import resources
from app.core.environment.environment import from_radiance, read_environment
from app.core.faces.face_on_head import on_head
from app.core.faces.facing import FacingEstimate, find_facing, standing
from app.core.faces.finder import find_faces
from app.core.faces.pose import head_pose
from app.core.faces.shot_against_goal import (
    Check,
    Promise,
    check_face,
    graded_by,
    promise_of_place,
)
from app.core.solver.place_light import PlaceLight, prepare, turned
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from tests.helpers.cases import sample_first
from tests.unit.test_faces import Bytes, lamp, portrait, shown_in

STYLE = "left-rembrandt"


@cache
def place(name: str) -> PlaceLight:
    return prepare(read_environment(resources() / "demo" / "scenes" / f"{name}.exr"))


@cache
def taken(head: str, name: str, turn: float) -> Bytes:
    """A portrait in a place, the sitter turned so far."""
    return shown_in(head, turned(place(name), turn, (256, 512)))


@cache
def pack() -> StylePack:
    return load_named_pack("generic")


@cache
def answer(name: str) -> StyleResult:
    return solve_all(pack(), place(name).searched, styles=[STYLE])[0]


@cache
def promised(name: str) -> Promise:
    found = answer(name)
    return promise_of_place(place(name), found.turn_refined_deg, found.arc_deg, pack(), STYLE)


def facing(picture: Bytes, light: PlaceLight) -> FacingEstimate | None:
    (face,) = find_faces(picture)
    pose = head_pose(face, (picture.shape[0], picture.shape[1]))
    return find_facing(*on_head(picture, face), pose, light.searched)


def checked(picture: Bytes, promise: Promise, lens_deg: float | None = None) -> Check:
    (face,) = find_faces(picture)
    return check_face(picture, face, promise, None, lens_deg)


@pytest.mark.parametrize("head", sample_first(["generic", "female", "male"], 1))
@pytest.mark.parametrize(
    ("name", "turn"), [("interior", 71.0), ("interior", -40.0), ("sunset", 10.0), ("night", 130.0)]
)
def test_a_face_looks_the_way_it_was_turned(head: str, name: str, turn: float) -> None:
    found = facing(taken(head, name, turn), place(name))
    assert found is not None
    assert found.azimuth_deg == pytest.approx(turn, abs=12)
    assert found.likelihood.sum() == pytest.approx(1.0)
    assert found.share(turn, 20.0) > 0.5


def test_a_face_lit_as_nowhere_here_is_not_read() -> None:
    """Under a lamp from below, in a place that is lit from above alone."""
    above = prepare(from_radiance(lamp(0.0, 70.0, 30.0), "above"))
    assert facing(portrait("generic", 60.0, -45.0), above) is None


def test_too_little_of_a_face_is_not_read() -> None:
    picture = taken("generic", "interior", 71.0)
    (face,) = find_faces(picture)
    grey, seen = on_head(picture, face)
    pose = head_pose(face, (picture.shape[0], picture.shape[1]))
    hidden = np.zeros_like(seen)
    assert find_facing(grey, hidden, pose, place("interior").searched) is None


@pytest.mark.parametrize(
    ("azimuth", "arc", "told"),
    [
        (20.0, (10.0, 30.0), "inside"),
        (34.0, (10.0, 30.0), "inside"),  # no face is read to 4 degrees
        (60.0, (10.0, 30.0), "outside"),
        (-178.0, (170.0, -170.0), "inside"),
        (90.0, (-40.0, 40.0), "unsure"),  # in so wide an arc no number is told
        (90.0, (-180.0, 180.0), "inside"),
    ],
)
def test_what_is_told_of_a_clear_face(azimuth: float, arc: tuple[float, float], told: str) -> None:
    azimuths = np.arange(128) * 360 / 128 - 180
    away = np.abs([difference(azimuth, one) for one in azimuths])
    likelihood = np.exp(-0.5 * (away / 4.0) ** 2)
    found = FacingEstimate(azimuth, azimuths, likelihood / likelihood.sum())
    assert standing(found, arc) == told


def test_of_a_face_that_may_look_two_ways_nothing_is_told() -> None:
    azimuths = np.arange(128) * 360 / 128 - 180
    likelihood = np.exp(-0.5 * ((np.abs(azimuths) - 90.0) / 4.0) ** 2)
    found = FacingEstimate(90.0, azimuths, likelihood / likelihood.sum())
    assert standing(found, (80.0, 100.0)) == "unsure"
    assert standing(found, (-5.0, 5.0)) == "unsure"


def test_in_the_light_the_face_shows_what_was_promised() -> None:
    found = checked(taken("generic", "interior", 71.0), promised("interior"))
    assert found.standing == "inside"
    assert found.grade == answer("interior").grade
    assert found.match == pytest.approx(answer("interior").match, abs=5)
    assert found.key_difference_deg == pytest.approx(0.0, abs=8)
    assert found.light.ratio_stops == pytest.approx(promised("interior").light.ratio_stops, abs=0.2)


@pytest.mark.parametrize("off", [-60.0, 50.0])
def test_how_far_to_turn_is_told(off: float) -> None:
    turn = answer("interior").turn_refined_deg
    narrow = replace(promised("interior"), arc_deg=(turn - 12, turn + 12))
    found = checked(taken("male", "interior", turn - off), narrow)
    assert found.standing == "outside"
    assert found.turn_error_deg == pytest.approx(off, abs=10)


def test_what_the_background_tells_counts_more() -> None:
    found = checked(taken("generic", "interior", 71.0), promised("interior"), lens_deg=150.0)
    assert (found.facing_deg, found.standing) == (150.0, "outside")
    assert found.turn_error_deg == pytest.approx(answer("interior").turn_refined_deg - 150.0)


@pytest.mark.parametrize(("style", "azimuth", "elevation"), [(STYLE, 50, 45), ("butterfly", 0, 45)])
def test_without_a_place_it_is_the_studio(style: str, azimuth: float, elevation: float) -> None:
    found = checked(portrait("generic", azimuth, elevation), Promise(pack(), style))
    assert found.grade in ("yes", "soft")
    assert (found.facing_deg, found.turn_error_deg) == (None, None)
    other = checked(portrait("generic", -80.0, 10.0), Promise(pack(), style))
    assert other.grade == "no"


def test_a_painted_style_has_no_grade() -> None:
    assert graded_by("generic", pack(), "my-style") is None
    assert graded_by("generic", pack(), STYLE) is pack()
    other = graded_by("generic-dark", load_named_pack("generic-dark"), STYLE)
    assert other is not None
    assert other.header.transport_sha256 == pack().header.transport_sha256


def test_of_a_silhouette_the_face_tells_no_turn() -> None:
    found = solve_all(pack(), place("interior").searched, styles=["silhouette"])[0]
    goal = found.turn_refined_deg
    silhouette = promise_of_place(place("interior"), goal, found.arc_deg, pack(), "silhouette")
    told = checked(taken("generic", "interior", 71.0), silhouette)
    assert (told.standing, told.turn_error_deg, told.grade) == ("unsure", None, None)
