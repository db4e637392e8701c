"""The Turn screen's presenter with a lamp at a known azimuth and a webcam that does as told."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.environment.environment import Environment
from app.core.localization import features
from app.core.localization.heading import Heading
from app.core.localization.sitter import Sitter
from app.core.portrait.head import Head
from app.core.solver.place_light import PlaceLight, prepare
from app.core.solver.solve import solve_all
from app.core.solver.turn_choice import Limits
from app.core.storage.settings import Settings
from app.devices.clock import VirtualClock
from app.devices.latest_frame import Mailbox
from app.devices.webcam import WebcamError, WebcamFrame, WebcamState
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Folders, Services
from app.ui.presenters.undo_stack import UndoStack
from app.ui.presenters.window_model import Model, Step
from app.ui.screens.turn.live import alignment, heading_tracker
from app.ui.screens.turn.screen import TurnPresenter
from app.ui.screens.turn.state import TurnState, TurnView
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment, synthetic_pack

__all__ = [
    "FakeWebcam",
    "Rig",
    "frame_of",
    "lit_from",
    "read_heading",
    "read_sitter",
    "see_what_is_written",
]

UNSEEN = 999.0
"""Heading of a picture in which nothing is found."""


def lit_from(azimuth_deg: float) -> PlaceLight:
    """Light of one lamp at a panorama azimuth, a little fill around it."""
    luminance = lamp_environment(azimuth_deg, 20.0, fill=0.02)
    radiance = np.repeat(luminance[..., None], 3, axis=2).astype(np.float32)
    return prepare(Environment(radiance, "lamp"))


def frame_of(
    heading_deg: float, shape: tuple[int, int] = (72, 128), sitter_deg: float | None = 0.0
) -> NDArray[np.uint8]:
    """Picture that says in two pixels where the camera points, and where the sitter is in it.

    Its left half is darker. Without a sitter nobody is in it.
    """
    picture = np.full((*shape, 3), 200, np.uint8)
    picture[:, : shape[1] // 2] = 60
    code = round((heading_deg + 180.0) * 10.0)
    picture[0, 0] = (code // 256, code % 256, 7)
    beside = 0 if sitter_deg is None else round((sitter_deg + 100.0) * 100.0)
    picture[0, 1] = (beside // 256, beside % 256, 7)
    return picture


def read_heading(picture: NDArray[np.uint8], *_: Any, **__: Any) -> Heading:
    """Read the heading that `frame_of` wrote, in place of looking for it in a panorama."""
    heading = (int(picture[0, 0, 0]) * 256 + int(picture[0, 0, 1])) / 10.0 - 180.0
    if heading > 360.0:
        return Heading("unsure", None)
    return Heading("found", wrap(heading), inliers=142, confidence=0.97, fov_deg=60.0)


def read_sitter(picture: NDArray[np.uint8], fov_deg: float, *_: Any) -> Sitter | None:
    """Read where `frame_of` put the sitter."""
    code = int(picture[0, 1, 0]) * 256 + int(picture[0, 1, 1])
    if code == 0:
        return None
    angle = code / 100.0 - 100.0
    share = math.tan(math.radians(angle)) / math.tan(math.radians(fov_deg / 2.0))
    column = 0.5 + share / 2.0
    return Sitter(column, angle, (column - 0.1, 0.2, column + 0.1, 0.6))


def see_what_is_written(patch: pytest.MonkeyPatch) -> None:
    """Let the program read what `frame_of` wrote, in place of looking at pictures."""
    patch.setattr(heading_tracker, "find_heading", read_heading)
    patch.setattr(heading_tracker, "find_sitter", read_sitter)
    patch.setattr(alignment, "find_sitter", read_sitter)
    patch.setattr(features, "build_index", lambda *_: object())
    patch.setattr(heading_tracker, "keep_index", lambda *_: None)


@dataclass
class FakeWebcam:
    """A webcam whose pictures and troubles a test decides on."""

    name: str = "Fake webcam"
    fov_deg: float = 60.0
    state: WebcamState = WebcamState.OFF
    error: WebcamError | None = None
    fps: float = 24.0
    count: int = 0
    frames: Mailbox[WebcamFrame] = field(default_factory=Mailbox)
    closed: int = 0

    def open(self) -> None:
        self.state = WebcamState.CONNECTING

    def close(self, wait_s: float = 0.5) -> None:
        assert wait_s == 0.0, "nobody waits for a webcam on the thread of the screens"
        self.state, self.closed = WebcamState.OFF, self.closed + 1

    def send(self, picture: NDArray[np.uint8]) -> None:
        self.state, self.count = WebcamState.LIVE, self.count + 1
        self.frames.put(WebcamFrame(picture, self.count))

    def unplug(self) -> None:
        self.state = WebcamState.LOST


class Rig:
    """Model, services, presenter and a view that remembers the last state."""

    def __init__(
        self,
        patch: pytest.MonkeyPatch,
        *,
        lamp_deg: float = 60.0,
        style: str = "butterfly",
        webcams: int = 1,
        **settings: Any,
    ) -> None:
        see_what_is_written(patch)
        patch.setattr(features, "build_index", self._index)
        values = {"camera_looks": "sitter", "sounds": False, **settings}
        self.model = Model(Settings(**values))
        self.clock = VirtualClock(100.0)
        self.runner = ImmediateRunner()
        self.webcams = [FakeWebcam(f"Webcam {n + 1}") for n in range(webcams)]
        self.devices = MagicMock(spec=["webcams", "webcam"])
        self.devices.webcams.side_effect = lambda: tuple(
            (n, one.name) for n, one in enumerate(self.webcams)
        )
        self.devices.webcam.side_effect = lambda index: self.webcams[index]
        self.sounds, self.notify = MagicMock(), MagicMock()
        self.blank = False
        here = Path("nowhere")
        self.services = Services(
            self.model,
            self.runner,
            self.notify,
            UndoStack(),
            self.clock,
            lambda: datetime(2026, 11, 21, tzinfo=UTC),
            self.devices,
            Folders(here, here, here, here, here),
            self.sounds,
        )
        pack = synthetic_pack()
        self.head = Head("synthetic", pack, lambert_sphere_transport())
        light = lit_from(lamp_deg)
        results = solve_all(pack, light.searched, "picture", limits=Limits(0.0, 0.0))
        self.model.update(
            head=self.head, light=light, results=results, chosen=style, step=Step.TURN
        )
        self.view = MagicMock(spec=TurnView)
        self.place_controller = MagicMock(spec=PlaceController)
        self.presenter = TurnPresenter(self.services, self.place_controller)

    def _index(self, *_: Any) -> object:
        if self.blank:
            raise CoreError("There is nothing in this panorama.", "Turn by the number.")
        return object()

    @property
    def webcam(self) -> FakeWebcam:
        return self.webcams[0]

    @property
    def goal(self) -> float:
        goal = self.model.target_turn_deg
        assert goal is not None
        return goal

    @property
    def state(self) -> TurnState:
        shown: TurnState = self.view.show_state.call_args[0][0]
        return shown

    def start(self) -> None:
        self.presenter.attach(self.view)
        self.presenter.enter()

    def tick(self, times: int = 1, seconds: float = 0.04) -> TurnState:
        for _ in range(times):
            self.clock.sleep(seconds)
            self.presenter.tick()
        return self.state

    def point(self, heading_deg: float, sitter_deg: float | None = 0.0) -> TurnState:
        """Point the camera to a panorama azimuth; stand there until it is believed."""
        for _ in range(3):
            self.webcam.send(frame_of(heading_deg, sitter_deg=sitter_deg))
            self.tick(2, 0.5)
        return self.state

    def turn_to(self, turn_deg: float) -> TurnState:
        """Turn the sitter, a camera that looks at them with them."""
        return self.point(wrap(turn_deg + 180.0))

    def lose(self) -> TurnState:
        """Point the camera where nothing is known."""
        self.webcam.send(frame_of(UNSEEN))
        return self.tick(2)
