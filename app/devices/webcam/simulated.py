"""Simulated webcams: one that stands at the demo location, and one inside any panorama."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.hdr.display import display_panorama
from app.core.localization.heading_conversion import heading_of_turn, turn_of_heading
from app.core.localization.views import Lens, look
from app.core.solver.environment import read_environment
from app.devices.clock import SystemClock
from app.devices.webcam.demo_views import DemoViews
from app.devices.webcam.protocol import WebcamError, WebcamStream, no_webcam, unplugged

if TYPE_CHECKING:
    from pathlib import Path

    from app.devices.clock import Clock
    from app.devices.webcam.protocol import Bytes

FPS: Final = 24.0
"""Pictures per second at the demo location."""

PANORAMA_FPS: Final = 15.0
"""Pictures per second inside a panorama."""

SIZE: Final = (1280, 720)
"""Columns and rows of their pictures."""

FOV_DEG: Final = 60.0
"""Horizontal field of view: the demo views' whole width; top and bottom are cut to 36 deg."""

_HIGHEST_DEG: Final = 80.0


class _Place(Protocol):
    """What a simulated webcam stands in."""

    def read(self) -> None:
        """Read what is needed, the first time; raises `WebcamError`."""

    def view(self, across_deg: float, up_deg: float) -> Bytes:
        """Return what is seen, a new array; deg."""


class SimulatedSource:
    """The source of a simulated webcam: it shows its place at a steady pace."""

    def __init__(self, place: _Place, clock: Clock, fps: float, size: tuple[int, int]) -> None:
        self._place = place
        self._clock = clock
        self._step_s = 1.0 / fps
        self._size = size
        self._next_s = 0.0
        self._last: tuple[tuple[float, float], Bytes] | None = None
        self.aim = (0.0, 0.0)  # what its place takes, deg
        self.plugged = True
        self.frozen = False
        self.black = False

    def open(self) -> None:
        """Read what is needed at once."""
        if not self.plugged:
            raise no_webcam()
        self._place.read()
        self._next_s = self._clock.now()

    def read(self) -> Bytes | None:
        """Give the next picture when it is time for it."""
        if not self.plugged:
            raise unplugged()
        # Behind by more than a picture, it skips some, as a camera does.
        self._next_s = max(self._next_s + self._step_s, self._clock.now() - self._step_s)
        self._clock.sleep(self._next_s - self._clock.now())
        if self.frozen:
            return None
        if self.black:
            return np.zeros((self._size[1], self._size[0], 3), np.uint8)
        aim = self.aim
        if self._last is None or self._last[0] != aim:
            self._last = (aim, self._place.view(*aim))
        return self._last[1]

    def close(self) -> None:
        """Nothing is held."""


class _SimulatedStream(WebcamStream):
    """A webcam that is pointed, unplugged and covered by a program."""

    def __init__(self, source: SimulatedSource, name: str, fov_deg: float, clock: Clock) -> None:
        self._shown = source
        super().__init__(source, name, fov_deg, clock, still=True)

    def unplug(self) -> None:
        """Pull the plug, as a test or a clumsy foot would."""
        self._shown.plugged = False

    def plug_in(self) -> None:
        """Put the plug back in."""
        self._shown.plugged = True

    def freeze(self, frozen: bool = True) -> None:
        """Send no further pictures, or go on."""
        self._shown.frozen = frozen

    def blacken(self, black: bool = True) -> None:
        """Cover the lens, or uncover it."""
        self._shown.black = black


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
        own = clock or SystemClock()
        self._location = DemoLocation(views, distance_m, size)
        source = SimulatedSource(self._location, own, FPS, size)
        super().__init__(source, "Demo webcam", FOV_DEG, own)

    @property
    def turn_deg(self) -> float:
        """The turn that its next picture shows, in (-180, 180], deg."""
        return self._shown.aim[0]

    @property
    def heading_deg(self) -> float:
        """Where it points, panorama azimuth in (-180, 180], deg."""
        return heading_of_turn(self.turn_deg)

    def set_turn(self, turn_deg: float) -> None:
        """Go to another turn (deg, positive clockwise); from the next picture on."""
        self._shown.aim = (wrap(turn_deg), 0.0)

    @property
    def distance_m(self) -> float:
        """How far it stands from the sitter, metres."""
        return self._location.distance_m


class DemoLocation:
    """The demo location as its views show it."""

    def __init__(self, folder: Path, distance_m: float, size: tuple[int, int]) -> None:
        self._folder = folder
        self._size = size
        self._views: DemoViews | None = None
        self.distance_m = distance_m

    def read(self) -> None:
        """Read the list of views, the first time."""
        if self._views is None:
            aspect = self._size[0] / self._size[1]
            self._views = DemoViews(self._folder, self.distance_m, aspect)
            self.distance_m = self._views.distance_m

    def view(self, across_deg: float, up_deg: float) -> Bytes:
        """Return what is seen at a turn, (H, W, 3) uint8 sRGB."""
        del up_deg
        if self._views is None:
            raise WebcamError("The webcam is not open.", "Open it first.", "no-webcam")
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
        own = clock or SystemClock()
        place = PanoramaPlace(panorama, Lens(fov_deg, size))
        source = SimulatedSource(place, own, PANORAMA_FPS, size)
        super().__init__(source, "Panorama", fov_deg, own)

    @property
    def heading_deg(self) -> float:
        """Where it is pointed, panorama azimuth in (-180, 180], deg."""
        return self._shown.aim[0]

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
        return self._shown.aim[1]

    def point(self, heading_deg: float, pitch_deg: float = 0.0) -> None:
        """Point it at an azimuth and up, deg, at most 80 either way; from the next picture on."""
        pitch = min(max(pitch_deg, -_HIGHEST_DEG), _HIGHEST_DEG)
        self._shown.aim = (wrap(heading_deg), pitch)


class PanoramaPlace:
    """A panorama, looked at from its middle."""

    def __init__(self, panorama: Path | Bytes, lens: Lens) -> None:
        self._given = panorama
        self._lens = lens
        self._panorama: Bytes | None = None

    def read(self) -> None:
        """Read the panorama, the first time."""
        if self._panorama is not None:
            return
        if isinstance(self._given, np.ndarray):
            if self._given.ndim != 3 or self._given.shape[1] != 2 * self._given.shape[0]:
                raise WebcamError(
                    "This picture is no full panorama.",
                    "Its width is to be twice its height.",
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
