"""Painting through the presenter: sides and signs, undo, drafts, and what is said when."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.painting.canvas import Advice
from app.core.painting.draft_file import load_draft
from app.core.painting.stroke import Tool
from app.core.portrait.head import Head
from app.core.solver.transport import load_named
from app.core.styles.style_pack_file import load_named_pack
from app.ui.presenters.window_model import NO_LIGHT, Step
from app.ui.screens.paint.canvas import FRONT_ONLY, CanvasMode
from app.ui.screens.paint.live import LIMIT_RING, NO_STROKES
from app.ui.screens.paint.screen import PaintState, PaintView
from app.words.painting import advice_words
from app.words.phrases.directions import SIDES
from tests.helpers.paint_studio import Studio, even_light, lamp_light, studio
from tests.helpers.styles_screen import HoldingRunner

LEFT, RIGHT = ((0.72, 0.35), (0.72, 0.65)), ((0.28, 0.35), (0.28, 0.65))  # of the sitter


@pytest.fixture
def room(tmp_path: Path) -> Studio:
    return studio(tmp_path)


def _view(room: Studio) -> MagicMock:
    view = MagicMock(spec=PaintView)
    room.presenter.attach(view)
    return view


def _state(room: Studio) -> PaintState:
    return room.presenter.resolve()


def _two_sides(room: Studio, bright: object = LEFT, dark: object = RIGHT) -> None:
    room.presenter.tools.change(strength=1.0)
    room.presenter.tools.change(diameter=140)
    room.presenter.tools.change(tool=Tool.BRIGHTER)
    room.stroke(*bright)  # type: ignore[misc]
    room.presenter.tools.change(tool=Tool.DARKER)
    room.stroke(*dark)  # type: ignore[misc]


@pytest.mark.parametrize("lamp_deg", [0.0, -100.0])
@pytest.mark.parametrize("side", ["left", "right"])
def test_brighter_on_a_side_turns_that_side_to_the_lamp(
    tmp_path: Path, lamp_deg: float, side: str
) -> None:
    room = studio(tmp_path, lamp_deg)
    room.enter()
    _two_sides(room, *((LEFT, RIGHT) if side == "left" else (RIGHT, LEFT)))
    live = _state(room).live
    turned = difference(live.turn_deg, lamp_deg)
    assert 45.0 <= (turned if side == "left" else -turned) <= 95.0
    assert live.way == ("clockwise" if live.turn_deg > 0 else "counter-clockwise")
    assert live.direction.replace("\n", "") == live.way
    assert live.turn == f"{abs(round(live.turn_deg))}°"
    assert live.weights is not None
    half = live.weights.shape[1] // 2
    # Light helps on the panorama's left, which the sitter at turn 0 has at their left.
    helps = live.weights[:, :half].sum() - live.weights[:, half:].sum()
    assert (helps > 0) == (side == "left")


def test_where_the_photographer_stands_moves_the_numbers_only(room: Studio) -> None:
    room.enter()
    _two_sides(room)
    before = _state(room).live
    room.model.update(front_deg=30.0)
    after = _state(room).live
    assert difference(after.turn_deg, before.turn_deg) == pytest.approx(-30.0, abs=1e-6)
    assert after.match == before.match
    assert before.picture is not None
    np.testing.assert_array_equal(after.picture, before.picture)


def test_everything_follows_while_the_pen_moves(room: Studio) -> None:
    view = _view(room)
    room.enter("left-split")
    room.presenter.press((120.0, 200.0, 1.0))
    seen = view.show_state.call_args.args[0].live
    view.reset_mock()
    room.presenter.draw([(130.0, 200.0, 1.0), (160.0, 210.0, 1.0)])
    canvas, regions = view.canvas_changed.call_args.args
    assert canvas.touched
    # Only what the brush has touched, and all of it.
    changed = np.argwhere(canvas.weights != canvas.start_weights)
    low, high = changed.min(axis=0), changed.max(axis=0)
    assert min(one.left for one in regions) >= low[1] - 40
    assert max(one.right for one in regions) <= high[1] + 40
    live = view.show_state.call_args.args[0].live
    assert live.weights is not seen.weights
    assert live.curve != seen.curve
    assert live.picture is not None
    view.show_state.assert_called_once()


def test_a_move_of_the_pen_resolves_nothing_but_the_live_column(room: Studio) -> None:
    view = _view(room)
    room.enter("left-split")
    room.presenter.press((120.0, 200.0, 1.0))
    room.presenter.draw([(130.0, 200.0, 1.0)])
    first = view.show_state.call_args.args[0]
    assert first.save.status == "not saved yet"
    room.presenter.draw([(160.0, 210.0, 1.0)])
    second = view.show_state.call_args.args[0]
    assert (second.tools, second.canvas, second.save) == (first.tools, first.canvas, first.save)
    assert second.live is not first.live
    # The same as when everything is resolved.
    room.presenter.live.look()
    fresh = room.presenter.resolve()
    assert (fresh.tools, fresh.save) == (second.tools, second.save)
    for name in ("stale", "sentence", "limit", "origin", "picture_tag", "good", "turn", "curve"):
        assert getattr(fresh.live, name) == getattr(second.live, name)
    np.testing.assert_array_equal(fresh.live.picture, second.live.picture)
    np.testing.assert_array_equal(fresh.live.weights, second.live.weights)


def test_strokes_are_undone_and_done_again_exactly(room: Studio) -> None:
    room.enter("left-loop")
    undo = room.services.undo
    states = [room.presenter.canvas]
    live = [_state(room).live]
    for points in (LEFT, RIGHT, ((0.5, 0.4), (0.5, 0.6))):
        room.stroke(*points)
        states.append(room.presenter.canvas)
        live.append(_state(room).live)
    for back in (2, 1, 0):
        assert undo.undo_words == "stroke on My Loop"
        undo.undo()
        np.testing.assert_array_equal(room.presenter.canvas.weights, states[back].weights)  # type: ignore[union-attr]
        assert _state(room).live.curve == live[back].curve
    undo.redo()
    np.testing.assert_array_equal(room.presenter.canvas.weights, states[1].weights)  # type: ignore[union-attr]
    assert _state(room).tools.undo == "stroke on My Loop"


def test_undo_counts_the_bytes_of_its_tiles(room: Studio) -> None:
    room.enter()
    room.stroke((0.5, 0.5))
    step = room.services.undo._past[-1]
    assert step.size == 2 * 4 * 64 * 64 or step.size % (2 * 4) == 0
    assert 2 * 4 * 64 * 64 <= step.size <= 2 * 4 * 64 * 64 * 8


def test_undo_in_the_gallery_brings_the_painting_back(room: Studio) -> None:
    room.enter("left-split")
    room.stroke(*LEFT)
    room.leave()
    room.services.undo.undo()
    room.presenter.enter()  # what the window does when the model says so
    assert (room.model.step, room.model.painting) == (Step.STYLES, "left-split")
    assert room.presenter.canvas is not None
    assert not room.presenter.canvas.touched


def test_clearing_is_one_step_that_can_be_undone(room: Studio) -> None:
    room.enter("left-loop")
    room.stroke(*LEFT)
    room.stroke(*RIGHT)
    painted = room.presenter.canvas
    assert painted is not None
    room.presenter.clear()
    assert not _state(room).tools.can_clear
    assert "My Loop" in room.services.undo.undo_words
    room.services.undo.undo()
    np.testing.assert_array_equal(room.presenter.canvas.weights, painted.weights)  # type: ignore[union-attr]


def test_undo_while_painting_gives_the_stroke_up_and_no_more(room: Studio) -> None:
    room.enter()
    room.stroke(*LEFT)
    kept = room.presenter.canvas
    room.presenter.press((50.0, 50.0, 1.0))
    room.presenter.draw([(80.0, 80.0, 1.0)])
    room.presenter.undo()
    np.testing.assert_array_equal(room.presenter.canvas.weights, kept.weights)  # type: ignore[union-attr]
    assert room.services.undo.undo_words == "stroke on My style"
    room.presenter.draw([(90.0, 90.0, 1.0)])
    room.presenter.lift()
    np.testing.assert_array_equal(room.presenter.canvas.weights, kept.weights)  # type: ignore[union-attr]


def test_draft_is_kept_and_found_after_a_crash(tmp_path: Path) -> None:
    room = studio(tmp_path)
    room.enter("left-split")
    room.stroke(*LEFT)
    painted = room.presenter.canvas
    assert painted is not None
    # Nobody says goodbye: another program start on the same folder.
    again = studio(tmp_path)
    again.enter("left-split")
    found = again.presenter.canvas
    assert found is not None
    np.testing.assert_array_equal(found.weights, painted.weights)
    np.testing.assert_array_equal(found.start_weights, painted.start_weights)
    assert any("Your draft of My Split was restored" in one for one in again.told.messages)
    again.told.buttons["Start over"]()
    assert not again.presenter.canvas.touched  # type: ignore[union-attr]
    assert not list(again.drafts.glob("*"))


def test_each_start_has_a_draft_of_its_own(room: Studio) -> None:
    room.enter("left-split")
    room.stroke(*LEFT)
    split = room.presenter.canvas
    room.leave()
    room.enter("")
    assert not room.presenter.canvas.touched  # type: ignore[union-attr]
    room.stroke(*RIGHT)
    room.leave()
    assert sorted(path.name for path in room.drafts.iterdir()) == [
        "paint-left-split.npz",
        "paint.npz",
    ]
    room.enter("left-split")
    np.testing.assert_array_equal(room.presenter.canvas.weights, split.weights)  # type: ignore[union-attr]


def test_leaving_ends_the_stroke_keeps_the_draft_and_offers_to_go_on(room: Studio) -> None:
    room.enter("left-loop")
    room.presenter.press((100.0, 100.0, 1.0))
    room.presenter.draw([(150.0, 150.0, 1.0)])
    room.leave()
    assert room.told.messages[-1].startswith("Draft saved")
    assert load_draft(room.drafts / "paint-left-loop.npz").canvas.touched
    room.told.buttons["Continue"]()
    assert (room.model.step, room.model.painting) == (Step.STYLES, "left-loop")


def test_leaving_without_a_stroke_says_nothing_and_leaves_no_file(room: Studio) -> None:
    room.enter("left-loop")
    room.leave()
    assert room.told.messages == []
    assert not room.drafts.exists()


def test_a_stroke_that_is_undone_leaves_no_draft(room: Studio) -> None:
    room.enter()
    room.stroke(*LEFT)
    assert (room.drafts / "paint.npz").exists()
    room.services.undo.undo()
    assert not (room.drafts / "paint.npz").exists()


def test_damaged_draft_is_told_and_left_as_it_is(tmp_path: Path) -> None:
    damaged = tmp_path / "drafts" / "paint.npz"
    damaged.parent.mkdir()
    damaged.write_bytes(b"no draft at all")
    room = studio(tmp_path)
    room.enter()
    assert "paint.npz" in room.told.messages[0]
    room.stroke(*LEFT)
    room.leave()
    assert damaged.read_bytes() == b"no draft at all"
    again = studio(tmp_path)
    again.enter()
    assert again.presenter.canvas is not None
    assert again.presenter.canvas.touched


def test_full_disk_under_the_drafts_is_told_once(
    room: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.ui.screens.paint.drafts.save_draft", full)
    room.enter()
    room.stroke(*LEFT)
    room.stroke(*RIGHT)
    assert len([one for one in room.told.messages if "cannot be saved" in one]) == 1
    assert room.presenter.canvas is not None
    assert room.presenter.canvas.touched
    monkeypatch.undo()
    room.stroke(*LEFT)
    assert load_draft(room.drafts / "paint.npz").canvas.touched


def test_another_start_keeps_what_was_painted_and_can_be_undone(room: Studio) -> None:
    room.enter("left-split")
    room.stroke(*LEFT)
    painted = room.presenter.canvas
    room.presenter.choose_start("butterfly")
    assert (room.model.painting, _state(room).tools.start) == ("butterfly", "butterfly")
    assert not room.presenter.canvas.touched  # type: ignore[union-attr]
    assert room.told.messages[-1].startswith("Draft saved")
    room.services.undo.undo()
    assert _state(room).tools.start == "left-split"
    np.testing.assert_array_equal(room.presenter.canvas.weights, painted.weights)  # type: ignore[union-attr]
    room.services.undo.undo()
    assert not room.presenter.canvas.touched  # type: ignore[union-attr]


def test_starts_are_all_styles_and_nothing(room: Studio) -> None:
    room.enter("left-split")
    starts = _state(room).tools.starts
    assert starts[0][:2] == ("", "Nothing")
    assert ("left-split", "Split", SIDES["left"]) in starts
    assert len(starts) == 1 + len(room.model.head.pack.styles)  # type: ignore[union-attr]


def test_what_is_missing_is_said_before_saving(room: Studio) -> None:
    room.enter()
    assert _state(room).save.why == advice_words(Advice.NOTHING_PAINTED)
    assert _state(room).live.sentence == NO_STROKES
    room.stroke(*LEFT)
    assert _state(room).save.why == advice_words(Advice.ONE_SIDED)
    assert not room.presenter.save_works
    room.presenter.tools.change(tool=Tool.DARKER)
    room.stroke(*RIGHT)
    assert _state(room).save.why == ""
    assert room.presenter.save_works


def test_without_light_painting_works_and_the_target_is_shown(tmp_path: Path) -> None:
    room = studio(tmp_path, lamp_deg=None)
    room.enter("left-split")
    live = _state(room).live
    assert (live.sentence, live.offers_probe) == (NO_LIGHT, True)
    assert (live.picture_tag, live.panorama) == ("Target", None)
    assert live.picture is not None
    room.stroke(*LEFT)
    assert room.presenter.canvas is not None
    assert room.presenter.canvas.touched
    room.model.update(light=lamp_light(0.0))
    assert _state(room).live.match != ""
    room.presenter.measure()
    assert (room.model.step, room.model.painting) == (Step.PROBE, None)


def test_light_table_is_made_once_per_light_and_head(room: Studio) -> None:
    room.enter()
    room.leave()
    room.enter("left-split")
    room.model.update(front_deg=12.0)
    ran = room.services.runner.ran  # type: ignore[attr-defined]
    assert ran.count("paint-light") == 1
    room.model.update(light=lamp_light(-100.0))
    assert ran.count("paint-light") == 2


def test_out_of_reach_is_said_with_its_reason(room: Studio) -> None:
    room.enter("left-split")
    # The style itself, until there is a stroke, has limits of its own.
    room.stroke((0.4, 0.45), (0.6, 0.45))
    assert _state(room).live.dashed == LIMIT_RING.format(limit=45.0)
    room.model.update(light=even_light())
    live = _state(room).live
    assert live.good.startswith("Out of reach here: ")
    assert (live.arc, live.limit) == (None, 45.0)


def test_origin_says_what_the_style_itself_reaches(room: Studio) -> None:
    room.enter("left-split")
    result = next(one for one in room.model.results if one.name == "left-split")
    expected = f"Split itself: {int(result.match)}, at {round(result.turn_refined_deg)}°"
    assert _state(room).live.origin == expected
    room.leave()
    room.enter("")
    assert _state(room).live.origin == ""


def test_canvas_can_show_target_and_picture(room: Studio) -> None:
    room.enter("left-split")
    assert _state(room).canvas.picture is None
    room.presenter.look.show(CanvasMode.TARGET)
    target = _state(room).canvas.picture
    room.presenter.look.show(CanvasMode.HERE)
    here = _state(room).canvas.picture
    assert target is not None
    assert here is not None
    middle = target.shape[1] // 2
    # Left split: light on the sitter's left, the picture's right; so is the lamp at the best turn.
    for picture in (target, here):
        face = picture[10:26].astype(float)
        assert face[:, middle:].mean() > 1.2 * face[:, :middle].mean()


def test_brush_steps_grow_and_stay_within_bounds(room: Studio) -> None:
    tools = room.presenter.tools
    sizes = []
    for _ in range(40):
        tools.resize(1)
        sizes.append(tools.brush.diameter)
    assert sizes == sorted(sizes)
    assert sizes[-1] == 160.0
    for _ in range(60):
        tools.resize(-1)
    assert tools.brush.diameter == 4.0


def test_actions_have_the_keys_of_the_tools(room: Studio) -> None:
    keys = {action.shortcut: action for action in room.presenter.actions() if action.shortcut}
    for key, tool in zip("BDIR", Tool, strict=True):
        keys[key].run()
        assert room.presenter.tools.brush.tool is tool
    hints = [action.keys or action.shortcut for action in room.presenter.actions() if action.hint]
    assert hints == ["B D I R", "[ ]", "Ctrl+Z", "Escape"]
    assert len({action.key for action in room.presenter.actions()}) == len(room.presenter.actions())


def test_another_head_goes_on_with_the_same_canvas(room: Studio) -> None:
    from dataclasses import replace

    room.enter("left-split")
    room.stroke(*LEFT)
    painted = room.presenter.canvas
    head = room.model.head
    assert head is not None
    room.model.update(head=replace(head, name="twin"))
    np.testing.assert_array_equal(room.presenter.canvas.weights, painted.weights)  # type: ignore[union-attr]
    room.services.undo.undo()
    assert not room.presenter.canvas.touched  # type: ignore[union-attr]


def test_at_full_size_only_once_the_hand_rests(tmp_path: Path) -> None:
    runner = HoldingRunner()
    room = studio(tmp_path, runner=runner)
    room.presenter.sized(320, 256)
    room.enter("left-split")
    runner.held, runner.ran = {"paint-larger"}, []
    room.presenter.press((120.0, 200.0, 1.0))
    room.presenter.draw([(160.0, 210.0, 1.0)])
    assert "paint-larger" not in runner.ran
    room.presenter.lift()
    quick = _state(room).live.picture
    runner.release("paint-larger")
    larger = _state(room).live.picture
    assert larger is not None
    assert larger is not quick
    # What comes late is of strokes that are no longer all.
    runner.held = {"paint-larger"}
    room.presenter.dab(200.0, 100.0)
    late = runner.waiting["paint-larger"]
    room.presenter.press((120.0, 100.0, 1.0))
    room.presenter.draw([(160.0, 110.0, 1.0)])
    now = _state(room).live.picture
    late()
    assert _state(room).live.picture is now


def test_small_pictures_are_never_made_larger(tmp_path: Path) -> None:
    runner = HoldingRunner()
    room = studio(tmp_path, runner=runner)
    room.presenter.sized(60, 50)
    room.enter("left-split")
    room.presenter.dab(200.0, 100.0)
    assert "paint-larger" not in runner.ran


def _real(room: Studio) -> Studio:
    head = Head("generic", load_named_pack("generic"), load_named("generic"))
    room.model.update(head=head)
    room.enter()
    return room


def _yaw(room: Studio) -> float:
    head = _state(room).canvas.head
    assert head is not None
    return head.yaw_deg


def test_the_head_turns_from_view_to_view_and_back(room: Studio) -> None:
    _real(room)
    yaws = []
    for steps in (1, 1, 1, 1, -1, 0, -1):
        room.presenter.look.turn_head(steps)
        yaws.append(_yaw(room))
    assert yaws == [15.0, 30.0, 45.0, 45.0, 30.0, 0.0, -15.0]
    assert _state(room).canvas.head.places is not None  # type: ignore[union-attr]


def test_keys_that_come_faster_than_views_all_count(tmp_path: Path) -> None:
    runner = HoldingRunner()
    room = _real(studio(tmp_path, runner=runner))
    runner.held = {"paint-turn"}
    room.presenter.look.turn_head(1)
    room.presenter.look.turn_head(1)
    assert _yaw(room) == 0.0
    runner.release("paint-turn")
    assert _yaw(room) == 30.0


def test_a_view_of_another_head_comes_too_late(tmp_path: Path) -> None:
    runner = HoldingRunner()
    room = _real(studio(tmp_path, runner=runner))
    runner.held = {"paint-turn"}
    room.presenter.look.turn_head(1)
    pack, transport = load_named_pack("generic"), load_named("generic")
    room.model.update(head=Head("generic", pack, transport))
    runner.release("paint-turn")
    assert _yaw(room) == 0.0


def test_target_and_here_are_shown_from_the_front(room: Studio) -> None:
    _real(room)
    room.presenter.look.turn_head(1)
    room.presenter.look.show(CanvasMode.TARGET)
    assert (_yaw(room), _state(room).canvas.mode) == (0.0, CanvasMode.TARGET)
    room.presenter.look.turn_head(1)
    canvas = _state(room).canvas
    assert (_yaw(room), canvas.mode, canvas.picture) == (15.0, CanvasMode.WEIGHTS, None)


def test_another_head_is_seen_from_the_front_first(room: Studio) -> None:
    _real(room)
    room.presenter.look.turn_head(1)
    pack, transport = load_named_pack("generic"), load_named("generic")
    room.model.update(head=Head("generic", pack, transport))
    assert _yaw(room) == 0.0


def test_a_head_without_views_says_so(room: Studio) -> None:
    room.enter()
    room.presenter.look.turn_head(1)
    assert room.told.messages[-1] == FRONT_ONLY
    assert _yaw(room) == 0.0
