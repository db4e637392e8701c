"""Simulated webcams: one that stands at the demo location, and one inside any panorama."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.hdr.display import display_panorama
from app.core.localization.heading_conversion import heading_of_turn, turn_of_heading
from app.core.localization.views import Lens, look
from app.core.solver.environment import read_environment
from app.core.text import tr
from app.devices.clock import Clock, SystemClock
from app.devices.webcam.demo_views import DemoViews
from app.devices.webcam.protocol import (
    WEBCAM,
    Bytes,
    WebcamError,
    WebcamStream,
    no_webcam,
    unplugged,
)

FPS: Final = 24.0
"""Pictures per second at the demo location."""

PANORAMA_FPS: Final = 15.0
"""Pictures per second inside a panorama."""

SIZE: Final = (1280, 720)
"""Columns and rows of their pictures."""

FOV_DEG: Final = 60.0
"""Horizontal field of view: the demo views' whole width; top and bottom are cut to 36 deg."""

_HIGHEST_DEG: Final = 80.0
_STILL: Final = replace(WEBCAM, still=True)


class _SimulatedStream(WebcamStream):
    """A webcam that shows its place at a steady pace, and is pointed, unplugged and covered."""

    def __init__(
        self, name: str, fov_deg: float, clock: Clock | None, fps: float, size: tuple[int, int]
    ) -> None:
        super().__init__(name, fov_deg, clock or SystemClock(), _STILL)
        self._step_s = 1.0 / fps
        self._size = size
        self._last: tuple[tuple[float, float], Bytes] | None = None
        self._aim = (0.0, 0.0)  # across and up, deg
        self._plugged = True
        self._frozen = False
        self._black = False

    @abstractmethod
    def load(self) -> None:
        """Read what is needed, the first time; raises `WebcamError`."""

    @abstractmethod
    def view(self, across_deg: float, up_deg: float) -> Bytes:
        """Return what is seen, (H, W, 3) uint8 sRGB, a new array."""

    def unplug(self) -> None:
        """Pull the plug, as a test or a clumsy foot would."""
        self._plugged = False

    def plug_in(self) -> None:
        """Put the plug back in."""
        self._plugged = True

    def freeze(self, frozen: bool = True) -> None:
        """Send no further pictures, or go on."""
        self._frozen = frozen

    def blacken(self, black: bool = True) -> None:
        """Cover the lens, or uncover it."""
        self._black = black

    def connect(self) -> None:
        """Read what is needed at once."""
        if not self._plugged:
            raise no_webcam()
        self.load()
        self._due_s = self._clock.now()

    def read(self) -> Bytes | None:
        """Give the next picture when it is time for it."""
        if not self._plugged:
            raise unplugged()
        # Behind by more than a picture, it skips some, as a camera does.
        self.pace(self._step_s, self._step_s)
        if self._frozen:
            return None
        if self._black:
            return np.zeros((self._size[1], self._size[0], 3), np.uint8)
        aim = self._aim
        if self._last is None or self._last[0] != aim:
            self._last = (aim, self.view(*aim))
        return self._last[1]

    def disconnect(self) -> None:
        """Nothing is held."""


class SimulatedWebcam(_SimulatedStream):
    """Shows the sitter of the demo location, and what is behind them at the turn it is set to.

    Its camera looks at the sitter, who is in the middle of the picture and faces it: its heading is
    the turn + 180.

    * `views`: the folder of the demo location's views.
    * `distance_m`: metres from the sitter; the nearest there is.
    * `size`: columns and rows.
    """

    def __init__(
        self,
        views: Path,
        clock: Clock | None = None,
        *,
        distance_m: float = 1.2,
        size: tuple[int, int] = SIZE,
    ) -> None:
        super().__init__(tr("Demo webcam"), FOV_DEG, clock, FPS, size)
        self._folder = views
        self._views: DemoViews | None = None
        self._distance_m = distance_m

    @property
    def turn_deg(self) -> float:
        """The turn that its next picture shows, in (-180, 180], deg."""
        return self._aim[0]

    @property
    def heading_deg(self) -> float:
        """Where it points, panorama azimuth in (-180, 180], deg."""
        return heading_of_turn(self.turn_deg)

    def set_turn(self, turn_deg: float) -> None:
        """Go to another turn (deg, positive clockwise); from the next picture on."""
        self._aim = (wrap(turn_deg), 0.0)

    @property
    def distance_m(self) -> float:
        """How far it stands from the sitter, metres."""
        return self._distance_m

    def load(self) -> None:
        """Read the list of views, the first time."""
        if self._views is None:
            aspect = self._size[0] / self._size[1]
            self._views = DemoViews(self._folder, self._distance_m, aspect)
            self._distance_m = self._views.distance_m

    def view(self, across_deg: float, up_deg: float) -> Bytes:
        """Return what is seen at a turn, (H, W, 3) uint8 sRGB."""
        del up_deg
        if self._views is None:
            raise WebcamError(tr("The webcam is not open."), tr("Open it first."), "no-webcam")
        picture = self._views.picture(across_deg)
        return np.asarray(cv2.resize(picture, self._size, interpolation=cv2.INTER_LINEAR), np.uint8)


class PanoramaWebcam(_SimulatedStream):
    """Shows a panorama from its middle, as a pinhole camera there would see it.

    There is no sitter in its pictures and no parallax: its heading is exact, and its turn that of a
    camera which looks at the sitter.

    * `panorama`, Path or (H, 2 H, 3) uint8: an OpenEXR or Radiance file, or sRGB.
    * `fov_deg`: horizontal field of view, deg, 20 to 150.
    * `size`: columns and rows.
    """

    def __init__(
        self,
        panorama: Path | Bytes,
        clock: Clock | None = None,
        *,
        fov_deg: float = FOV_DEG,
        size: tuple[int, int] = SIZE,
    ) -> None:
        super().__init__(tr("Panorama"), fov_deg, clock, PANORAMA_FPS, size)
        self._given = panorama
        self._lens = Lens(fov_deg, size)
        self._panorama: Bytes | None = None

    @property
    def heading_deg(self) -> float:
        """Where it is pointed, panorama azimuth in (-180, 180], deg."""
        return self._aim[0]

    @property
    def turn_deg(self) -> float:
        """The turn whose background it shows, in (-180, 180], deg."""
        return turn_of_heading(self.heading_deg)

    def set_turn(self, turn_deg: float) -> None:
        """Point it to the background of a turn (deg, positive clockwise)."""
        self.point(heading_of_turn(turn_deg), self.pitch_deg)

    @property
    def pitch_deg(self) -> float:
        """How far it is pointed up, deg."""
        return self._aim[1]

    def point(self, heading_deg: float, pitch_deg: float = 0.0) -> None:
        """Point it at an azimuth and up, deg, at most 80 either way; from the next picture on."""
        pitch = min(max(pitch_deg, -_HIGHEST_DEG), _HIGHEST_DEG)
        self._aim = (wrap(heading_deg), pitch)

    def load(self) -> None:
        """Read the panorama, the first time."""
        if self._panorama is not None:
            return
        if isinstance(self._given, np.ndarray):
            if self._given.ndim != 3 or self._given.shape[1] != 2 * self._given.shape[0]:
                raise WebcamError(
                    tr("This picture is not a full panorama."),
                    tr("Its width must be twice its height."),
                    "bad-file",
                )
            self._panorama = self._given
            return
        try:
            self._panorama = display_panorama(read_environment(self._given).radiance)
        except CoreError as error:
            raise WebcamError(error.message, error.hint, "bad-file") from None

    def view(self, across_deg: float, up_deg: float) -> Bytes:
        """Return what is seen, (H, W, 3) uint8 sRGB."""
        if self._panorama is None:
            raise unplugged()
        return look(self._panorama, across_deg, self._lens, up_deg)
