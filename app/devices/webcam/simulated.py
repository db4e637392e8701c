"""A webcam that stands at the demo location, and turns with a slider or the arrow keys."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

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
from app.devices.webcam.protocol import Grain, WebcamError, WebcamStream

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

PANORAMA_FPS: Final = 15.0
"""Pictures per second."""

"""Columns and rows of its pictures."""

"""Horizontal field of view unless another one is asked for, deg."""

_SEED: Final = 11
_SWAY_HZ: Final = (0.7, 1.9, 3.1)  # of a hand that holds a phone
_HIGHEST_DEG: Final = 80.0


@dataclass(frozen=True, slots=True)
class _Aim:
    heading_deg: float = 0.0
    pitch_deg: float = 0.0


class PanoramaWebcam(WebcamStream):
    """Shows a panorama from its middle, as a pinhole camera there would see it.

    There is no sitter in its pictures and no parallax: its heading is exact, and its turn that of a
    camera which looks at the sitter. It tells its field of view only when asked to, so that what
    estimates it can be tried.

    * `panorama`, Path or (H, 2 H, 3) uint8: an OpenEXR or Radiance file, or sRGB.
    * `fov_deg`: horizontal field of view, deg, 20 to 150.
    * `size`: columns and rows.
    * `shake_deg`: how far a hand lets it sway, standard deviation in deg; slow and fast mixed.
    """

    def __init__(
        self,
        panorama: Path | Bytes,
        clock: Clock | None = None,
        *,
        fov_deg: float = FOV_DEG,
        tells_fov: bool = True,
        size: tuple[int, int] = SIZE,
        shake_deg: float = 0.0,
        noise: float = 0.0,
    ) -> None:
        own = clock or SystemClock()
        self._scene = _PanoramaScene(panorama, own, Lens(fov_deg, size), shake_deg, noise)
        told = fov_deg if tells_fov else None
        super().__init__(self._scene, "Panorama", told, own, still=True)

    @property
    def heading_deg(self) -> float:
        """Where it is pointed, panorama azimuth in (-180, 180], deg; without the shake."""
        return self._scene.aim.heading_deg

    @property
    def pitch_deg(self) -> float:
        """How far it is pointed up, deg."""
        return self._scene.aim.pitch_deg

    @property
    def turn_deg(self) -> float:
        """The turn whose background it shows, in (-180, 180], deg."""
        return turn_of_heading(self._scene.aim.heading_deg)

    def point(self, heading_deg: float, pitch_deg: float = 0.0) -> None:
        """Point it somewhere else; from the next picture on.

        * `heading_deg`: panorama azimuth, deg.
        * `pitch_deg`: up, deg, at most 80 either way.
        """
        pitch = min(max(pitch_deg, -_HIGHEST_DEG), _HIGHEST_DEG)
        self._scene.aim = _Aim(wrap(heading_deg), pitch)

    def set_turn(self, turn_deg: float) -> None:
        """Point it to the background of a turn.

        `turn_deg`: deg, positive clockwise.
        """
        self.point(heading_of_turn(turn_deg), self.pitch_deg)

    def unplug(self) -> None:
        """Pull the plug, as a test would."""
        self._scene.plugged = False

    def plug_in(self) -> None:
        """Put the plug back in."""
        self._scene.plugged = True


class _PanoramaScene:
    """The source of a `PanoramaWebcam`."""

    def __init__(
        self, panorama: Path | Bytes, clock: Clock, lens: Lens, shake_deg: float, noise: float
    ) -> None:
        self._given = panorama
        self._shown: Bytes | None = None
        self._clock = clock
        self._lens = lens
        self._shake_deg = shake_deg
        self._grain = Grain(lens.size, noise) if noise > 0.0 else None
        # Radians: where each of the swings begins, for both directions.
        self._phases = np.random.default_rng(_SEED).uniform(0.0, 2.0 * math.pi, (2, len(_SWAY_HZ)))
        self._next_s = 0.0
        self._last: tuple[_Aim, Bytes] | None = None
        self.aim = _Aim()
        self.plugged = True

    def open(self) -> None:
        """Read the panorama, the first time."""
        if not self.plugged:
            raise WebcamError(
                "No webcam is connected.", "Plug one in and it starts by itself.", "no-webcam"
            )
        if self._shown is None:
            self._shown = self._panorama()
        self._next_s = self._clock.now()

    def read(self) -> Bytes | None:
        """Give the next picture when it is time for it."""
        panorama = self._shown
        if not self.plugged or panorama is None:
            raise WebcamError("Webcam disconnected.", "Plug it back in to continue.", "unplugged")
        self._next_s = max(
            self._next_s + 1.0 / PANORAMA_FPS, self._clock.now() - 1.0 / PANORAMA_FPS
        )
        self._clock.sleep(self._next_s - self._clock.now())
        aim = self._swayed(self.aim)
        if self._last is None or self._last[0] != aim:
            self._last = (aim, look(panorama, aim.heading_deg, self._lens, aim.pitch_deg))
        picture = self._last[1]
        return picture if self._grain is None else self._grain.on(picture)

    def close(self) -> None:
        """Nothing is held."""

    def _panorama(self) -> Bytes:
        if isinstance(self._given, np.ndarray):
            if self._given.ndim != 3 or self._given.shape[1] != 2 * self._given.shape[0]:
                raise _no_panorama("This picture")
            return self._given
        try:
            return display_panorama(read_environment(self._given).radiance)
        except CoreError as error:
            raise WebcamError(error.message, error.hint, "bad-file") from None

    def _swayed(self, aim: _Aim) -> _Aim:
        if self._shake_deg <= 0.0:
            return aim
        now = self._clock.now()
        # Sines of equal strength: their sum has this standard deviation over time.
        strength = self._shake_deg * math.sqrt(2.0 / len(_SWAY_HZ))
        turns = np.array(_SWAY_HZ) * (2.0 * math.pi * now)
        across, up = (float(np.sin(turns + phase).sum()) * strength for phase in self._phases)
        return _Aim(aim.heading_deg + across, aim.pitch_deg + up)


def _no_panorama(what: str) -> WebcamError:
    return WebcamError(
        f"{what} is no full panorama.", "Its width is to be twice its height.", "bad-file"
    )


class SimulatedWebcam(WebcamStream):
    """Shows the sitter of the demo location, and what is behind them at the turn it is set to.

    Its camera looks at the sitter, who is in the middle of the picture and faces it: its heading is
    the turn + 180.

    `size`: columns and rows.
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

        `turn_deg`: deg, positive clockwise.
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
