"""The scene of a simulated camera, and automatic exposure."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.measure.read.frame import Exposure
from app.devices.simulated.cameras import CameraModel, Personality
from app.devices.simulated.exchange import JsonValue
from app.devices.simulated.exif import Tags, with_segments
from app.devices.simulated.exposure_maker import (
    PLAIN,
    FrameSight,
    ShotOptions,
    expose,
    jpeg,
    segments_of,
    srgb_tables,
    tags_of,
)
from app.devices.simulated.optics import meter, view_of

_KEPT_BYTES: Final = 384_000_000
_FLOATING: Final = 0.03
_THUMB_QUALITY: Final = 80
_HAND_S: Final = 1.0 / 30.0
_LONGEST_AUTO_S: Final = 8.0
_CLOSING_S: Final = 1.0 / 400.0


@dataclass(frozen=True, slots=True)
class Take:
    """A frame to be exposed.

    Attributes:
        shape: Rows and columns.
        program: EXIF exposure program.
    """

    exposure: Exposure
    shape: tuple[int, int]
    number: int
    date_time: str
    program: int = 1
    lens_gain: tuple[float, float] = (1.0, 1.0)
    fixed_balance: bool = True
    hdr: bool = False


class Scene:
    """A scene with a cache of rendered frames, which tests of many cameras can share.

    Args:
        environment: (H, 2 H, 3) float32. Linear Rec. 709 light, `scale` cd/m2 per unit.
        shot: Settings common to all frames, such as the scale.
    """

    def __init__(
        self, environment: FloatImage, shot: ShotOptions = PLAIN, *, seed: int = 0
    ) -> None:
        self.environment = np.asarray(environment, dtype=np.float32)
        self.shot = shot
        self.seed = seed
        self._lock = threading.Lock()
        self._frames: OrderedDict[tuple[str, Take], bytes] = OrderedDict()
        self._cache_bytes = 0
        self._metered: dict[str, Exposure] = {}

    @property
    def scale(self) -> float:
        """Luminance of one unit of the environment in cd/m2."""
        return self.shot.scale

    def metered(self, camera: CameraModel) -> Exposure:
        """Return the metered exposure at the camera's lowest ISO and widest aperture."""
        with self._lock:
            exposure = self._metered.get(camera.name)
        if exposure is None:
            exposure = meter(self.environment, camera, scale=self.scale)
            with self._lock:
                self._metered[camera.name] = exposure
        return exposure

    def brighter_front(self) -> bool:
        """Return whether the front lens (the middle half of the columns) sees more light."""
        width = self.environment.shape[1]
        middle = self.environment[:, width // 4 : width - width // 4].mean()
        return bool(middle >= self.environment.mean())

    def frame(self, camera: CameraModel, take: Take) -> bytes:
        """Render a frame and return it as a JPEG file with all its metadata."""
        shot = self._shot_of(take)
        key = (camera.name, replace(take, date_time="", program=1, hdr=False))
        data = self._cached(key)
        if data is None:
            seed = int(np.random.SeedSequence([self.seed, take.number]).generate_state(1)[0])
            picture = self._expose(camera, take, shot, seed)
            data = self._keep(key, jpeg(picture))
        return with_segments(data, segments_of(self.tags(camera, take)))

    def tags(self, camera: CameraModel, take: Take) -> Tags:
        """Return the metadata of a frame's file."""
        tags = tags_of(camera, take.exposure, self._shot_of(take), take.shape)
        return replace(tags, program=take.program, hdr_rendering=take.hdr)

    def thumbnail(self, camera: CameraModel, take: Take, shape: tuple[int, int]) -> bytes:
        """Return a frame's thumbnail with the given `shape` (rows, columns) and no metadata."""
        take = replace(take, shape=shape)
        shot = replace(self._shot_of(take), noise=False)
        return jpeg(self._expose(camera, take, shot, 0), _THUMB_QUALITY)

    def view(self, shape: tuple[int, int]) -> FrameSight:
        """Return a view of the scene for a frame with the given `shape` (rows, columns)."""
        return view_of(self.environment, shape)

    def _expose(self, camera: CameraModel, take: Take, shot: ShotOptions, seed: int) -> Bytes:
        view = self.view(take.shape)
        return expose(view, camera, take.exposure, shot, srgb_tables(), seed=seed)

    def _shot_of(self, take: Take) -> ShotOptions:
        balance = (1.0, 1.0, 1.0)
        if not take.fixed_balance:
            offsets = np.random.default_rng([self.seed, take.number]).uniform(-1.0, 1.0, 2)
            balance = (
                1.0 + _FLOATING * float(offsets[0]),
                1.0,
                1.0 + _FLOATING * float(offsets[1]),
            )
        return replace(
            self.shot,
            shape=take.shape,
            lens_gain=take.lens_gain,
            white_balance=balance,
            date_time=take.date_time,
        )

    def _cached(self, key: tuple[str, Take]) -> bytes | None:
        with self._lock:
            if key in self._frames:
                self._frames.move_to_end(key)
            return self._frames.get(key)

    def _keep(self, key: tuple[str, Take], data: bytes) -> bytes:
        with self._lock:
            if key not in self._frames:
                self._frames[key] = data
                self._cache_bytes += len(data)
            while self._cache_bytes > _KEPT_BYTES and len(self._frames) > 1:
                self._cache_bytes -= len(self._frames.popitem(last=False)[1])
        return data


def automatic(
    scene: Scene, person: Personality, settings: Mapping[str, JsonValue]
) -> tuple[Exposure, tuple[float, float]]:
    """Choose the exposure according to the camera's program and the user's settings.

    Args:
        settings: The value of exposureProgram, and the values of iso, shutterSpeed, aperture,
            exposureCompensation and isoAutoHighLimit if the program uses them.

    Returns:
        The exposure that the camera states, and the gain of each lens relative to that exposure.
    """
    program = number_in(settings, "exposureProgram", 2.0)
    aperture = number_in(settings, "aperture", 0.0) or person.apertures[0]
    iso = number_in(settings, "iso", 0.0)
    time = number_in(settings, "shutterSpeed", 0.0)
    if program == 1.0:
        return Exposure(time or 0.004, iso or person.isos[0], aperture), (1.0, 1.0)
    factor = scene.metered(person.camera).factor
    factor *= 2.0 ** number_in(settings, "exposureCompensation", 0.0)
    if program == 4.0 and time:
        light = factor * 100.0 * aperture**2 / time
        return Exposure(time, nearest(light, person.isos), aperture), (1.0, 1.0)
    if program == 2.0:
        aperture = _auto_aperture(person, factor)
    if program == 9.0 and iso:
        time = factor * 100.0 * aperture**2 / iso
        return Exposure(_auto_time(person, time), iso, aperture), (1.0, 1.0)
    limit = number_in(settings, "isoAutoHighLimit", 0.0) or max(person.isos)
    iso = _auto_iso(person, factor * 100.0 * aperture**2, limit)
    time = _auto_time(person, factor * 100.0 * aperture**2 / iso)
    return Exposure(time, iso, aperture), _lens_gains(scene, person, iso)


def _auto_aperture(person: Personality, factor: float) -> float:
    """Return the aperture, stopped down in bright scenes if the camera has several."""
    base = person.isos[0] / 100.0
    for aperture in person.apertures:
        if factor * aperture**2 / base >= _CLOSING_S:
            return aperture
    return person.apertures[-1]


def _auto_iso(person: Personality, light: float, limit: float) -> float:
    for iso in person.isos:
        if light / iso <= _HAND_S or iso >= limit:
            return iso
    return person.isos[-1]


def _auto_time(person: Personality, time: float) -> float:
    """Round an exposure time to the camera's list, or to a round fraction of a second."""
    times = [each for each in person.shutters if each <= _LONGEST_AUTO_S]
    time = min(max(time, times[0]), times[-1])
    if person.snaps:
        return nearest(time, times)
    if time >= 0.4:
        return round(time, 1)
    below = 1.0 / time
    step = 10.0 ** (math.floor(math.log10(below)) - 1)
    return min(max(1.0 / (round(below / step) * step), times[0]), times[-1])


def _lens_gains(scene: Scene, person: Personality, iso: float) -> tuple[float, float]:
    """Return the gains of both lenses. The darker side gets a higher ISO, in thirds of a stop."""
    steps = round(3.0 * person.lens_stops)
    at = person.isos.index(iso)
    high = person.isos[min(at + steps - steps // 2, len(person.isos) - 1)] / iso
    low = person.isos[max(at - steps // 2, 0)] / iso
    return (low, high) if scene.brighter_front() else (high, low)


def nearest(value: float, among: Sequence[float]) -> float:
    """Return the value in `among` that is nearest to `value`, measured in stops."""
    return min(among, key=lambda each: abs(math.log(each / value)))


def number_in(settings: Mapping[str, JsonValue], name: str, otherwise: float) -> float:
    """Return a number from untrusted settings, or `otherwise` if the entry is not a number."""
    value = settings.get(name, otherwise)
    return float(value) if isinstance(value, int | float) else otherwise
