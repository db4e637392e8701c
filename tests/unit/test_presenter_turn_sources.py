"""The live camera of any kind, and the picker in which it is chosen."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.core.guidance.guide import HeadingSource
from app.core.storage.settings import Settings
from app.devices.clock import VirtualClock
from app.devices.webcam import GUESS_FOV_DEG, LiveSource, WebcamError, WebcamState
from app.ui.presenters.services import Folders, Services
from app.ui.presenters.undo_stack import UndoStack
from app.ui.presenters.window_model import Model
from app.ui.screens.turn.live.camera import LiveCamera
from app.ui.screens.turn.live.source import NO_WEBCAMS, SourcesPresenter, SourcesState, SourcesView
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.turn_rig import FakeWebcam

PHONE = "http://10.0.0.7:8080/video"


class Rig:
    """A camera and its picker, with sources that a test decides on."""

    def __init__(self, *, webcams: int = 2, demo: object | None = None, **settings: Any) -> None:
        self.model = Model(Settings(**settings))
        self.clock = VirtualClock(100.0)
        self.webcams = [FakeWebcam(f"Camera {n}", None) for n in range(webcams)]  # type: ignore[arg-type]
        self.devices = MagicMock(spec=["webcams", "webcam", "passwords", "simulated"])
        self.devices.simulated = demo
        self.devices.webcams.side_effect = lambda: [(n, w.name) for n, w in enumerate(self.webcams)]
        self.devices.webcam.side_effect = lambda index: self.webcams[index]
        self.devices.passwords.return_value.get.return_value = None
        here = Path("nowhere")
        self.services = Services(
            self.model,
            ImmediateRunner(),
            MagicMock(),
            UndoStack(),
            self.clock,
            lambda: datetime(2026, 11, 21, tzinfo=UTC),
            self.devices,
            Folders(here, here, here, here, here),
        )
        self.made: list[tuple[LiveSource, int, Any]] = []
        self.others: list[FakeWebcam] = []
        self.taken = 0
        self.camera = LiveCamera(self.services, lambda: None, self._make)
        self.presenter = SourcesPresenter(self.services, self.camera, self._taken)
        self.view = MagicMock(spec=SourcesView)

    def _make(self, source: LiveSource, _clock: object, *, width: int, keys: Any) -> Any:
        self.made.append((source, width, keys))
        self.others.append(FakeWebcam(source.title, None))  # type: ignore[arg-type]
        return self.others[-1]

    def _taken(self) -> None:
        self.taken += 1

    @property
    def state(self) -> SourcesState:
        state: SourcesState = self.view.show_state.call_args[0][0]
        return state

    @property
    def settings(self) -> Settings:
        return self.model.settings

    def start(self) -> None:
        self.camera.start()
        self.presenter.attach(self.view)

    def tick(self, seconds: float = 1.0) -> SourcesState:
        self.clock.sleep(seconds)
        self.camera.tick()
        self.presenter.tick()
        return self.state

    def connect(self, address: str = PHONE) -> FakeWebcam:
        self.presenter.show_kind("network")
        self.presenter.connect(address)
        return self.others[-1]


def fov_of(rig: Rig) -> float | None:
    return rig.camera.fov_deg


def movable(rig: Rig) -> object:
    return rig.camera.simulated


def open_now(rig: Rig) -> bool:
    return rig.state.adjustable


def shot(shape: tuple[int, int] = (72, 128)) -> Any:
    return np.full((*shape, 3), 90, np.uint8)


def test_webcams_are_listed_by_name_and_chosen() -> None:
    rig = Rig()
    rig.start()
    assert [item[1] for item in rig.state.items[:2]] == ["Camera 0", "Camera 1"]
    assert [item[0] for item in rig.state.items[2:]] == ["network", "video"]
    assert rig.state.key == "webcam:0"
    assert rig.state.status == "Connecting…"
    rig.presenter.show_kind("webcam:1")
    assert rig.state.key == "webcam:1"
    assert rig.settings.webcam == 1
    assert rig.webcams[0].closed == 1
    rig.webcams[1].send(shot())
    assert re.findall("[0-9]+", rig.tick().status) == ["128", "72", "24"]
    assert rig.state.status_icon == "check"
    assert rig.camera.name == "Camera 1"
    assert rig.taken == 1


def test_a_network_camera_is_connected_to_and_remembered() -> None:
    rig = Rig()
    rig.start()
    rig.presenter.show_kind("network")
    assert rig.state.key == "network"
    assert not open_now(rig), "the webcam is still in use"
    assert rig.camera.chosen.kind == "webcam"
    phone = rig.connect(" 10.0.0.7:8080/video ")
    assert rig.made[0][0] == LiveSource.network(PHONE)
    assert rig.state.key == "network"
    assert rig.state.address == PHONE
    assert open_now(rig)
    assert rig.settings.live_source == f"network:{PHONE}"
    assert rig.webcams[0].closed == 1
    assert rig.camera.index == -1
    phone.send(shot())
    rig.tick()
    assert rig.camera.source is HeadingSource.LIVE
    again = Rig(live_source=rig.settings.live_source)
    again.start()
    assert again.made[0][0] == LiveSource.network(PHONE)
    assert again.webcams[0].state is WebcamState.OFF
    rig.presenter.show_kind("webcam:0")
    assert rig.settings.live_source == ""
    assert phone.closed == 1


@pytest.mark.parametrize("typed", ["", "ftp://x", "http://a:b@c/", "http://a b/", "x" * 5000])
def test_a_wrong_address_is_said_and_nothing_is_changed(typed: str) -> None:
    rig = Rig()
    rig.start()
    rig.presenter.show_kind("network")
    rig.presenter.type_address(typed)
    rig.presenter.connect(typed)
    assert rig.state.address_error
    assert not rig.made
    assert rig.webcams[0].closed == 0
    rig.presenter.type_address("10.0.0.7")
    rig.presenter.connect("10.0.0.7")
    assert rig.state.address_error == ""
    assert len(rig.made) == 1


def test_connecting_again_tries_again() -> None:
    rig = Rig()
    rig.start()
    first = rig.connect()
    rig.presenter.connect(PHONE)
    assert len(rig.made) == 2
    assert first.closed == 1


def test_an_address_with_a_password_is_used_and_not_kept() -> None:
    rig = Rig()
    rig.start()
    rig.connect("http://10.0.0.7/video?user=anna&pwd=geheim")
    rig.presenter.set_fov(70.0)
    assert rig.made
    assert "geheim" not in repr(rig.settings)


def test_a_password_is_asked_for_and_kept_once_it_works() -> None:
    rig = Rig()
    rig.start()
    phone = rig.connect()
    assert not rig.state.asks_password
    phone.error = WebcamError("It wants a password.", "Type it.", "password")
    phone.state = WebcamState.RETRYING
    assert rig.tick().asks_password
    assert rig.state.status_icon == "error"
    assert "keyring" in rig.state.password_hint
    assert "on this Wi-Fi network could read" in rig.state.password_hint
    for user, password in (
        ("", "x"),
        ("anna", ""),
        ("an:na", "x"),
        ("anna", "x\r\ny"),
        ("a", "é" * 200),
    ):
        rig.presenter.sign_in(user, password)
        assert rig.state.password_error
        assert len(rig.made) == 1
    assert rig.made[0][2]() is None
    rig.presenter.sign_in(" anna ", "geheim")
    keys = rig.made[1][2]()
    assert (keys.user, keys.password) == ("anna", "geheim")
    kept = rig.devices.passwords.return_value.set
    assert not kept.called, "not before it works"
    rig.others[1].send(shot())
    rig.tick()
    kept.assert_called_once_with("10.0.0.7:8080", "anna:geheim")
    assert "geheim" not in repr(rig.settings)
    assert not rig.state.asks_password


def test_a_refused_password_is_said() -> None:
    rig = Rig()
    rig.start()
    rig.connect()
    rig.presenter.sign_in("anna", "falsch")
    rig.others[-1].error = WebcamError("Not accepted.", "Look.", "password-refused")
    assert rig.tick().password_error == "Not accepted. Look."
    assert not rig.devices.passwords.return_value.set.called


def test_a_password_from_the_keyring_is_used() -> None:
    rig = Rig()
    rig.devices.passwords.return_value.get.side_effect = {"10.0.0.7:8080": "anna:a:b"}.get
    rig.start()
    rig.connect()
    keys = rig.made[0][2]()
    assert (keys.user, keys.password) == ("anna", "a:b")


def test_a_video_is_checked_before_it_is_used(tmp_path: Path) -> None:
    rig = Rig()
    rig.start()
    video = tmp_path / "walk.avi"
    rig.presenter.show_kind("video")
    assert rig.state.file == ""
    rig.presenter.choose_video(video)
    assert video.name in rig.state.file_error
    assert rig.state.key == "video"
    video.write_bytes(b"RIFF\x00\x00\x00\x00AVI LIST" + bytes(400))
    rig.presenter.choose_video(str(video))
    assert rig.made[-1][0] == LiveSource("video", str(video))
    assert rig.state.file == "walk.avi"
    assert rig.state.file_error == ""
    assert rig.settings.live_source == f"video:{video}"


def test_the_field_of_view_is_estimated_until_it_is_set() -> None:
    rig = Rig()
    rig.start()
    assert fov_of(rig) is None
    assert rig.camera.fov_guess_deg == GUESS_FOV_DEG
    assert rig.state.estimate
    assert rig.state.fov_words == "not yet known"
    rig.camera.learn_fov(71.4)
    rig.camera.learn_fov(71.6)
    rig.camera.learn_fov(500.0)
    assert rig.tick().fov_words == "71° so far"
    assert fov_of(rig) is None
    assert rig.camera.fov_guess_deg == 71.4
    rig.presenter.estimate(False)
    assert fov_of(rig) == 71.4
    rig.presenter.set_fov(400.0)
    assert fov_of(rig) == 150.0
    rig.presenter.show_kind("webcam:1")
    assert fov_of(rig) is None, "each source has its own"
    rig.presenter.show_kind("webcam:0")
    assert fov_of(rig) == 150.0
    again = Rig(live_views=rig.settings.live_views)
    again.start()
    assert fov_of(again) == 150.0
    again.presenter.estimate(True)
    assert fov_of(again) is None
    assert again.camera.fov_guess_deg == 71.4


def test_what_was_learnt_is_kept_when_the_screen_is_left() -> None:
    rig = Rig()
    rig.start()
    rig.camera.learn_fov(58.0)
    assert rig.settings.live_views == "", "not at every picture"
    rig.camera.stop()
    assert Rig(live_views=rig.settings.live_views).camera.fov_guess_deg == 58.0


def test_a_camera_that_knows_its_field_of_view() -> None:
    rig = Rig()
    rig.webcams[0].fov_deg = 60.0
    rig.start()
    assert fov_of(rig) == 60.0
    assert rig.state.known_fov.startswith("60°")


def test_resolutions() -> None:
    rig = Rig()
    asked: list[int] = []
    rig.webcams[0].ask_width = asked.append  # type: ignore[attr-defined]
    rig.start()
    assert rig.state.widths[1] == ("640", "640 × 480")
    rig.presenter.set_width("1920")
    assert asked == [0, 1920]
    assert rig.webcams[0].closed == 1
    assert rig.state.width == "1920"
    rig.presenter.set_width("1920")
    rig.presenter.set_width("77")
    rig.presenter.set_width("x")
    assert asked == [0, 1920]
    rig.connect()
    assert rig.made[0][1] == 0
    assert rig.state.widths[1] == ("640", "At most 640 px wide")
    rig.presenter.set_width("640")
    assert rig.made[1][1] == 640


def test_a_webcam_that_was_pulled_out_stays_in_the_list() -> None:
    rig = Rig(webcams=1)
    rig.start()
    rig.webcams.clear()
    rig.camera.list_again()
    rig.tick()
    assert rig.state.key == "webcam:0"
    assert rig.state.items[0][1:3] == NO_WEBCAMS
    assert not rig.state.webcams


def test_no_webcam_at_all() -> None:
    rig = Rig(webcams=0)
    rig.start()
    assert rig.state.key == "webcam:0"
    assert rig.state.status == ""
    rig.webcams.append(FakeWebcam("New one"))
    for _ in range(6):
        rig.tick()
    assert rig.camera.name == "New one"


def test_damaged_settings_are_a_webcam() -> None:
    rig = Rig(live_source="network:file:///etc/passwd", live_views="{")
    rig.start()
    assert rig.camera.chosen == LiveSource.webcam(0)


def test_what_can_be_moved_from_here() -> None:
    demo = MagicMock(spec=["set_turn"])
    rig = Rig(demo=demo)
    assert movable(rig) is demo
    rig.start()
    rig.connect()
    assert movable(rig) is None
    rig.camera.use(LiveSource("demo", str(Path("/tmp/demo"))))
    rig.others[-1].set_turn = lambda turn_deg: None  # type: ignore[attr-defined]
    assert movable(rig) is rig.others[-1]
    rig.presenter.attach(rig.view)
    assert rig.state.key == "demo"


def test_nobody_looks() -> None:
    rig = Rig()
    rig.start()
    other = MagicMock(spec=SourcesView)
    rig.presenter.detach(other)
    rig.tick()
    calls = rig.view.show_state.call_count
    rig.presenter.tick()
    assert rig.view.show_state.call_count == calls, "not at every picture"
    rig.presenter.detach(rig.view)
    rig.clock.sleep(5.0)
    rig.presenter.tick()
    assert rig.view.show_state.call_count == calls
    rig.camera.stop()
    rig.camera.again()
    rig.camera.list_again()
    rig.presenter.connect(PHONE)
    assert not rig.made, "nothing is opened while the screen is not in front"
