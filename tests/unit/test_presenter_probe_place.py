"""The probe's screen without a screen: a place, its marker, its age, and what is clipped in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.core.measure.finish.findings import clip_level, find
from app.core.places.place import CaptureFacts, FrameFacts, Location
from app.ui.screens.probe.screen import MARKERS, ProbeView
from app.words.phrases.directions import SIDES, direction_words
from tests.helpers.probe_screen import Bench, with_lamp
from tests.helpers.probes import place as lit_place


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", lambda handle: None)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def entered(bench: Bench) -> Bench:
    bench.presenter.enter()
    return bench


class TestMarker:
    def test_azimuths_count_from_the_photographer_clockwise(self, bench: Bench) -> None:
        with_lamp(bench, 47.0)
        (row,) = bench.presenter.resolve().lamps
        assert row.azimuth == "47°"
        assert row.elevation == "20° up"
        assert row.where == direction_words(47.0, 20.0, of_sitter=True)
        bench.presenter.move_marker(77.0)
        (row,) = bench.presenter.resolve().lamps
        assert row.azimuth == "−30°"
        assert SIDES["left"] in row.where
        assert row.azimuth_deg == pytest.approx(47.0, abs=0.5)
        bench.services.undo.undo()
        assert bench.presenter.resolve().lamps[0].azimuth == "47°"

    def test_turns_become_smaller_by_what_the_marker_moved(self, bench: Bench) -> None:
        with_lamp(bench, 47.0)
        turns = {result.name: result.turn_refined_deg for result in bench.model.results}
        bench.presenter.move_marker(30.0)
        for result in bench.model.results:
            moved = (turns[result.name] - 30.0 - result.turn_refined_deg + 180.0) % 360.0 - 180.0
            assert moved == pytest.approx(0.0, abs=1e-6)

    def test_its_words_follow_who_turns(self, bench: Bench) -> None:
        assert bench.presenter.resolve().marker_words == MARKERS["walk"]
        bench.model.update(settings=bench.model.settings.with_("mode", "selfie"))
        assert bench.presenter.resolve().marker_words == MARKERS["selfie"]


class TestAge:
    def opened(self, bench: Bench, location: Location) -> None:
        with_lamp(bench, 0.0)
        assert bench.model.place is not None
        facts = CaptureFacts(plan="paper")
        bench.model.update(place=replace(bench.model.place, location=location, capture=facts))

    def test_the_sun_moves_on(self, bench: Bench) -> None:
        self.opened(bench, Location("outdoor", True, 30.0, 40.0))
        bench.later(27.0)
        state = bench.presenter.resolve()
        # 15 degrees an hour times the cosine of 23.4: 6.2 degrees in 27 minutes.
        assert "27 min ago" in state.age
        assert "6 degrees" in state.age
        assert state.age_old

    def test_it_is_said_anew_without_anybody_asking(self, bench: Bench) -> None:
        self.opened(bench, Location("outdoor", True, 30.0, 40.0))
        view = MagicMock(spec=ProbeView)
        bench.presenter.attach(view)
        bench.later(27.0)
        bench.rig.clock.sleep(60.0)
        bench.presenter.tick()
        assert "27 min" in view.show_state.call_args.args[0].age

    def test_a_panorama_from_a_file_has_no_age(self, bench: Bench) -> None:
        bench.presenter.open_demo()
        assert bench.presenter.resolve().age == ""


class TestPanoramas:
    def test_the_demo_place_has_lamps_nothing_clipped_and_light_that_is_near(
        self, bench: Bench
    ) -> None:
        bench.presenter.open_demo()
        state = bench.presenter.resolve()
        assert state.lamps
        assert not any(row.clipped for row in state.lamps)
        assert state.findings is not None
        assert state.findings.clipped is None
        assert state.frames == ()
        assert state.notice is not None
        assert state.notice.title.startswith("Light is near.")

    def test_exposure_makes_the_picture_brighter_and_comes_back(self, bench: Bench) -> None:
        with_lamp(bench, 0.0)
        presenter = bench.presenter
        plain = presenter.resolve().picture
        presenter.panorama.expose(2.0)
        brighter = presenter.resolve().picture
        assert plain is not None
        assert brighter is not None
        assert brighter.mean() > plain.mean() + 20.0
        presenter.panorama.expose(0.0)
        assert presenter.resolve().picture is plain

    def test_a_place_opened_again_knows_what_was_clipped(self, bench: Bench) -> None:
        entered(bench).presenter.capture()
        first = bench.presenter.resolve()
        folder = bench.model.place_folder
        assert folder is not None
        bench.presenter.open_demo()
        bench.desk.open_place(folder)
        again = bench.presenter.resolve()
        assert [row.letter for row in again.lamps] == [row.letter for row in first.lamps]
        assert any(row.clipped for row in again.lamps)
        assert all(tile.picture is not None for tile in again.frames)


class TestView:
    def test_attach_shows_at_once_and_detach_no_more(self, bench: Bench) -> None:
        view = MagicMock(spec=ProbeView)
        bench.presenter.attach(view)
        assert view.show_state.call_count == 1
        bench.presenter.detach()
        bench.presenter.tick_off("kneel")
        assert view.show_state.call_count == 1

    def test_keys(self, bench: Bench) -> None:
        view = MagicMock(spec=ProbeView)
        bench.presenter.attach(view)
        with_lamp(bench, 0.0)
        actions = {action.key: action for action in bench.presenter.actions()}
        assert actions["capture"].shortcut == "Space"
        actions["zoom-in"].run()
        actions["zoom-out"].run()
        actions["marker"].run()
        assert [call.args for call in view.zoom_by.call_args_list] == [(1,), (-1,)]
        view.take_marker.assert_called_once_with()
        assert len([each for each in actions.values() if each.hint]) <= 4

    def test_plan_and_timer_stay_chosen(self, bench: Bench) -> None:
        bench.presenter.set("plan", "full")
        bench.presenter.set("self_timer_s", 2)
        assert bench.model.settings.plan == "full"
        state = bench.presenter.resolve()
        assert (state.plan, state.timer_s) == ("full", 2)
        assert all(" frames, " in part.second for part in state.plans)

    def test_the_checklist_is_ticked_and_unticked(self, bench: Bench) -> None:
        bench.presenter.tick_off("kneel")
        assert bench.presenter.resolve().ticked == {"kneel"}
        bench.presenter.tick_off("kneel")
        assert bench.presenter.resolve().ticked == frozenset()


class TestFindings:
    def test_what_reaches_the_level_of_the_darkest_frame_is_clipped(self) -> None:
        facts = CaptureFacts(
            frames=tuple(FrameFacts(f"{ev}.jpg", 1.0, ev=ev) for ev in (2.0, 0.0, -2.0))
        )
        level = clip_level([frame.ev for frame in facts.frames])
        assert level == 4.0
        radiance = np.minimum(lit_place([(30.0, 10.0, 10.0, 9.0), (-90.0, 0.0, 10.0, 3.0)]), level)
        found = find(radiance, level)
        bright = {round(lamp.azimuth_deg / 10.0) * 10: lamp.clipped for lamp in found.lamps}
        assert bright == {30: True, -90: False}
        assert found.clipped is not None
        rows, columns = found.clipped.shape
        column = int((30.0 / 360.0 + 0.5) * columns)
        row = int((90.0 - 10.0) / 180.0 * rows)
        assert found.clipped[row, column] == 1.0
        assert found.clipped.mean() < 0.02

    def test_nothing_is_clipped_where_nothing_is_known(self) -> None:
        found = find(lit_place([(30.0, 10.0, 10.0, 9.0)]))
        assert found.clipped is None
        assert not found.lamps[0].clipped
