"""A copy of a style without strokes is the style: turn, match, grade, reason, arc and picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.painting.user_style import UserStyle, read_user_style, text_path
from app.core.painting.user_styles import list_user_styles
from app.core.places.place import Place
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.style_result import StyleResult
from app.core.styles.lamps import Studio
from app.ui.presenters import heads
from app.ui.presenters.window_model import Step
from app.ui.screens.paint.screen import PaintPresenter
from app.ui.screens.styles.gallery import Sizes
from app.words.why_out_of_reach import out_of_reach_sentence
from tests.helpers.cases import sample_first
from tests.helpers.styles_screen import Table, head, scene_light

_SIZE = (60, 50)
_SETTINGS: dict[str, Callable[[Table], None]] = {
    "plain": lambda table: None,
    "lamps": lambda table: table.desk.choose_lamps(Studio(30.0, 2.0)),
    "short": lambda table: table.desk.choose_lens(LensWish("short")),
    "marker": lambda table: table.desk.move_front(77.0),
}


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Table:
    monkeypatch.setattr(heads, "load_head", lambda name, *_: head(name))
    table = Table(tmp_path)
    table.model.update(place=Place("Studio", datetime(2026, 11, 21, tzinfo=UTC)))
    table.presenter.sized(Sizes(portrait=_SIZE, card=(60, 50)))
    table.open(scene_light("studio"))
    return table


def _paint(table: Table, key: str) -> PaintPresenter:
    paint = PaintPresenter(table.services, table.desk)
    paint.sized(*_SIZE)
    _enter(table, paint, key)
    return paint


def _enter(table: Table, paint: PaintPresenter, key: str) -> None:
    table.model.update(step=Step.STYLES, painting=key)
    paint.enter()


def _same(table: Table, paint: PaintPresenter, key: str) -> None:
    """Compare what Paint shows with what the Styles screen shows for a style."""
    table.model.choose(key)
    live, detail = paint.resolve().live, table.presenter.resolve().detail
    result = next(one for one in table.model.results if one.name == key)
    assert not live.stale
    assert live.turn_deg == detail.best == result.turn_refined_deg
    assert live.turn == detail.turn
    assert live.match == detail.match
    assert live.arc == detail.arc
    assert live.limit == detail.limit
    assert live.curve == pytest.approx(result.match_curve)
    if not result.attainable:
        assert live.good == out_of_reach_sentence(result.shortfall)
    assert live.picture is not None
    assert detail.here is not None
    assert np.array_equal(live.picture, detail.here)


def _equal(one: StyleResult, other: StyleResult) -> None:
    for name in (each.name for each in fields(StyleResult)):
        if name in ("name", "title"):
            continue
        a, b = getattr(one, name), getattr(other, name)
        assert np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b, name


_CASES = [("generic", "plain"), ("generic", "lamps"), ("generic-dark", "short")] + [
    (head, setting)
    for head in ("generic", "generic-dark")
    for setting in ("plain", "lamps", "marker", "short")
]


@pytest.mark.parametrize(
    ("name", "setting"),
    sample_first(dict.fromkeys(_CASES), 2),
)
def test_painting_without_strokes_shows_the_style(table: Table, name: str, setting: str) -> None:
    table.desk.heads.load(name)
    _SETTINGS[setting](table)
    paint = PaintPresenter(table.services, table.desk)
    paint.sized(*_SIZE)
    for key in [style.name for style in head(name).pack.styles]:
        _enter(table, paint, key)
        _same(table, paint, key)
        paint.leave()


def test_copy_saved_without_strokes_is_the_style(table: Table) -> None:
    key = "left-rembrandt"
    paint = _paint(table, key)
    paint.files.named("save", "My copy")
    copy = _only(table)
    assert copy.copy_of == key
    for setting in (_SETTINGS["plain"], _SETTINGS["lamps"], _SETTINGS["marker"]):
        setting(table)
        answers = {one.name: one for one in table.model.results}
        _equal(answers[copy.name], answers[key])
        mine, style = table.card(copy.name), table.card(key)
        assert (mine.turn, mine.word, mine.in_reach) == (style.turn, style.word, style.in_reach)
        pictures = (mine.target, mine.here, style.target, style.here)
        assert all(picture is not None for picture in pictures)
        mine_target, mine_here, target, here = map(np.asarray, pictures)
        assert np.array_equal(mine_target, target)
        assert np.array_equal(mine_here, here)
    reopened = _paint(table, copy.name)
    table.presenter.choose(key)
    assert reopened.resolve().live.match == table.presenter.resolve().detail.match


def test_stroke_makes_a_style_of_its_own_and_undo_takes_it_back(table: Table) -> None:
    key = "left-rembrandt"
    paint = _paint(table, key)
    before = paint.resolve().live
    canvas = paint.canvas
    assert canvas is not None
    middle = canvas.size / 2
    paint.press((middle, middle, 1.0))
    paint.draw([(middle + 40, middle, 1.0)])
    paint.lift()
    assert paint.resolve().live.curve != before.curve
    paint.undo()
    _same(table, paint, key)


def test_saved_strokes_undone_and_saved_again_are_the_style(table: Table) -> None:
    key = "left-rembrandt"
    paint = _paint(table, key)
    canvas = paint.canvas
    assert canvas is not None
    paint.dab(canvas.size / 2, canvas.size / 2)
    paint.files.named("save", "My copy")
    assert _only(table).copy_of == ""
    paint.undo()
    paint.files.ask_save()
    copy = _only(table)
    assert copy.copy_of == key
    answers = {one.name: one for one in table.model.results}
    _equal(answers[copy.name], answers[key])


def test_copy_keeps_its_mark_in_its_file(table: Table) -> None:
    paint = _paint(table, "left-loop")
    paint.files.named("save", "My loop")
    copy = _only(table)
    file = text_path(table.services.folders.styles, copy.name)
    assert read_user_style(file).untouched
    assert "untouched" not in file.read_text().replace("untouched = true", "")
    told: dict[str, Any] = {"origin": "left-of-nothing"}
    assert replace(copy, **told).copy_of == ""


def _only(table: Table) -> UserStyle:
    ((style,), damaged) = list_user_styles(table.services.folders.styles)
    assert damaged == ()
    return style
