"""A webcam inside any panorama: perspective views to wherever it is pointed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.hdr.display import display_panorama
from app.core.localization.heading_conversion import heading_of_turn, turn_of_heading
from app.core.localization.views import Lens, look
from app.core.solver.environment import read_environment
from app.devices.clock import SystemClock
from app.devices.webcam.pictures import Grain
from app.devices.webcam.protocol import WebcamError
from app.devices.webcam.stream import WebcamStream

if TYPE_CHECKING:
    from pathlib import Path

    from app.devices.clock import Clock
    from app.devices.webcam.protocol import Bytes

FPS: Final = 15.0
"""Pictures per second."""

SIZE: Final = (1280, 720)
"""Columns and rows of its pictures."""

FOV_DEG: Final = 60.0
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

    Parameters
    ----------
    panorama : Path or (H, 2 H, 3) uint8
        An OpenEXR or Radiance file, or sRGB.
    fov_deg : float, optional
        Horizontal field of view, deg, 20 to 150.
    size : tuple[int, int], optional
        Columns and rows.
    shake_deg : float, optional
        How far a hand lets it sway, standard deviation in deg; slow and fast mixed.
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
        self._scene = _Scene(panorama, own, Lens(fov_deg, size), shake_deg, noise)
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

        Parameters
        ----------
        heading_deg : float
            Panorama azimuth, deg.
        pitch_deg : float, optional
            Up, deg, at most 80 either way.
        """
        pitch = min(max(pitch_deg, -_HIGHEST_DEG), _HIGHEST_DEG)
        self._scene.aim = _Aim(wrap(heading_deg), pitch)

    def set_turn(self, turn_deg: float) -> None:
        """Point it to the background of a turn.

        Parameters
        ----------
        turn_deg : float
            Deg, positive clockwise.
        """
        self.point(heading_of_turn(turn_deg), self.pitch_deg)

    def unplug(self) -> None:
        """Pull the plug, as a test would."""
        self._scene.plugged = False

    def plug_in(self) -> None:
        """Put the plug back in."""
        self._scene.plugged = True


class _Scene:
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
        self._next_s = max(self._next_s + 1.0 / FPS, self._clock.now() - 1.0 / FPS)
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
