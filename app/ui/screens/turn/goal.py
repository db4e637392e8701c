"""The camera's intended view at the goal, and the background around it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.guidance.who_moves import Mode
from app.core.localization.heading_conversion import Looks, heading_of_turn
from app.core.localization.views import Lens, goal_lens, goal_view, strip_view
from app.core.solver.place_light import PlaceLight

STRIP_DEG: Final = 150.0
"""Width of the background strip, in degrees."""

TARGET_WIDTH: Final = 720
"""Width, in pixels, of the goal picture with which the live picture is aligned."""


@dataclass(frozen=True, slots=True)
class TurnScene:
    """Everything, apart from the panorama, that determines the goal picture and the strip.

    Attributes:
        goal_deg: Turn at the goal, in whole degrees.
        front_deg: Panorama azimuth, in degrees, at which the photographer stands at turn 0.
        well, strip: Size of the goal picture and of the strip, in rows and columns.
    """

    goal_deg: float
    front_deg: float
    looks: Looks
    mode: Mode
    fov_deg: float
    camera_m: float
    well: tuple[int, int]
    strip: tuple[int, int]

    @property
    def azimuth_deg(self) -> float:
        """Panorama azimuth of the camera's axis at the goal, in degrees."""
        return heading_of_turn(
            self.goal_deg, looks=self.looks, mode=self.mode, front_deg=self.front_deg
        )

    @property
    def panorama_fov_deg(self) -> float:
        """Horizontal angle of the panorama that fills the camera's picture, in degrees."""
        lens = Lens(self.fov_deg, (self.well[1], self.well[0]))
        wide = goal_lens(lens, camera_m=self.camera_m, looks=self.looks, mode=self.mode)
        return wide.fov_deg


@dataclass(frozen=True, slots=True, eq=False)
class GoalViews:
    """Views of a panorama for one scene, each (h, w, 3) uint8 sRGB.

    Attributes:
        goal: The camera's intended view, at the size of the well and not mirrored.
        goal_view: The same view for display, mirrored in selfie mode.
        target: The same view for alignment, `TARGET_WIDTH` pixels wide and not mirrored.
        strip: The 150° of background centred on the goal, mirrored in the same way as `goal_view`.
    """

    scene: TurnScene
    goal: Bytes = field(repr=False)
    goal_view: Bytes = field(repr=False)
    target: Bytes = field(repr=False)
    strip: Bytes = field(repr=False)


def views_of(light: PlaceLight, scene: TurnScene) -> GoalViews:
    """Render the goal picture and the strip."""
    rows, columns = scene.well
    goal = _goal(light, scene, (columns, rows))
    target = _goal(light, scene, (TARGET_WIDTH, max(round(TARGET_WIDTH * rows / columns), 1)))
    size = (scene.strip[1], scene.strip[0])
    strip = mirrored(strip_view(light.display, scene.azimuth_deg, size, STRIP_DEG), scene.mode)
    return GoalViews(scene, goal, mirrored(goal, scene.mode), target, strip)


def _goal(light: PlaceLight, scene: TurnScene, size: tuple[int, int]) -> Bytes:
    return goal_view(
        light.display,
        scene.goal_deg,
        Lens(scene.fov_deg, size),
        camera_m=scene.camera_m,
        looks=scene.looks,
        mode=scene.mode,
        front_deg=scene.front_deg,
    )


def mirrored(picture: Bytes, mode: Mode) -> Bytes:
    """Mirror a picture in selfie mode, as a wall mirror would."""
    return np.asarray(cv2.flip(picture, 1), np.uint8) if mode is Mode.SELFIE else picture
