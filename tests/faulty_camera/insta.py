"""An Insta360 X3: it requires a header and stores its pictures as two circles."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import FloatImage
from app.devices.clock import Clock
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.cameras import CameraModel, Personality
from app.devices.simulated.exchange import JsonValue, Reply, Request, refusal
from app.devices.simulated.exif import Tags
from app.devices.simulated.optics import FrameView, view_of
from app.devices.simulated.options import OptionStore
from app.devices.simulated.scene import Scene, Take
from tests.faulty_camera.models import personality_named
from tests.faulty_camera.strict_options import StrictOptions

_NAME: Final = "insta360"
_HEADER: Final = "x-xsrf-protected"
_ALPHA, _BETA = 0.6692, 0.7515
_FIELD_DEG = 198.0
_FILL = 0.98  # of the height: the circles' diameter
_FALLOFF = 0.15  # of the light, at the rim
_STRAY = 0.001


def circles(environment: NDArray[np.float32], rows: int) -> NDArray[np.float32]:
    """Look at a panorama through two fisheyes of an Insta360 X3, as it stores them.

    The lens curve is the enhanced unified model that a user has calibrated
    (hilti-trimble-slam-challenge-2026, issue 29), r = f sin t / (a sqrt(b sin^2 t + cos^2 t) + (1 -
    a) cos t), up to 99 degrees from the axis.
    The back lens's circle is on the left and turned counter-clockwise by 90 degrees, the front
    lens's on the right and turned clockwise.

    `environment`, (H, 2 H, 3) float32: linear light. Returns (rows, 2 * rows, 3) float32: with
    stray light around the circles.
    """
    height, width = environment.shape[:2]
    down, right = np.mgrid[:rows, :rows].astype(np.float32) - np.float32((rows - 1) / 2)
    radius = np.hypot(right, down) / np.float32(_FILL * rows / 2)
    angles = np.radians(np.linspace(0.0, 110.0, 2201))
    sine, cosine = np.sin(angles), np.cos(angles)
    radii = sine / (_ALPHA * np.sqrt(_BETA * sine**2 + cosine**2) + (1.0 - _ALPHA) * cosine)
    rim = np.interp(np.radians(_FIELD_DEG / 2), angles, radii)
    angle = np.interp(radius * rim, radii, angles)
    level = np.sin(angle) / np.maximum(np.hypot(right, down), np.float32(1e-6))
    gain = np.where(radius <= 1.0, 1.0 - np.float32(_FALLOFF) * radius**3, 0.0)[..., None]
    wide = cv2.copyMakeBorder(environment, 1, 1, 1, 1, cv2.BORDER_WRAP)
    wide[0], wide[-1] = wide[1], wide[-2]
    halves = []
    for facing in (-1.0, 1.0):
        # What is up in the scene lies to the right in front, to the left in the back.
        up, side = facing * right * level, facing * down * level
        azimuth = np.arctan2(facing * side, facing * np.cos(angle))
        elevation = np.arcsin(np.clip(up, -1.0, 1.0))
        x = (azimuth / (2.0 * np.pi) + 0.5) * width + 0.5
        y = (0.5 - elevation / np.pi) * height + 0.5
        maps = x.astype(np.float32), y.astype(np.float32)
        halves.append(cv2.remap(wide, *maps, cv2.INTER_LINEAR) * gain)
    around = np.where(radius <= 1.0, 0.0, _STRAY * float(environment.mean()))[..., None]
    return np.concatenate([half + around for half in halves], axis=1).astype(np.float32)


class InstaScene(Scene):
    """A place as an Insta360 stores it."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene.environment, scene.shot, seed=scene.seed)
        self._circles: dict[int, FloatImage] = {}

    def view(self, shape: tuple[int, int]) -> FrameView:
        rows = shape[0]
        if rows not in self._circles:
            self._circles[rows] = circles(self.environment, rows)
        return view_of(self._circles[rows], shape)

    def tags(self, camera: CameraModel, take: Take) -> Tags:
        return replace(super().tags(camera, take), panorama=False, pose=None)


@cache
def _insta_scene(scene: Scene) -> InstaScene:
    """Share the frames of a place among cameras."""
    return InstaScene(scene)


class InstaOptions(StrictOptions):
    """It can be told to stitch, and stitches nothing all the same."""

    def reset(self) -> None:
        super().reset()
        del self.values["exposureBracket"]
        self.values["photoStitching"] = "ondevice"

    def support(self, name: str, program: int | None = None) -> tuple[JsonValue, ...]:
        return ("none", "ondevice") if name == "photoStitching" else super().support(name, program)


class InstaCamera(SimulatedCamera):
    """A camera with strict options; an Insta360 if the model is one."""

    def __init__(
        self, scene: Scene, personality: Personality | str, clock: Clock, **options: Any
    ) -> None:
        person = personality_named(personality) if isinstance(personality, str) else personality
        self._is_insta = person.name == _NAME
        super().__init__(_insta_scene(scene) if self._is_insta else scene, person, clock, **options)

    def make_store(self, person: Personality) -> OptionStore:
        return InstaOptions(person) if self._is_insta else StrictOptions(person)

    def refuse(self, request: Request) -> Reply | None:
        if self._is_insta and _HEADER not in request.headers:
            return refusal("", "unexpected", f"{_HEADER} is missing.", status=403)
        return super().refuse(request)

    def status(self) -> dict[str, JsonValue]:
        return super().status() | ({"_cardState": "pass"} if self._is_insta else {})
