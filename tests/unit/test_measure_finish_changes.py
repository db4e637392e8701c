"""What a change of the light does to the answers, and how it is put into words."""

from __future__ import annotations

import numpy as np
import pytest

from app.core.base.errors import EnvironmentFileError
from app.core.measure.finish.remarks import CostlyChange, MaskingChanges
from app.core.measure.finish.turn_changes import Change, changes, masking_changes
from app.core.solver.solve import solve_all
from app.core.styles.style_pack import StylePack
from app.words.remarks import remark_words
from tests.helpers.synthetic import synthetic_pack


@pytest.fixture(scope="module")
def pack() -> StylePack:
    return synthetic_pack()


def room(azimuth: float, fill: float = 0.02) -> np.ndarray:
    """One lamp in a dim room, (32, 64, 3)."""
    light = np.full((32, 64, 3), fill, np.float32)
    light[10:14, (round(azimuth / 5.625) + np.arange(30, 34)) % 64] += 1.0
    return light


def test_the_same_light_at_any_exposure_changes_nothing(pack: StylePack) -> None:
    found = changes(room(0.0), 7.0 * room(0.0), pack)
    assert [each.style for each in found] == [style.name for style in pack.styles]
    for each in found:
        assert each.change_deg == pytest.approx(0.0, abs=1e-3)
        assert each.given_up == pytest.approx(0.0, abs=1e-6)
    remark = masking_changes(found)
    assert remark.worst is None
    assert remark.moved_deg == pytest.approx(0.0, abs=1e-3)
    assert (remark.gained, remark.lost) == ((), ())


def test_a_lamp_that_moved_takes_every_turn_with_it(pack: StylePack) -> None:
    found = changes(room(0.0), room(90.0), pack)
    # Without signatures one lamp may pass for one of two, on either side.
    single = {style.name for style in pack.styles if len(style.lamps) == 1}
    reached = [each for each in found if each.attainable_before and each.style in single]
    assert reached
    for each in reached:
        assert each.change_deg == pytest.approx(90.0, abs=0.1)
        assert each.turn_after_deg != each.turn_before_deg
    worst = max(reached, key=lambda each: each.given_up)
    assert worst.given_up > 0.3
    remark = masking_changes(found)
    assert remark.worst is not None
    assert remark.worst.title in remark_words(remark)


def test_given_up_is_what_the_old_turn_loses_on_the_new_curve(pack: StylePack) -> None:
    before, after = room(0.0), room(0.0) + 0.8 * room(60.0)
    found = changes(before, after, pack, "paper")
    new = solve_all(pack, after @ np.array([0.2126, 0.7152, 0.0722], np.float32), "paper")
    old = solve_all(pack, before @ np.array([0.2126, 0.7152, 0.0722], np.float32), "paper")
    for each, b, a in zip(found, old, new, strict=True):
        curve = a.quality_curve
        expected = (curve.max() - curve[b.turn_index]) / np.ptp(curve)
        assert each.given_up == pytest.approx(expected, abs=1e-6)
        assert 0.0 <= each.given_up <= 1.0


def test_a_black_environment_is_refused(pack: StylePack) -> None:
    with pytest.raises(EnvironmentFileError, match="black"):
        changes(room(0.0), np.zeros((32, 64, 3), np.float32), pack)


def change(
    moved: float, cost: float = 0.0, *, before: bool = True, after: bool = True, name: str = "loop"
) -> Change:
    return Change(name, name.title(), 10.0, 10.0 + moved, moved, cost, before, after)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ([change(1.4), change(-0.3)], MaskingChanges(2, 0, None, 1.4, (), ())),
        ([change(0.1)], MaskingChanges(1, 0, None, 0.1, (), ())),
        (
            [change(0.1), change(90.0, 0.5, before=False, after=False)],
            MaskingChanges(1, 0, None, 0.1, (), ()),
        ),
        ([change(170.0, 0.002)], MaskingChanges(1, 0, None, 170.0, (), ())),
        (
            [change(12.0, 0.08), change(1.0)],
            MaskingChanges(2, 1, CostlyChange("Loop", 10.0, 22.0, 0.08), 1.0, (), ()),
        ),
        (
            [change(0.0), change(0.2, before=False, name="rim")],
            MaskingChanges(2, 0, None, 0.2, ("Rim",), ()),
        ),
        (
            [change(0.0), change(0.2, after=False, name="rim")],
            MaskingChanges(2, 0, None, 0.2, (), ("Rim",)),
        ),
        ([change(5.0, before=False, after=False)], MaskingChanges(0, 0, None, 0.0, (), ())),
    ],
)
def test_masking_changes_count_what_is_in_reach(
    found: list[Change], expected: MaskingChanges
) -> None:
    assert masking_changes(found) == expected
    assert remark_words(expected).endswith(".")
