"""Where the lens should be: yaw 0 as before, backgrounds, short and broad, mirror images."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from app.core.base.angles import wrap
from app.core.base.arrays import Float32
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce_light
from app.core.portrait.head_views import load_views_of
from app.core.solver.lens.lens_search import NAMED_GAIN, lighting_of, solve_lens
from app.core.solver.lens.lens_wish import LIGHTINGS, LensWish
from app.core.solver.lens.view_tables import ViewTables, view_tables, views_of
from app.core.solver.shortfall import LensShortfall, Obstacle
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import GRADES
from app.core.solver.turn_choice import OBJECTIVES, PRICE, Objective
from app.core.styles.styles import mirror_name
from tests.helpers.shipped import generic_pack
from tests.helpers.synthetic import lamp_environment


@lru_cache(maxsize=1)
def views() -> list[ViewTables]:
    return views_of(generic_pack(), "generic")


def places(count: int, seed: int) -> list[np.ndarray]:
    """Made up places: a few lamps in colour, and light from all around."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        light = np.zeros((32, 64, 3))
        for _ in range(rng.integers(1, 4)):
            lamp = lamp_environment(
                rng.uniform(-180, 180), rng.uniform(-10, 70), rng.uniform(8, 40)
            )
            light += lamp[..., None] * rng.uniform(0.2, 1.0, 3)
        made.append(light + rng.uniform(0.0, 0.05))
    return made


def by_name(
    light: np.ndarray, wish: LensWish, objective: Objective = "picture"
) -> dict[str, StyleResult]:
    found = solve_lens(generic_pack(), views(), light, wish, objective)
    return {result.name: result for result in found}


def same(one: StyleResult, two: StyleResult) -> bool:
    """Whether two answers are bit for bit the same, but for what yaw adds."""
    added = {"gains", "yaw_arc_deg"}
    names = [name for name in StyleResult.__slots__ if name not in added]
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in names)


@pytest.mark.parametrize("objective", ["picture", "paper"])
@pytest.mark.parametrize("front", [0.0, 33.0])
def test_straight_in_front_all_is_as_before(objective: str, front: float) -> None:
    for light in places(4, 5):
        before = solve_all(generic_pack(), light, objective, front_deg=front)  # type: ignore[arg-type]
        now = solve_lens(generic_pack(), views(), light, LensWish(), objective, front_deg=front)  # type: ignore[arg-type]
        assert all(same(*pair) for pair in zip(before, now, strict=True))


@pytest.mark.parametrize("wish", [LensWish("auto"), LensWish("short"), LensWish(20.0)])
def test_a_mirrored_place_gives_mirrored_answers(wish: LensWish) -> None:
    other = LensWish(-20.0) if wish.yaw == 20.0 else wish
    for light in places(3, 6):
        here, there = by_name(light, wish), by_name(light[:, ::-1], other)
        for name, one in here.items():
            two = there[mirror_name(name) or name]
            assert two.match == pytest.approx(one.match, abs=0.01), name
            if one.match > 50:
                assert abs(wrap(one.turn_refined_deg + two.turn_refined_deg)) < 0.5, name
                assert two.yaw_deg == pytest.approx(-one.yaw_deg), name


def test_a_head_that_is_not_symmetric_is_seen_from_both_sides_by_itself() -> None:
    """Nothing is mirrored for it; here its views from the right are mirror images in a file."""
    known = load_views_of(generic_pack(), "generic")
    alone = replace(generic_pack(), header=replace(generic_pack().header, paired=True))
    alone.__dict__["tables"] = generic_pack().tables  # its front stays that of the symmetric head
    sides = [
        view_tables(generic_pack(), known.at(yaw, generic_pack().styles), known.shape)
        for yaw in known.yaws
        if yaw
    ]
    for light in places(2, 12):
        wanted = by_name(light, LensWish("auto"))
        found = {one.name: one for one in solve_lens(alone, sides, light, LensWish("auto"))}
        for name, one in wanted.items():
            assert found[name].yaw_deg == one.yaw_deg, name
            assert found[name].match == pytest.approx(one.match, abs=0.02), name
        # Without those to the right, there are no answers there.
        left = [side for side in sides if side.yaw_deg > 0]
        some = solve_lens(alone, left, light, LensWish("auto"))
        assert all(one.yaw_deg >= 0 for one in some)


def test_turn_nose_and_background_belong_together() -> None:
    for light in places(3, 7):
        for one in by_name(light, LensWish("auto")).values():
            assert one.nose_deg == pytest.approx(wrap(one.turn_refined_deg - one.yaw_deg))
            assert abs(wrap(one.background_deg - one.turn_refined_deg)) == pytest.approx(180.0)
            assert one.yaw_arc_deg[0] <= one.yaw_deg <= one.yaw_arc_deg[1]


def test_any_yaw_is_never_worse_than_none() -> None:
    for light in places(6, 8):
        straight, free = by_name(light, LensWish()), by_name(light, LensWish("auto"))
        for name, one in straight.items():
            before, now = (GRADES.index(each.grade or "no") for each in (one, free[name]))
            if one.looks_more_like is None and free[name].looks_more_like is None:
                # Each lies towards the middle of its own arc, which costs up to a point.
                assert (now, free[name].match) >= (before, one.match - PRICE), name


def test_the_grade_is_that_of_the_nose() -> None:
    """With the lens anywhere, the grade is what the same nose has straight in front."""
    for light in places(4, 9):
        for yaw in (-30.0, 15.0):
            for one in by_name(light, LensWish(yaw)).values():
                if one.yaw_deg:
                    nose = one.turn_deg - one.yaw_deg
                    window = LensWish(0.0, (nose + 180.0 - 1.0, nose + 180.0 + 1.0))
                    straight = by_name(light, window)[one.name]
                    assert straight.grade == one.grade


def test_a_background_is_kept() -> None:
    wish = LensWish("auto", (70.0, 110.0))
    for light in places(4, 10):
        for one in solve_lens(generic_pack(), views(), light, wish, front_deg=-25.0):
            if one.shortfall != LensShortfall(Obstacle.BACKGROUND):
                assert wish.met_by(one.turn_refined_deg), one.name
                assert 70.0 <= one.background_deg <= 110.0


def test_a_background_out_of_the_heads_reach_is_said() -> None:
    """A rim's far edge cannot be seen from aside, so the lens has to stay where it is."""
    light = lamp_environment(0.0, 10.0, fill=0.01)
    straight = by_name(light, LensWish())["left-rim"]
    away = wrap(straight.background_deg + 90.0)
    found = by_name(light, LensWish(30.0, (away - 1.0, away + 1.0)))["left-rim"]
    assert not found.attainable
    assert found.grade == "no"
    assert found.shortfall == LensShortfall(Obstacle.BACKGROUND)


def test_backgrounds_may_wrap_around() -> None:
    wish = LensWish("auto", (170.0, -170.0))
    assert wish.met_by(0.0)
    assert wish.met_by(-9.0)
    assert not wish.met_by(20.0)
    assert wish.moved(30.0).background == (140.0, 160.0)


def test_short_and_broad_are_never_swapped() -> None:
    """One lamp anywhere: the side away from the lens is lit, or the side towards it."""
    rng, wrong, named = np.random.default_rng(2), [], 0
    for _ in range(60):
        azimuth = rng.uniform(-180, 180)
        light = lamp_environment(azimuth, rng.uniform(-20, 60), 12.0)
        for asked in ("short", "broad"):
            for one in solve_lens(generic_pack(), views(), light, LensWish(asked)):
                if one.lighting == "front":
                    continue
                named += 1
                key = wrap(one.nose_deg - azimuth)
                away = (key > 0) == (one.yaw_deg > 0)
                if one.lighting != asked or away != (asked == "short"):
                    wrong.append((one.name, azimuth, one.yaw_deg, key))
    assert named > 1000
    assert not wrong


def test_lighting_by_hand() -> None:
    names = [LIGHTINGS[n] for n in lighting_of(-30.0, np.array([60.0, -60.0, 14.0, np.nan, 210.0]))]
    assert names == ["broad", "short", "front", "front", "short"]
    assert LIGHTINGS[int(lighting_of(30.0, np.array(179.0)))] == "front"
    assert LIGHTINGS[int(lighting_of(9.0, np.array(60.0)))] == "front"


def demo_light(name: str) -> Float32:
    """(32, 64, 3) light of a bundled place."""
    path = resources() / "demo" / "scenes" / f"{name}.exr"
    return reduce_light(read_environment(path).radiance)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_gains_raise_the_grade_or_the_match(objective: Objective) -> None:
    """Whatever stays out of reach gains nothing; what is listed is what the other wish answers."""
    count = 0
    for light in (
        demo_light("courtyard"),
        demo_light("interior"),
        demo_light("city"),
        *places(20, 11),
    ):
        straight = by_name(light, LensWish(), objective)
        other = {kind: by_name(light, LensWish(kind), objective) for kind in ("short", "broad")}
        for name, one in straight.items():
            for gain in one.gains:
                then = other[gain.lighting][name]
                before, now = (GRADES.index(each.grade or "no") for each in (one, then))
                assert now > 0, name
                assert now > before or (now == before and gain.match >= one.match + NAMED_GAIN)
                assert gain.match == pytest.approx(then.match)
                assert gain.yaw_deg == then.yaw_deg
                assert gain.turn_deg == pytest.approx(then.turn_deg)
                count += 1
    assert count > 3 or objective == "paper"


def test_between_the_views_match_lies_between_theirs() -> None:
    light = lamp_environment(20.0, 40.0, 12.0, fill=0.02)
    near, half, far = (
        by_name(light, LensWish(yaw))["butterfly"].match for yaw in (15.0, 22.5, 30.0)
    )
    assert min(near, far) - 0.5 <= half <= max(near, far) + 0.5
