"""Places side by side for one style: read one by one, ranked, and opened with the style."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from app.core.base.paths import resources
from app.core.places.place_folder import read_place
from app.core.places.place_list import list_places
from app.core.styles.styles import NAMES
from app.ui.presenters.spots import NONE_READ, SpotsPresenter, SpotsState
from app.ui.presenters.window_model import Step
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.styles_screen import HoldingRunner, Table, on_time

SCENES = resources() / "demo" / "scenes"


@pytest.fixture
def table(tmp_path: Path) -> Table:
    """A table with two places, the studio open."""
    made = on_time(Table(tmp_path, ImmediateRunner()))
    for scene in ("forest", "studio"):
        made.desk.open_paths([SCENES / f"{scene}.exr"])
    assert made.desk.keep_all()
    return made


def compared(table: Table, tmp_path: Path, more: tuple[Path, ...] = ()) -> SpotsPresenter:
    folders = [one.folder for one in list_places(tmp_path / "places")]
    presenter = SpotsPresenter(table.services, table.desk, [*folders, *more])
    presenter.attach(MagicMock())
    return presenter


def best(state: SpotsState) -> list[str]:
    return [card.name for card in state.cards if card.best]


def test_the_best_spot_is_marked_with_its_reasons(table: Table, tmp_path: Path) -> None:
    presenter = compared(table, tmp_path)
    presenter.choose("flat")
    state = presenter.resolve()
    own = {each.name: read_place(each.folder) for each in list_places(tmp_path / "places")}
    match = {
        name: next(one for one in place.results if one.name == "flat")
        for name, place in own.items()
    }
    inside = {name: one for name, one in match.items() if one.attainable}
    assert inside, "the test needs a style that one of the places gives"
    first = max(inside, key=lambda name: (inside[name].grade == "yes", inside[name].match))
    assert best(state) == [first]
    # The numbers of the screens, and the reason in words.
    card = next(card for card in state.cards if card.best)
    assert f"match {int(inside[first].match)}" in card.grade_words
    assert "of leeway" in card.grade_words
    assert state.verdict.startswith(f"Best spot for Flat: {first}.")
    assert card.picture is not None
    assert state.cards[0] is card or state.cards[0].best


def test_every_style_says_where_it_is_in_reach(table: Table, tmp_path: Path) -> None:
    state = compared(table, tmp_path).resolve()
    assert [key for key, _, _ in state.styles] == list(NAMES)
    places = {one.name: read_place(one.folder) for one in list_places(tmp_path / "places")}
    for key, _, where in state.styles:
        for name, place in places.items():
            inside = next(one for one in place.results if one.name == key).attainable
            assert (name in where) == inside, (key, where)
    reached = sum("out of reach" not in where for _, _, where in state.styles)
    assert state.anywhere.startswith(f"{reached} of {len(NAMES)} styles")


def test_a_style_that_no_spot_gives_has_no_best_but_a_nearest(table: Table, tmp_path: Path) -> None:
    presenter = compared(table, tmp_path)
    state = presenter.resolve()
    none = next(key for key, _, where in state.styles if "out of reach" in where)
    presenter.choose(none)
    state = presenter.resolve()
    assert best(state) == []
    assert state.verdict.startswith("No spot here works for")
    assert all(card.grade_words.startswith("Out of reach") and card.why for card in state.cards)


def test_one_that_cannot_be_read_says_so_and_the_others_are_compared(
    table: Table, tmp_path: Path
) -> None:
    gone = tmp_path / "places" / "gone"
    state = compared(table, tmp_path, (gone,)).resolve()
    assert len(state.cards) == 3
    (bad,) = (card for card in state.cards if card.folder == gone)
    assert bad.why.startswith("There is no place")
    assert not bad.grade_words
    assert best(state)


def test_opening_leads_to_the_place_with_that_style(table: Table, tmp_path: Path) -> None:
    presenter = compared(table, tmp_path)
    presenter.choose("right-split")
    here = table.model.place_folder
    other = next(one.folder for one in list_places(tmp_path / "places") if one.folder != here)
    presenter.open(other)
    model = table.model
    assert (model.place_folder, model.chosen, model.step) == (other, "right-split", Step.STYLES)
    assert (model.needle_deg, model.goal_deg) == (None, None)
    # The one that is open already is not read again.
    light = model.light
    presenter.choose("left-loop")
    presenter.open(other)
    assert model.light is light
    assert model.chosen == "left-loop"


def test_nothing_is_said_before_they_are_read_and_closing_stops_it(
    table: Table, tmp_path: Path
) -> None:
    runner = HoldingRunner()
    runner.held.add("spots")
    folders = [one.folder for one in list_places(tmp_path / "places")]
    services = replace(table.services, runner=runner)
    presenter = SpotsPresenter(services, table.desk, folders)
    presenter.attach(MagicMock())
    assert presenter.resolve() == SpotsState(verdict="Reading place 1 of 2…")
    runner.waiting["spots"]()
    assert presenter.resolve() == SpotsState(verdict="Reading place 2 of 2…")
    assert runner.waiting
    presenter.detach()
    assert not runner.waiting


def test_where_none_can_be_read_each_says_why(table: Table, tmp_path: Path) -> None:
    gone = [tmp_path / "places" / name for name in ("one", "two")]
    presenter = SpotsPresenter(table.services, table.desk, gone)
    presenter.attach(MagicMock())
    state = presenter.resolve()
    assert state.verdict == NONE_READ
    assert all(card.why.startswith("There is no place") for card in state.cards)
