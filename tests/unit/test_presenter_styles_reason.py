"""The reason in the details: the light in the way, what would help, and the areas on the face."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from app.core.measure.finish.findings import find
from app.core.places.place import AnswerBasis, Place
from app.core.places.place_folder import create_place, read_place, write_place
from app.core.reasons.diagnosis import Diagnosis, diagnose, solver_of
from app.core.reasons.light_in_the_way import lamp_lights
from app.core.solver.lens.lens_wish import STRAIGHT
from app.core.solver.shortfall import AreaShortfall
from app.ui.screens.styles.reason.reason import NO_REASON, ReasonState
from app.words.phrases.light_in_the_way import area_labels, help_words, needs_label
from tests.helpers.styles_screen import Table, head, scene_light


def open_studio(folder: Path) -> Table:
    return Table(folder).open(scene_light("studio"))


def why(table: Table, style: str) -> ReasonState:
    table.presenter.choose(style)
    return table.presenter.resolve().detail.why


def test_the_details_say_what_the_command_says(tmp_path: Path) -> None:
    table, light, pack = (
        open_studio(tmp_path),
        scene_light("studio"),
        head().pack,
    )
    findings = find(light.environment.radiance)
    lights = lamp_lights(light.environment, findings, light.searched)
    names = [style.name for style in pack.styles]
    diagnoses = diagnose(
        pack, lights, table.model.results, solver_of(pack, [], STRAIGHT, "picture", names, 0.0)
    )
    reasons = 0
    for result in table.model.results:
        if not isinstance(result.shortfall, AreaShortfall):
            assert why(table, result.name) is NO_REASON
            continue
        words = help_words(diagnoses.get(result.name, Diagnosis()), result)
        state = why(table, result.name)
        assert state.words == words
        assert state.needs == needs_label(result.shortfall)
        assert {mark.label for mark in state.marks} <= set(area_labels(result.shortfall))
        reasons += bool(words)
    assert reasons >= 10


def test_a_lamp_has_its_letter_on_probe(tmp_path: Path) -> None:
    """The lists on Probe and the reasons name the same lamps."""
    table = open_studio(tmp_path)
    letters = {lamp.letter for lamp in find(scene_light("studio").environment.radiance).lamps}
    words = [why(table, result.name).words for result in table.model.results]
    named = {text[text.index("(") + 1] for text in words if "(" in text}
    assert named
    assert named <= letters


@pytest.mark.parametrize("front_deg", [0.0, 77.0])
def test_the_reason_does_not_depend_on_the_front(tmp_path: Path, front_deg: float) -> None:
    """Only turns are told from where the photographer stands."""
    table = Table(tmp_path).open(scene_light("studio"), front_deg=front_deg)
    state = why(table, "left-rembrandt")
    assert state.words == why(open_studio(tmp_path), "left-rembrandt").words
    assert len(state.marks) == 2


def test_away_from_the_best_turn_there_are_no_numbers(tmp_path: Path) -> None:
    """The outlines stay, because the areas are where they are at any turn."""
    table = open_studio(tmp_path)
    best = why(table, "left-loop")
    table.presenter.look_at(10.0)
    aside = table.presenter.resolve().detail.why
    assert (best.needs != "", aside.needs) == (True, "")
    assert aside.words == best.words
    for one, other in zip(best.marks, aside.marks, strict=True):
        for loop, same in zip(one.loops, other.loops, strict=True):
            assert np.array_equal(loop, same)


def test_swapped_pictures_have_no_labels(tmp_path: Path) -> None:
    """The labels belong to the picture here, which is then in the place of the target."""
    table = open_studio(tmp_path)
    before = why(table, "left-loop")
    table.presenter.swap(True)
    swapped = table.presenter.resolve().detail
    assert (before.needs != "", swapped.why.needs) == (True, "")
    assert swapped.why.words == before.words


def test_no_light_has_no_reason(tmp_path: Path) -> None:
    assert why(Table(tmp_path).open(None), "left-loop") is NO_REASON


def test_the_papers_rule_has_no_reason(tmp_path: Path) -> None:
    table = open_studio(tmp_path)
    table.model.update(settings=table.model.settings.with_("paper_mode", True))
    assert why(table, "left-loop") is NO_REASON


def test_the_spot_of_the_day_that_gives_the_style_is_named(tmp_path: Path) -> None:
    table = open_studio(tmp_path)
    noon = datetime(2026, 11, 21, 12, tzinfo=UTC)
    result = next(one for one in table.model.results if one.name == "left-rembrandt")
    assert result.grade == "no"
    yes = replace(result, grade="yes", attainable=True, shortfall=None)
    folder = create_place(tmp_path / "places", "Stairs", noon)
    write_place(folder, replace(read_place(folder), asked=AnswerBasis(), results=(yes,)))
    assert "Stairs" not in why(table, "left-rembrandt").words
    table = open_studio(tmp_path)
    table.model.update(place=Place("Here", noon))
    assert "Stairs" in why(table, "left-rembrandt").words
    assert "Stairs" not in why(table, "left-split").words
