"""The probe's screen without a screen: captures, places, marker, camera."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import pytest

from app.core.places.place import PlaceError
from app.core.places.place_folder import read_place
from app.devices.capture.status import Stage
from app.ui.presenters.window_frame import FramePresenter
from app.ui.screens.probe.capture.camera import NO_CAMERA
from app.ui.screens.probe.capture.notice import DISCONNECTED, DISK_FULL, FRAMES_SAVED
from app.ui.screens.probe.screen import NO_CAMERA_YET, ProbeState
from app.words.phrases.quantities import LIGHTS, place_name
from tests.helpers.captures import Weather, when
from tests.helpers.probe_screen import SERIAL, Bench, vanish_after


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", lambda handle: None)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def entered(bench: Bench) -> Bench:
    bench.presenter.enter()
    return bench


class TestCapture:
    def test_from_nothing_to_a_place_with_lamps_and_frames(self, bench: Bench) -> None:
        seen: list[ProbeState] = []
        bench.runner.beats.append(lambda: seen.append(bench.presenter.resolve()))
        presenter = entered(bench).presenter
        assert not presenter.resolve().has_place
        presenter.main()
        state = presenter.resolve()
        assert state.has_place
        assert state.running is None
        assert [tile.ev for tile in state.frames] == ["+2 EV", "0 EV", "−2 EV"]
        assert all(tile.picture is not None and tile.clipped for tile in state.frames)
        assert state.frames[0].picture.mean() > state.frames[2].picture.mean()  # type: ignore[union-attr]
        assert state.lamps
        assert state.age == "Measured just now."
        assert state.frames_note.startswith("ISO ")
        assert state.frames_note.endswith("taken 14:05")
        assert bench.model.step == "probe"
        presenter.main()
        assert bench.model.step == "styles"

    def test_the_stages_are_told_in_order_and_frames_as_they_arrive(self, bench: Bench) -> None:
        seen: list[ProbeState] = []
        bench.runner.beats.append(lambda: seen.append(bench.presenter.resolve()))
        entered(bench).presenter.capture()
        running = [state for state in seen if state.running is not None]
        signs = [state.running.sign for state in running if state.running is not None]
        order = list(dict.fromkeys(sign.big for sign in signs))
        frames = [f"Frame {number} of 3" for number in (1, 2, 3)]
        assert [words for words in order if not words.isdigit()] == [
            "Get ready", *frames, "You may move"
        ]  # fmt: skip
        captions = " ".join(dict.fromkeys(sign.caption for sign in signs))
        stages = ("Connecting", "Metering", "Stay down", "All exposures made", "File 3 of 3")
        assert sorted(stages, key=captions.index) == list(stages)
        assert "s left" in captions
        arrived = [sum(tile.picture is not None for tile in state.frames) for state in running]
        assert max(arrived) == 3
        assert arrived == sorted(arrived)
        assert any(state.running is not None and state.running.rough for state in running)

    def test_one_may_move_after_the_last_exposure_and_it_sounds_once(self, bench: Bench) -> None:
        stages: list[tuple[bool, str]] = []

        def beat() -> None:
            seen = bench.presenter.taking._progress
            running = bench.presenter.resolve().running
            if seen is not None and running is not None:
                stages.append((running.sign.kind == "move", seen.status.stage))

        bench.runner.beats.append(beat)
        entered(bench).presenter.capture()
        first = next(stage for free, stage in stages if free)
        assert first == Stage.EXPOSING
        assert all(free for free, stage in stages if stage == Stage.DOWNLOADING)
        assert not any(free for free, stage in stages if stage == Stage.METERING)
        assert bench.sounds.played == 1

    def test_silent_where_sounds_are_off(self, bench: Bench) -> None:
        bench.model.update(settings=bench.model.settings.with_("sounds", False))
        entered(bench).presenter.capture()
        assert bench.sounds.played == 0

    def test_the_originals_are_in_the_places_folder(self, bench: Bench) -> None:
        entered(bench).presenter.capture()
        (folder,) = bench.places()
        assert bench.model.place_folder == folder
        assert len(list((folder / "capture" / "originals").iterdir())) == 3

    def test_a_new_place_is_named_after_hour_and_light(self, bench: Bench) -> None:
        entered(bench).presenter.capture()
        place = bench.model.place
        assert place is not None
        hour = place_name(place.made_at)
        assert place.name in {place_name(place.made_at, kind) for kind in LIGHTS}
        assert read_place(bench.places()[0]).name == place.name
        entered(bench).presenter.capture()
        assert bench.model.place is not None
        # The same spot once more keeps the name that it has.
        assert bench.model.place.name == place.name
        assert place.name.startswith(f"{hour}, ")

    def test_a_second_capture_waits_for_the_first(self, bench: Bench) -> None:
        bench.runner.held.add("capture")
        presenter = entered(bench).presenter
        presenter.capture()
        presenter.capture()
        assert bench.runner.ran.count("capture") == 1
        assert not presenter.resolve().can_capture

    def test_the_full_range_is_offered_where_lamps_are_clipped(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        presenter.capture()
        notice = presenter.resolve().notice
        assert notice is not None
        assert "still clipped at −2" in notice.title
        assert [key for key, _ in notice.buttons] == ["capture-full"]
        presenter.press("capture-full")
        frames = presenter.resolve().frames
        assert len(frames) > 5
        assert frames[0].ev == "+2 EV"
        assert len(bench.places()) == 2


class TestSameSpot:
    def test_the_photographer_and_the_marked_turn_stay(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        presenter.capture()
        presenter.move_marker(40.0)
        bench.model.update(goal_deg=25.0)
        spot = bench.model.place.spot if bench.model.place else ""
        bench.told.messages.clear()
        presenter.capture()
        assert bench.model.front_deg == pytest.approx(40.0, abs=0.5)
        assert bench.model.goal_deg == 25.0
        assert bench.model.place is not None
        assert bench.model.place.spot == spot
        assert any("same spot" in message.lower() for message in bench.told.messages)

    def test_another_place_starts_afresh_and_that_is_said(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        presenter.open_demo()
        presenter.move_marker(40.0)
        bench.told.messages.clear()
        presenter.capture()
        assert bench.model.front_deg == 0.0
        assert any("not carried over" in message for message in bench.told.messages)


class TestStopping:
    def test_cancel_gives_the_camera_its_settings_back(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        before = dict(bench.rig.camera.options)

        def stop() -> None:
            seen = presenter.taking._progress
            if seen is not None and seen.status.stage == Stage.EXPOSING and seen.status.shot == 2:
                presenter.taking.cancel()

        bench.runner.beats.append(stop)
        presenter.capture()
        state = presenter.resolve()
        assert state.running is None
        assert not state.has_place
        assert dict(bench.rig.camera.options) == before
        assert bench.model.camera is not None
        assert not bench.model.camera.busy

    def test_a_capture_that_took_nothing_leaves_nothing(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        bench.runner.beats.append(presenter.taking.cancel)
        presenter.capture()
        assert bench.places() == []
        assert presenter.resolve().notice is None


class TestTroubles:
    def test_it_goes_away_after_two_frames_and_these_are_merged(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        vanish_after(bench, 2)
        presenter.capture()
        notice = presenter.resolve().notice
        assert notice is not None
        assert notice.tone == "error"
        assert notice.title == DISCONNECTED.format(here=2, total=3)
        assert notice.body.startswith(f"{FRAMES_SAVED[2]} ")
        assert [key for key, _ in notice.buttons] == ["resume", "merge"]
        presenter.press("merge")
        assert presenter.resolve().has_place
        assert len(presenter.resolve().frames) == 2
        assert len(bench.places()) == 1

    def test_out_of_reach_for_two_minutes_is_counted_down_and_outlasted(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        weather = Weather(bench.rig)
        when(bench.rig, "startCapture", lambda: weather.lose(120.0))
        said: list[str] = []

        def look() -> None:
            presenter.tick()
            running = presenter.resolve().running
            if running is not None and "out of reach" in running.sign.caption:
                said.append(running.sign.caption)
                assert not running.stopping  # Cancel is offered.

        bench.runner.beats.append(look)
        presenter.capture()
        assert len(presenter.resolve().frames) == 3
        assert "The camera is out of reach; reconnecting: 2:54 left" in said
        assert len(dict.fromkeys(said)) > 30

    def test_it_comes_back_and_the_third_is_fetched(self, bench: Bench) -> None:
        presenter = entered(bench).presenter
        vanish_after(bench, 2)
        presenter.capture()
        shots = len(bench.rig.camera.storage.files)
        bench.runner.beats[1:] = []
        del bench.rig.camera.reachable
        presenter.press("resume")
        assert len(presenter.resolve().frames) == 3
        assert len(bench.rig.camera.storage.files) == shots
        assert len(bench.places()) == 1

    def test_a_crash_is_offered_to_be_gone_on_with(self, bench: Bench, tmp_path: Path) -> None:
        entered(bench)
        vanish_after(bench, 2)
        bench.presenter.capture()
        again = Bench(tmp_path)
        again.rig.camera = bench.rig.camera
        del again.rig.camera.reachable
        again.presenter.enter()
        notice = again.presenter.resolve().notice
        assert notice is not None
        assert notice.tone == "offer"
        assert "2 of 3 frames are saved" in notice.body
        assert notice.buttons[-1] == ("leave-offer", "Not now")
        again.presenter.press("merge-offer")
        assert again.presenter.resolve().has_place

    def test_a_capture_that_ended_and_was_not_kept_is_offered(
        self, bench: Bench, tmp_path: Path
    ) -> None:
        bench.presenter.enter()
        # The window was closed, or the disk was full, before the place could be kept; it is shown
        # all the same.
        bench.runner.held.add("files")
        bench.presenter.capture()
        assert bench.model.light is not None
        again = Bench(tmp_path)
        again.presenter.enter()
        notice = again.presenter.resolve().notice
        assert notice is not None
        assert notice.buttons[0][0] == "resume-offer"
        again.presenter.press("resume-offer")
        assert again.model.light is not None

    def test_a_newer_search_is_not_ended_by_the_older_one(self, bench: Bench) -> None:
        ends: list[Any] = []
        bench.runner.submit = lambda key, work, **calls: ends.append(calls)  # type: ignore[method-assign]
        bench.runner.running = lambda key: True  # type: ignore[method-assign]
        bench.presenter.cameras.search()
        bench.presenter.cameras.search()
        ends[0]["cancelled"]()
        assert bench.presenter.resolve().camera.busy == "Looking for cameras…"

    def test_the_offer_can_be_left(self, bench: Bench, tmp_path: Path) -> None:
        entered(bench)
        vanish_after(bench, 1)
        bench.presenter.capture()
        again = Bench(tmp_path)
        again.presenter.enter()
        again.presenter.press("leave-offer")
        assert again.presenter.resolve().notice is None
        assert len(again.places()) == 1

    def test_a_full_disk(self, bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
        presenter = entered(bench).presenter
        free = MagicMock(free=1 << 20)
        monkeypatch.setattr("app.devices.capture.download.shutil.disk_usage", lambda path: free)
        presenter.capture()
        notice = presenter.resolve().notice
        assert notice is not None
        assert notice.title == DISK_FULL
        assert re.findall("[0-9]+", notice.body) == ["1", "3"]
        monkeypatch.undo()
        presenter.press("resume")
        assert presenter.resolve().has_place

    @pytest.mark.parametrize("fault", ["battery-low", "storage-full"])
    def test_a_camera_that_cannot_shoot_says_why(self, tmp_path: Path, fault: str) -> None:
        bench = entered(Bench(tmp_path, {"faults": (fault,)}))
        bench.presenter.capture()
        notice = bench.presenter.resolve().notice
        assert notice is not None
        assert notice.tone == "error"
        assert notice.body
        assert bench.places() == []


class TestCamera:
    def test_it_is_found_with_battery_and_space(self, bench: Bench) -> None:
        block = entered(bench).presenter.resolve().camera
        assert block.title == "RICOH THETA V"
        assert block.second.startswith("Wi-Fi, battery ")
        assert block.second.endswith("GB free")
        assert bench.model.camera is not None
        assert bench.model.camera.device.serial == SERIAL

    def test_none_found(self, bench: Bench) -> None:
        bench.devices.there = False
        state = entered(bench).presenter.resolve()
        assert state.camera.second == NO_CAMERA
        assert state.camera.open
        assert not state.can_capture
        assert state.why_not == NO_CAMERA_YET
        bench.devices.there = True
        bench.presenter.cameras.search()
        assert bench.presenter.resolve().can_capture

    def test_a_typed_address(self, bench: Bench) -> None:
        bench.devices.there = False
        cameras = entered(bench).presenter.cameras
        cameras.look_at("192.168.1.7")
        block = cameras.block()
        assert block.address_error.startswith("Nothing answers at 192.168.1.7.")
        cameras.look_at("  ")
        assert cameras.block().address_error.startswith("Enter an address")
        cameras.look_at("192.168.1.1")
        assert cameras.block().address_error == ""
        assert not cameras.block().missing

    def test_a_password_is_asked_for_and_goes_into_the_keyring_only(self, tmp_path: Path) -> None:
        user = f"THETAYL{SERIAL}"
        bench = entered(Bench(tmp_path, {"user": user, "password": "12345678"}))
        presenter = bench.presenter
        block = presenter.resolve().camera
        assert block.asks_password
        assert block.open
        assert block.user == user
        assert not presenter.resolve().can_capture
        presenter.cameras.give_password(user, "")
        assert "both" in presenter.resolve().camera.password_error
        presenter.cameras.give_password(user, "wrong")
        assert presenter.resolve().camera.password_error
        assert bench.devices.keyring.kept == {}
        presenter.cameras.give_password(user, "12345678")
        assert not presenter.resolve().camera.asks_password
        assert bench.devices.keyring.kept == {user: "12345678"}
        presenter.capture()
        assert presenter.resolve().has_place
        kept = [path.read_bytes() for path in tmp_path.rglob("*.json")]
        assert kept
        assert not any(b"12345678" in data for data in kept)

    def test_a_password_that_is_kept_is_not_asked_for(self, tmp_path: Path) -> None:
        user = f"THETAYL{SERIAL}"
        bench = Bench(tmp_path, {"user": user, "password": "12345678"})
        bench.devices.keyring.kept[user] = "12345678"
        assert not entered(bench).presenter.resolve().camera.asks_password

    def test_leaving_stops_the_search(self, bench: Bench) -> None:
        entered(bench).presenter.leave()
        assert bench.runner.tokens["cameras"].cancelled


class TestShownBeforeItIsKept:
    """A capture is on the screen while it is still being saved."""

    @pytest.mark.slow
    def test_the_panorama_is_there_at_once_and_the_foot_says_that_it_is_being_saved(
        self, bench: Bench
    ) -> None:
        frame = FramePresenter(bench.services)
        entered(bench)
        bench.runner.held.add("files")
        bench.presenter.capture()
        state = bench.presenter.resolve()
        assert state.picture is not None
        assert state.has_place
        assert state.running is None
        assert bench.model.results
        assert frame.resolve().status == "Saving this place…"
        (folder,) = bench.places()
        assert not read_place(folder).environment
        # Another place is opened before it is on the disk: nothing is lost.
        bench.presenter.open_demo()
        bench.runner.release("files")
        assert read_place(folder).environment
        assert read_place(folder).results
        assert bench.model.place_folder != folder

    def test_a_disk_that_is_full_after_the_capture_is_said_and_it_is_saved_elsewhere(
        self, bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        entered(bench)

        def full(*_: object, **__: object) -> None:
            raise PlaceError("The light was not saved.") from OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr("app.core.places.save.store_environment", full)
            bench.presenter.capture()
        assert bench.presenter.resolve().has_place
        assert any("the disk is full" in text for text in bench.told.messages)
        assert bench.model.unkept
        bench.desk.saving.save_in(tmp_path / "stick")
        assert bench.model.unkept == ""
        assert bench.model.place_folder is not None
        assert bench.model.place_folder.parent == tmp_path / "stick"
        assert read_place(bench.model.place_folder).environment
