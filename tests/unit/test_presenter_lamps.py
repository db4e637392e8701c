"""The photographer's lamps: targets and answers follow the choice, which is kept with the place."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.core.base.paths import resources
from app.core.painting.canvas import from_style
from app.core.painting.user_styles import save_user_style
from app.core.places.place import Place
from app.core.portrait.head import Head
from app.core.storage.settings import Settings
from app.core.styles.lamps import AS_PUBLISHED, Studio
from app.core.styles.style_pack_build import StudioPacks
from app.words.verdict import own_lamps_words
from tests.helpers.cases import sample_first
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.styles_screen import HoldingRunner, Table, head, on_time, scene_light

SCENE = resources() / "demo" / "scenes" / "interior.exr"
SOFT = Studio(45.0, 2.0)


@pytest.fixture
def table(tmp_path: Path) -> Table:
    """The gallery with a place that is open."""
    table = Table(tmp_path)
    table.model.update(place=Place("Café", table.services.today()))
    return table.open(scene_light())


def lit(table: Table) -> Head:
    assert table.model.head is not None
    return table.model.head


def reach(table: Table) -> dict[str, str | None]:
    return {result.name: result.grade for result in table.model.results}


def test_targets_grades_and_pictures_follow_the_choice(table: Table) -> None:
    before, grades = table.card("left-loop"), reach(table)
    match = next(one.match for one in table.model.results if one.name == "left-loop")
    table.desk.choose_lamps(SOFT)
    pack = lit(table).pack
    assert sum(pack.studio(style.name) == SOFT for style in pack.styles) >= 0.7 * len(pack.styles)
    assert reach(table) != grades
    after = table.card("left-loop")
    assert before.target is not None
    assert after.target is not None
    # The shadow side is not as dark.
    assert np.mean(after.target < 30) < 0.5 * np.mean(before.target < 30)
    assert match != next(one.match for one in table.model.results if one.name == "left-loop")
    detail = table.presenter.resolve().detail
    assert detail.weights is not None
    row = lit(table).pack.index(detail.key)
    np.testing.assert_array_equal(detail.weights, lit(table).pack.preintegrated[row])


def test_as_in_the_paper_gives_the_shipped_targets_and_the_first_answers_back(table: Table) -> None:
    first = [(one.name, one.match, one.turn_refined_deg) for one in table.model.results]
    table.desk.choose_lamps(SOFT)
    table.desk.choose_lamps(AS_PUBLISHED)
    assert lit(table).pack is head().pack
    assert [(one.name, one.match, one.turn_refined_deg) for one in table.model.results] == first
    assert table.model.place is not None
    assert not table.model.place.studios


def test_a_choice_for_one_style_is_for_its_mirror_image_too_and_for_no_other(table: Table) -> None:
    table.model.choose("left-split")
    table.presenter.lamps.keep_to_style(True)
    table.presenter.lamps.choose("medium", "4:1")
    pack = lit(table).pack
    found = {style.name for style in pack.styles if pack.studio(style.name) != AS_PUBLISHED}
    assert found == {"left-split", "right-split"}
    state = table.presenter.lamps.resolve()
    assert (state.words, state.only) == ("Lamps: 30°, 4:1", True)
    table.model.choose("left-loop")
    state = table.presenter.lamps.resolve()
    assert (state.words, state.size, state.ratio) == ("Lamps: standard", "paper", "none")
    assert not state.only
    # For all others: the style keeps its own.
    table.presenter.lamps.choose("dish@1", "8:1")
    assert lit(table).pack.studio("right-split") == Studio(30.0, 4.0)
    assert lit(table).pack.studio("left-loop").ratio == 8.0
    table.model.choose("left-split")
    table.presenter.lamps.keep_to_style(False)
    assert lit(table).pack.studio("left-split") == lit(table).pack.studio("left-loop")


def test_a_style_that_the_lamps_would_not_show_says_that_it_has_its_own(table: Table) -> None:
    note = own_lamps_words(Studio(None, 2.0))
    table.desk.choose_lamps(Studio(None, 2.0))
    assert lit(table).pack.studio("left-loop-rim") == AS_PUBLISHED
    card, other = table.card("left-loop-rim"), table.card("left-loop")
    assert note in card.tip
    assert note in card.spoken
    assert "own lamps" not in other.tip
    table.model.choose("left-loop-rim")
    assert table.presenter.resolve().detail.lamps_note == note
    table.model.choose("left-loop")
    assert "its own lamps" not in table.presenter.resolve().detail.lamps_note


def test_a_choice_can_be_taken_back(table: Table) -> None:
    table.desk.choose_lamps(Studio(30.0, 4.0))
    table.desk.choose_lamps(SOFT)
    table.desk.choose_lamps(SOFT)
    undo = table.services.undo
    assert undo.undo_words == "change the lamps"
    undo.undo()
    assert lit(table).pack.studio("left-loop") == Studio(30.0, 4.0)
    undo.undo()
    assert lit(table).pack.studio("left-loop") == AS_PUBLISHED
    undo.redo()
    assert lit(table).pack.studio("left-loop") == Studio(30.0, 4.0)


def test_another_head_gets_the_same_lamps(table: Table) -> None:
    table.desk.choose_lamps(Studio(30.0, 4.0))
    table.model.update(head=replace(head(), name="other"))
    assert lit(table).name == "other"
    assert lit(table).pack.studio("left-loop") == Studio(30.0, 4.0)


def test_what_was_chosen_shows_at_once_and_a_newer_choice_overtakes(tmp_path: Path) -> None:
    runner = HoldingRunner()
    table = Table(tmp_path, runner)
    table.model.update(place=Place("Café", table.services.today()))
    table.open(scene_light())
    runner.held.add("solve")
    table.desk.choose_lamps(SOFT)
    assert table.presenter.lamps.resolve().words == "Lamps: 45°, 2:1"
    assert lit(table).pack is head().pack
    table.desk.choose_lamps(Studio(30.0, None))
    runner.release("solve")
    assert lit(table).pack.studio("left-loop") == Studio(30.0, None)
    assert not runner.running("solve")


def test_what_is_one_click_away_is_ready(table: Table, monkeypatch: pytest.MonkeyPatch) -> None:
    table.desk.choose_lamps(Studio(30.0, 4.0))
    table.presenter.lamps.prepare()
    monkeypatch.setattr(StudioPacks, "pack_for", None)
    for size, ratio in (("large", "4:1"), ("medium", "4:1"), ("medium", "2:1")):
        table.presenter.lamps.choose(size, ratio)
    assert lit(table).pack.studio("left-loop") == Studio(30.0, 2.0)


def test_a_painted_style_has_no_lamps(table: Table) -> None:
    one = head()
    canvas = from_style(one.pack, one.transport, "left-rembrandt")
    style = save_user_style(table.folder / "styles", canvas, "Mine", side="left", head="generic")
    table.model.update(user_styles=(style,))
    table.desk.choose_lamps(Studio(None, 2.0))
    table.model.choose(style.name)
    assert not table.presenter.lamps.resolve().own
    assert "its own lamps" not in table.presenter.resolve().detail.lamps_note


def test_without_a_place_there_is_nothing_to_choose_for(tmp_path: Path) -> None:
    table = Table(tmp_path).open()
    assert not table.presenter.lamps.resolve().works
    table.desk.choose_lamps(SOFT)
    assert lit(table).pack is head().pack


class TestKept:
    @pytest.fixture
    def folder(self, tmp_path: Path) -> Path:
        """A place that was kept with lamps."""
        table = on_time(Table(tmp_path, ImmediateRunner())).open()
        table.desk.open_paths([SCENE])
        table.desk.choose_lamps(SOFT)
        table.desk.choose_lamps(Studio(10.0, None), "butterfly")
        assert table.desk.keep_all()
        assert table.model.place_folder is not None
        return table.model.place_folder

    def opened(self, tmp_path: Path, folder: Path) -> Table:
        table = on_time(Table(tmp_path, ImmediateRunner())).open()
        table.desk.open_place(folder)
        return table

    def test_the_place_opens_with_its_lamps(self, tmp_path: Path, folder: Path) -> None:
        table = self.opened(tmp_path, folder)
        assert table.model.studios == {"": SOFT, "butterfly": Studio(10.0, None)}
        assert lit(table).pack.studio("left-loop") == SOFT
        assert lit(table).pack.studio("butterfly") == Studio(10.0, None)
        table.desk.close()
        assert lit(table).pack.studio("left-loop") == AS_PUBLISHED

    def test_a_place_from_before_opens_as_in_the_paper(self, tmp_path: Path, folder: Path) -> None:
        path = folder / "place.json"
        facts = json.loads(path.read_text("utf-8"))
        del facts["studios"]
        path.write_text(json.dumps(facts), "utf-8")
        table = on_time(Table(tmp_path, ImmediateRunner()))
        table.model.update(settings=Settings(lamp_size="large"))
        table.open().desk.open_place(folder)
        assert table.model.studios == {}
        assert lit(table).pack.studio("left-loop") == AS_PUBLISHED
        assert table.told.messages == []

    def test_a_new_place_starts_with_the_lamps_of_the_settings(self, tmp_path: Path) -> None:
        table = on_time(Table(tmp_path, ImmediateRunner()))
        table.model.update(settings=Settings(lamp_size="octabox@1.5", lamp_ratio="3:1"))
        table.open()
        assert lit(table).pack.studio("left-loop").ratio == 3.0, "already before there is a place"
        table.desk.open_paths([SCENE])
        assert table.model.place is not None
        (studio,) = table.model.place.studios.values()
        assert studio.ratio == 3.0
        assert studio.softness_deg == pytest.approx(43.6, abs=0.1)
        assert table.presenter.lamps.resolve().size == "octabox@1.5"

    @pytest.mark.parametrize(
        "bad",
        sample_first(
            [
                [],
                {str(n): {"softness_deg": None, "ratio": None} for n in range(3000)},
                {"": 3},
                {"": {}},
                {"": {"softness_deg": 1e9, "ratio": None}},
                {"": {"softness_deg": None, "ratio": "4:1"}},
            ],
            4,
        ),
        ids=["list", "too many", "number", "empty", "too soft", "words"],
    )
    def test_lamps_that_make_no_sense_are_named_and_left_out(
        self, tmp_path: Path, folder: Path, bad: object
    ) -> None:
        path = folder / "place.json"
        facts = json.loads(path.read_text("utf-8"))
        path.write_text(json.dumps(facts | {"studios": bad}), "utf-8")
        table = self.opened(tmp_path, folder)
        assert table.model.studios == {}
        assert any("the studio’s lamps" in str(told) for told in table.told.messages)
