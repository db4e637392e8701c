"""The power that a lamp is held at: best, stepped by hand, kept while it is moved, and said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from app.core.second_light import lamp_answers as answers
from app.core.second_light.in_hand import InHand, prepare_head, take_in_hand
from app.core.second_light.lamp_answers import (
    LampPosition,
    LampQuestion,
    ask,
    best_held,
)
from app.core.second_light.lamp_presets import KINDS, at_distance, powers_of
from app.core.solver.transport import render
from app.ui.screens.light.placement import pictures
from app.ui.screens.light.placement.pictures import look
from tests.helpers.light_rig import LightRig
from tests.helpers.styles_screen import head, scene_light


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LightRig:
    found = LightRig(tmp_path, monkeypatch)
    found.power = 1 / 8
    return found


def test_the_best_power_is_said_everywhere(rig: LightRig) -> None:
    rig.start(lamp="panel")
    state = rig.state
    assert state.hold.hold.endswith(", at 1/8 power")
    assert state.detail.power == "1/8, 3 stops down"
    assert all(row.power == "1/8 power" for part in state.sections for row in part.rows)
    assert "62 with it at 1/8 power" in state.sections[0].rows[0].spoken
    assert rig.looks[-1][1].power == 1 / 8


def test_moving_the_lamp_keeps_its_power_and_home_brings_the_best_back(rig: LightRig) -> None:
    rig.start(lamp="panel")
    rig.presenter.step_power(1)
    assert rig.state.hold.hold.endswith(", at 1/4 power")
    assert rig.state.detail.after == "52"
    assert rig.state.detail.best_line.endswith(" 1/8 power.")
    assert "°" not in rig.state.detail.best_line
    assert rig.state.hold.map_title.endswith("at this turn at 1/8 power")
    rig.presenter.hold_at(-94.0, 4.0)
    assert rig.looks[-1][1] == LampPosition(-94.0, 4.0, 1 / 4)
    assert rig.state.detail.best_line.endswith(" 1/8 power.")
    assert "20°" in rig.state.detail.best_line
    rig.presenter.go_best()
    assert rig.state.detail.at_best
    assert rig.state.detail.power == "1/8, 3 stops down"


def test_a_lamp_has_a_greatest_and_a_least_power(rig: LightRig) -> None:
    rig.start(lamp="panel")
    for _ in range(20):
        rig.presenter.step_power(1)
    assert rig.state.hold.hold.endswith(", at full power")
    assert (rig.state.detail.weaker, rig.state.detail.stronger) == (True, False)
    for _ in range(20):
        rig.presenter.step_power(-1)
    assert rig.state.detail.power == "1/256, 8 stops down"
    assert (rig.state.detail.weaker, rig.state.detail.stronger) == (False, True)


def test_a_flash_says_what_its_display_says(rig: LightRig) -> None:
    rig.power = 1.0
    rig.start(lamp="flash")
    assert rig.state.detail.power == "1/16, 4 stops down"
    rig.presenter.step_power(1)
    assert rig.state.hold.hold.endswith(", at 1/8 power")


def test_of_a_lamp_with_one_power_none_is_said(rig: LightRig) -> None:
    rig.power = 1.0
    rig.start(lamp="bulb")
    assert "power" not in rig.state.hold.hold
    assert rig.state.detail.power == ""
    rig.presenter.step_power(-1)
    assert rig.looks[-1][1].power == 1.0


def test_the_search_is_given_the_powers_of_the_lamp(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[float, ...]] = []

    def place(*_: object, powers: tuple[float, ...], **__: object) -> tuple[()]:
        asked.append(powers)
        return ()

    monkeypatch.setattr(answers, "place_all", place)
    hand = cast(
        InHand,
        type("Hand", (), {"head": head(), "lamp": at_distance(KINDS["flash"]), "lamp_light": None,
                          "tables": None})(),
    )  # fmt: skip
    question = LampQuestion(scene_light(), 1.0)
    ask(hand, question)
    ask(hand, replace(question, objective="paper"))
    assert asked == [powers_of("flash"), (1.0,)]


@pytest.mark.slow
@pytest.mark.usefixtures("best_turns")
def test_the_picture_is_of_the_power_and_its_match_that_of_the_search() -> None:
    who = head()
    from app.core.base.progress import Token, silent

    hand = take_in_hand(
        prepare_head(who, Token()), at_distance(KINDS["panel"], 0.5), Token(), silent
    )
    answers = ask(hand, LampQuestion(scene_light(), 40.0), ["badger", "left-split"])
    for one in answers.placements:
        assert one.power in powers_of("panel")
        # On the grid, where the search counts; the picture is else of the refined turn.
        exact = replace(answers, placements=(replace(one, turn_refined_deg=one.turn_deg),))
        held = LampPosition(one.lamp_azimuth_deg, one.lamp_altitude_deg, one.power)
        view = look(exact, one.name, held, (88, 80), None)
        assert view.match == pytest.approx(one.match, abs=0.3)
        # The search has 64 turns for the place, and the skin's mean colour for the lamp.
        assert view.change.delta_lightness == pytest.approx(one.change.delta_lightness, rel=0.1)
        assert look(answers, one.name, best_held(one), (88, 80), None).match > one.match - 0.3
        wrong = look(exact, one.name, held._replace(power=4.0 * held.power), (88, 80), None)
        assert wrong.match < view.match - 0.2
    assert any(one.power < 1.0 for one in answers.placements), "a panel drowns a dim place"
    # The lamp's part is linear in its power.
    held = best_held(answers.placements[0])
    full, hidden = pictures._of_lamp(hand, held._replace(power=1.0))
    half, same = pictures._of_lamp(hand, held._replace(power=0.5))
    assert np.allclose(full, 2.0 * half, rtol=1e-5)
    assert np.array_equal(hidden, same)
    assert render(who.transport, np.zeros((*hidden.shape, 3), np.float32)).max() == 0.0
