"""A webcam that stands at the demo location, and turns with a slider or the arrow keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.localization.heading_conversion import heading_of_turn
from app.devices.clock import SystemClock
from app.devices.webcam.demo_views import DemoViews
from app.devices.webcam.pictures import Grain
from app.devices.webcam.protocol import WebcamError
from app.devices.webcam.stream import WebcamStream

if TYPE_CHECKING:
    from pathlib import Path

    from app.devices.clock import Clock
    from app.devices.webcam.protocol import Bytes

FPS: Final = 24.0
"""Pictures per second."""

SIZE: Final = (1280, 720)
"""Columns and rows of its pictures."""

FOV_DEG: Final = 60.0
"""Horizontal field of view: the views' whole width; top and bottom are cut to 36 deg."""


class SimulatedWebcam(WebcamStream):
    """Shows the sitter of the demo location, and what is behind them at the turn it is set to.

    Its camera looks at the sitter, who is in the middle of the picture and faces it: its heading is
    the turn + 180.

    Parameters
    ----------
    size : tuple[int, int], optional
        Columns and rows.
    """

    def __init__(
        self,
        views: Path,
        clock: Clock | None = None,
        *,
        distance_m: float = 1.2,
        size: tuple[int, int] = SIZE,
        noise: float = 0.0,
    ) -> None:
        own = clock or SystemClock()
        self._scene = _Scene(views, own, distance_m, size, noise)
        super().__init__(self._scene, "Demo webcam", FOV_DEG, own, still=True)

    @property
    def distance_m(self) -> float:
        """How far it stands from the sitter, metres."""
        return self._scene.distance_m

    @property
    def turn_deg(self) -> float:
        """The turn that its next picture shows, in (-180, 180], deg."""
        return self._scene.turn_deg

    @property
    def heading_deg(self) -> float:
        """Where it points, panorama azimuth in (-180, 180], deg."""
        return heading_of_turn(self._scene.turn_deg)

    def set_turn(self, turn_deg: float) -> None:
        """Go to another turn; from the next picture on.

        Parameters
        ----------
        turn_deg : float
            Deg, positive clockwise.
        """
        self._scene.turn_deg = wrap(turn_deg)

    def unplug(self) -> None:
        """Pull the plug, as a test or a clumsy foot would."""
        self._scene.plugged = False

    def plug_in(self) -> None:
        """Put the plug back in."""
        self._scene.plugged = True

    def freeze(self, frozen: bool = True) -> None:
        """Send no further pictures, or go on."""
        self._scene.frozen = frozen

    def blacken(self, black: bool = True) -> None:
        """Cover the lens, or uncover it."""
        self._scene.black = black


class _Scene:
    """The source of a `SimulatedWebcam`."""

    def __init__(
        self, views: Path, clock: Clock, distance_m: float, size: tuple[int, int], noise: float
    ) -> None:
        self._folder = views
        self._clock = clock
        self._size = size
        self._views: DemoViews | None = None
        self._last: tuple[float, Bytes] | None = None
        self._next_s = 0.0
        self._grain = Grain(size, noise) if noise > 0.0 else None
        self.distance_m = distance_m
        self.turn_deg = 0.0
        self.plugged = True
        self.frozen = False
        self.black = False

    def open(self) -> None:
        """Read what is needed at once."""
        if not self.plugged:
            raise WebcamError(
                "No webcam is connected.", "Plug one in and it starts by itself.", "no-webcam"
            )
        if self._views is None:
            aspect = self._size[0] / self._size[1]
            self._views = DemoViews(self._folder, self.distance_m, aspect)
            self.distance_m = self._views.distance_m
        self._next_s = self._clock.now()

    def read(self) -> Bytes | None:
        """Give the next picture when it is time for it."""
        if not self.plugged:
            raise WebcamError("Webcam disconnected.", "Plug it back in to continue.", "unplugged")
        # Behind by more than a picture, it skips some, as a camera does.
        self._next_s = max(self._next_s + 1.0 / FPS, self._clock.now() - 1.0 / FPS)
        self._clock.sleep(self._next_s - self._clock.now())
        if self.frozen:
            return None
        if self.black:
            return np.zeros((self._size[1], self._size[0], 3), np.uint8)
        shown = self._shown(self.turn_deg)
        return shown if self._grain is None else self._grain.on(shown)

    def close(self) -> None:
        """Nothing is held."""

    def _shown(self, turn_deg: float) -> Bytes:
        if self._last is not None and self._last[0] == turn_deg:
            return self._last[1]
        if self._views is None:
            raise WebcamError("The webcam is not open.", "Open it first.", "no-webcam")
        picture = self._views.picture(turn_deg)
        shown = np.asarray(
            cv2.resize(picture, self._size, interpolation=cv2.INTER_LINEAR), np.uint8
        )
        self._last = (turn_deg, shown)
        return shown
