"""Every number on a screen is of what is selected, or visibly being computed."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from app.core.base.angles import wrap
from app.core.places.place import Place
from app.core.solver.lens.lens_wish import LensWish
from app.core.styles.lamps import Studio
from app.ui.presenters import heads, solving
from app.ui.presenters.window_frame import FramePresenter
from app.ui.presenters.window_model import COMPUTING, Step
from app.ui.screens.registry import screen
from app.ui.screens.styles.screen import StylesState
from app.ui.screens.turn.screen import TurnPresenter
from tests.helpers.styles_screen import HoldingRunner, Table, head, scene_light

DARK = "generic-dark"


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Table:
    """A solved place, from now on with slow answers."""
    monkeypatch.setattr(heads, "load_head", lambda name, *_: head(name))
    table = Table(tmp_path, HoldingRunner())
    table.model.update(place=Place("Studio", datetime(2026, 11, 21, tzinfo=UTC)))
    table.open(scene_light("studio"))
    table.runner.held.update({"head", "solve"})
    return table


def _numbers(state: StylesState) -> list[str]:
    """Counts of the filters that are answers."""
    return [words for key, words in state.filters if key in ("in", "out")]


@pytest.mark.parametrize(
    "change",
    [
        lambda table: table.desk.heads.load(DARK),
        lambda table: table.desk.move_front(40.0),
        lambda table: table.model.set("paper_mode", True),
        lambda table: table.desk.choose_lamps(Studio(30.0, None)),
        lambda table: table.desk.choose_lens(LensWish("short")),
        lambda table: table.model.update(light=scene_light("interior")),
    ],
    ids=["head", "front", "paper mode", "lamps", "lens", "place"],
)
def test_styles_screen_is_stale_until_the_new_answer(table: Table, change: object) -> None:
    before = table.presenter.resolve()
    assert not before.stale
    assert not before.detail.stale
    change(table)  # type: ignore[operator]
    state = table.presenter.resolve()
    assert state.stale
    assert state.detail.stale
    assert not state.detail.main_works
    assert all(card.stale for card in state.cards)
    assert not any(digit in words for words in _numbers(state) for digit in "0123456789")
    assert not any(digit in state.cards[0].spoken for digit in "0123456789")
    for key in ("head", "solve"):
        if key in table.runner.waiting:
            table.runner.release(key)
    state = table.presenter.resolve()
    assert not state.stale
    assert not state.detail.stale
    assert state.detail.turn == table.card(state.detail.key).turn or not state.detail.in_reach


def test_head_is_selected_before_it_is_loaded(table: Table) -> None:
    frame = FramePresenter(table.services)
    table.model.update(step=Step.STYLES)
    table.desk.heads.load(DARK)
    assert table.model.head is not None
    assert table.model.head.name == "generic"
    assert "dark" in frame.resolve().sitter
    assert frame.resolve().status == COMPUTING
    table.runner.release("head")
    assert frame.resolve().status == COMPUTING
    table.runner.release("solve")
    assert frame.resolve().status != COMPUTING


def test_answer_for_the_head_before_does_not_count(table: Table) -> None:
    table.desk.move_front(40.0)
    old = table.runner.waiting["solve"]
    table.desk.heads.load(DARK)
    assert "solve" not in table.runner.waiting
    assert table.model.computing
    table.runner.release("head")
    table.runner.release("solve")
    answered = table.model.answered
    assert answered is not None
    assert answered.head is head(DARK)
    assert old is not None
    assert not table.model.computing


def test_status_and_heading_count_the_same(table: Table) -> None:
    table.runner.held.clear()
    frame = FramePresenter(table.services)
    table.model.update(step=Step.STYLES)
    for name in ("generic", DARK):
        for scene in ("studio", "interior"):
            table.desk.heads.load(name)
            table.model.update(light=scene_light(scene))
            state = table.presenter.resolve()
            gives = f"{state.groups[0].count} of {len(state.cards)} styles"
            assert frame.resolve().status == f"This place gives {gives}."


def test_rail_shows_no_goal_of_another_head(table: Table) -> None:
    table.model.update(step=Step.STYLES)
    table.presenter.turn()
    table.model.update(step=Step.STYLES)
    assert screen("turn").note(table.model)[0]
    table.desk.heads.load(DARK)
    assert screen("turn").note(table.model) == ("", "")
    for key in ("head", "solve"):
        table.runner.release(key)
    result = table.model.result
    assert result is not None
    assert table.model.goal_deg == result.turn_refined_deg


def test_goal_set_by_hand_stays_with_another_head(table: Table) -> None:
    result = table.model.result
    assert result is not None
    goal = wrap(result.turn_refined_deg + 31.0)
    table.model.update(goal_deg=goal)
    table.desk.heads.load(DARK)
    for key in ("head", "solve"):
        table.runner.release(key)
    assert table.model.goal_deg == goal


def test_place_closed_while_computing_keeps_the_selected_head(table: Table) -> None:
    saving = table.desk.saving
    table.desk.heads.load(DARK)
    kept = saving._now()
    assert kept is not None
    assert kept.head == DARK
    assert kept.asked is not None
    assert kept.asked.head == "generic"


def test_failed_solve_leaves_no_answer(table: Table, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ValueError

    monkeypatch.setattr(solving, "solve_place", fail)
    table.desk.move_front(40.0)
    table.runner.release("solve")
    assert table.model.results == ()
    assert not table.presenter.resolve().stale


def test_sheet_and_numbers_wait_for_the_answer(table: Table) -> None:
    works = {action.key: action.enabled for action in table.presenter.actions()}
    assert works["set-sheet"]()
    assert works["copy-numbers"]()
    table.desk.heads.load(DARK)
    assert not works["set-sheet"]()
    assert not works["copy-numbers"]()
    assert not works["styles-main"]()
    assert not works["turn-anyway"]()


def test_turn_screen_is_stale_until_the_new_answer(table: Table) -> None:
    turn = TurnPresenter(table.services, table.desk)
    table.presenter.turn()
    assert not turn.resolve().stale
    table.desk.heads.load(DARK)
    state = turn.resolve()
    assert state.stale
    assert (state.style.match, state.style.match_at_goal) == (COMPUTING, "")


def test_moving_needle_keeps_no_ratio_of_another_turn(table: Table) -> None:
    at = table.presenter.resolve().detail
    snapshot = table.presenter._snapshot
    assert snapshot is not None
    detail = table.presenter._pictures._detail
    moved = detail.at(
        snapshot,
        at.key,
        wrap(at.needle + 20.0),
        table.presenter._pictures.sizes,
        quick=True,
        last=replace(at, here_exposed="+1.0 stops"),
    )
    assert moved.ratio == COMPUTING
    assert moved.here_tag == COMPUTING
    assert moved.here_exposed == moved.ratio_tip == moved.glare == ""
