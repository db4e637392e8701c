"""One undo for the window: whatever was done last is taken back, and the state is as before."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from app.core.base.errors import CoreError
from app.core.painting.draft_file import load_draft
from app.core.painting.user_style import checksum
from app.core.painting.user_styles import list_user_styles
from app.core.places.place_folder import create_place, read_place
from app.core.places.place_list import list_places
from app.core.second_light.captured_lamps.lamp_library import add_lamp, list_lamps, read_lamp
from app.ui.presenters.places_list import PlacesListPresenter
from app.ui.presenters.window_frame import FramePresenter
from app.ui.screens.light import lamp_list
from app.ui.screens.light.own_lamp.actions import LampActions
from app.ui.screens.paint.files import CHANGED
from tests.helpers.paint_studio import Studio, studio
from tests.unit.test_second_light_library import lamp

LEFT = ((0.35, 0.4), (0.4, 0.6))
RIGHT = ((0.6, 0.4), (0.62, 0.6))
OWN = "mine", "other"


class World:
    """Two styles of the user's own, one with a draft; two places, one open; two lamps."""

    def __init__(self, home: Path) -> None:
        self.room: Studio = studio(home)
        room, services = self.room, self.room.services
        self.desk = room.presenter.files._place_controller
        for title in ("Mine", "Other"):
            room.enter("left-split")
            room.stroke(*LEFT)
            room.presenter.files.named("save", title)
        room.enter("mine")
        room.stroke(*RIGHT)
        room.leave()
        now = services.today()
        self.folders = [
            create_place(services.folders.places, name, now) for name in ("Café", "Yard")
        ]
        room.model.update(place_folder=self.folders[0], place=read_place(self.folders[0]))
        self.lamps = lamp_list.LampList(services, lambda: None, self._taken)
        for title in ("Desk lamp", "Torch"):
            add_lamp(self.lamps.folder, lamp(), title)
        self.lamp_actions = LampActions(services, self.desk, self.lamps)
        self.places = PlacesListPresenter(services, self.desk)
        self.places.attach(MagicMock())
        room.model.update(chosen="mine", needle_deg=12.0, goal_deg=34.0)
        # What made this world is not to be undone.
        self.undo = services.undo
        self.undo._past.clear()
        self.undo._undone.clear()

    def _taken(self, key: str) -> None:
        self.lamps.choose(key)

    def state(self) -> dict[str, Any]:
        """All that the user made, from the disk, and what is in front."""
        room, services = self.room, self.room.services
        model = room.model
        room.presenter._keeper.flush()
        drafts = sorted(room.drafts.glob("*.npz"))
        lamps, _ = list_lamps(self.lamps.folder)
        return {
            "styles": [(s.name, s.title, checksum(s)) for s in list_user_styles(room.styles)[0]],
            "gallery": [(s.name, s.title, checksum(s)) for s in model.user_styles],
            "drafts": {
                path.name: (draft.title, draft.canvas.weights.tobytes())
                for path, draft in ((path, load_draft(path)) for path in drafts)
            },
            "front": (model.chosen, model.needle_deg, model.goal_deg, model.front_deg),
            "open": (model.place_folder, model.place and model.place.name),
            "places": sorted(
                (one.folder.name, one.name) for one in list_places(services.folders.places)
            ),
            "lamps": [
                (one.name, one.title, one.distance_m, read_lamp(self.lamps.folder, one.name).lux)
                for one in lamps
            ],
        }

    # -- what can be undone --------------------------------------------------------------------

    def paint(self, key: str, points: Any) -> None:
        self.room.enter(key)
        self.room.stroke(*points)
        self.room.leave()

    def clear(self, key: str) -> None:
        self.room.enter(key)
        self.room.presenter.clear()
        self.room.leave()

    def delete_style(self, key: str, in_paint: bool) -> None:
        if in_paint:
            self.room.enter(key)
            self.room.presenter.files.delete()
            self.room.presenter.leave()
        else:
            self.desk.own_styles.delete(self.style(key))

    def style(self, key: str) -> Any:
        return next(one for one in self.room.model.user_styles if one.name == key)

    def own(self) -> list[str]:
        return [one.name for one in self.room.model.user_styles]

    def lamp_in_hand(self, name: str) -> None:
        self.lamps.take_own(name)


@pytest.fixture
def world(tmp_path: Path) -> World:
    return World(tmp_path)


def test_undo_after_deleting_a_style_brings_it_back_with_its_draft_and_stays_here(
    world: World,
) -> None:
    # As in the report: strokes, then the gallery, then the style deleted there.
    world.paint("mine", LEFT)
    before = world.state()
    assert "paint-mine.npz" in before["drafts"]
    world.delete_style("mine", in_paint=False)
    assert world.undo.undo_words == "delete Mine"
    assert world.state()["drafts"] == {}, "a new style of that name must not find it"
    world.undo.undo()
    assert world.state() == before
    assert world.room.model.painting is None, "nothing jumps into Paint"
    assert world.undo.undo_words == "stroke on Mine"
    world.room.enter("mine")
    assert world.room.presenter.resolve().save.status == CHANGED


def test_what_was_undone_is_said_and_offered_again(world: World) -> None:
    frame = FramePresenter(world.room.services)
    world.delete_style("other", in_paint=True)
    assert frame.resolve().undo == "delete Other"
    world.undo.undo()
    assert frame.resolve().status == "Undone: delete Other."
    assert frame.resolve().redo == "delete Other"
    assert world.room.told.messages[-1] == "Other has been restored."
    world.undo.redo()
    assert frame.resolve().status == "Redone: delete Other."
    world.paint("left-loop", LEFT)
    assert "Redone" not in frame.resolve().status


def test_a_message_takes_back_its_own_step_whatever_came_after(world: World) -> None:
    world.delete_style("mine", in_paint=False)
    back = world.room.told.buttons["Undo"]
    world.desk.move_front(40.0)
    back()
    assert "mine" in world.own()
    assert world.undo.undo_words == "move the marker", "and it is not undone a second time"
    count = len(world.room.told.messages)
    back()
    assert len(world.room.told.messages) == count


def test_a_deletion_that_fails_is_not_in_the_way(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    world.desk.move_front(40.0)

    def full(*_: object) -> None:
        raise CoreError("No space left.")

    with monkeypatch.context() as patch:
        patch.setattr("app.ui.presenters.file_changes.delete", full)
        world.delete_style("mine", in_paint=False)
    assert world.undo.undo_words == "move the marker"
    world.delete_style("mine", in_paint=False)
    with monkeypatch.context() as patch:
        patch.setattr("app.ui.presenters.file_changes.restore", full)
        world.undo.undo()
    assert world.undo.undo_words == "delete Mine", "it can be tried again"
    world.undo.undo()
    assert "mine" in world.own()


def test_a_place_brought_back_from_the_list_is_no_longer_deleted_for_undo(world: World) -> None:
    before = world.state()
    world.places.delete(world.folders[1])
    (row,) = world.places.resolve().deleted
    world.places.restore(row.folder)
    assert world.state() == before
    assert world.undo.undo_words == ""
    assert world.undo.redo_words == "delete Yard"


@settings(
    max_examples=12,
    stateful_step_count=14,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
class Sequences(RuleBasedStateMachine):
    """Any order of what can be undone: each undo gives the state before, each redo that after."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.done: list[tuple[dict[str, Any], dict[str, Any]]] = []
        self.undone: list[tuple[dict[str, Any], dict[str, Any]]] = []

    @initialize()
    def begin(self) -> None:
        self.world = World(Path(self.folder.name))

    def teardown(self) -> None:
        self.folder.cleanup()

    def act(self, call: Any, *values: Any) -> None:
        before, words = self.world.state(), len(self.world.undo._past)
        call(*values)
        if len(self.world.undo._past) > words:
            self.done.append((before, self.world.state()))
            self.undone.clear()

    @rule(key=st.sampled_from(("left-loop", *OWN)), points=st.sampled_from((LEFT, RIGHT)))
    def paint(self, key: str, points: Any) -> None:
        if key not in OWN or key in self.world.own():
            self.act(self.world.paint, key, points)

    @rule(key=st.sampled_from(("left-loop", *OWN)))
    def clear(self, key: str) -> None:
        if key not in OWN or key in self.world.own():
            self.act(self.world.clear, key)

    @rule(key=st.sampled_from(OWN), in_paint=st.booleans())
    def delete_style(self, key: str, in_paint: bool) -> None:
        if key in self.world.own():
            self.act(self.world.delete_style, key, in_paint)

    @rule(key=st.sampled_from(OWN), title=st.sampled_from(("One", "Two")))
    def rename_style(self, key: str, title: str) -> None:
        world = self.world
        if key in world.own() and title not in [s.title for s in world.room.model.user_styles]:
            own = world.desk.own_styles
            self.act(own.rename, world.style(key), title, lambda: None, pytest.fail)

    @rule(front=st.sampled_from((-90.0, 0.0, 45.0, 180.0)))
    def move_the_marker(self, front: float) -> None:
        self.act(self.world.desk.move_front, front)

    @rule(number=st.sampled_from((0, 1)), name=st.sampled_from(("Hall", "Roof")))
    def rename_place(self, number: int, name: str) -> None:
        if self.world.folders[number].exists():
            self.act(self.world.places.edit, self.world.folders[number], name, "", "")

    @rule()
    def delete_the_other_place(self) -> None:
        if self.world.folders[1].exists():
            self.act(self.world.places.delete, self.world.folders[1])

    @rule(number=st.sampled_from((0, 1)), what=st.sampled_from(("rename", "distance", "lux")))
    def correct_a_lamp(self, number: int, what: Any) -> None:
        world, names = self.world, ("desk-lamp", "torch")
        if names[number] in [one.name for one in list_lamps(world.lamps.folder)[0]]:
            world.lamp_in_hand(names[number])
            told = {"rename": f"Lamp {number}", "distance": "70 cm", "lux": "321"}
            self.act(world.lamp_actions.answer, what, told[what])

    @rule(name=st.sampled_from(("desk-lamp", "torch")))
    def delete_a_lamp(self, name: str) -> None:
        if name in [one.name for one in list_lamps(self.world.lamps.folder)[0]]:
            self.world.lamp_in_hand(name)
            self.act(self.world.lamp_actions.delete)

    @precondition(lambda self: self.done)
    @rule()
    def undo(self) -> None:
        before, after = self.done.pop()
        self.world.undo.undo()
        assert self.world.state() == before
        self.undone.append((before, after))

    @precondition(lambda self: self.undone)
    @rule()
    def redo(self) -> None:
        before, after = self.undone.pop()
        self.world.undo.redo()
        assert self.world.state() == after
        self.done.append((before, after))

    @invariant()
    def it_says_what_it_would_do(self) -> None:
        if hasattr(self, "world"):
            assert bool(self.world.undo.undo_words) == bool(self.done)
            assert bool(self.world.undo.redo_words) == bool(self.undone)


test_any_sequence_is_taken_back_step_by_step = Sequences.TestCase


def test_what_is_unsaved_bears_the_new_title(tmp_path: Path) -> None:
    """Found by the sequences: the draft said the old one until the style was entered again."""
    world = World(tmp_path)
    world.paint("other", LEFT)
    world.desk.own_styles.rename(world.style("other"), "One", lambda: None, pytest.fail)
    titles = {title for title, _ in world.state()["drafts"].values()}
    assert titles == {"Mine", "One"}
    world.undo.undo()
    assert {title for title, _ in world.state()["drafts"].values()} == {"Mine", "Other"}


def test_so_does_what_was_left_for_another_style(tmp_path: Path) -> None:
    world = World(tmp_path)
    world.desk.own_styles.rename(world.style("mine"), "One", lambda: None, pytest.fail)
    world.clear("left-loop")
    world.undo.undo()
    assert {title for title, _ in world.state()["drafts"].values()} == {"Mine"}
