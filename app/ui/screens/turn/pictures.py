"""Pictures of the Turn screen: goal and strip, the live picture for its well, portraits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple, TypeAlias, TypeVar

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float64
from app.core.guidance.mode import Mode
from app.core.localization.align import laid_over
from app.core.localization.heading_conversion import Looks, heading_of_turn
from app.core.localization.views import Lens, goal_lens, goal_view, strip_view
from app.core.painting.user_style import UserStyle
from app.core.portrait.head import Head
from app.core.solver.place_light import Facing, PlaceLight, picture_at
from app.ui.presenters.model import LampPlan
from app.ui.presenters.services import Services
from app.ui.screens.turn.state import Pictures

Size: TypeAlias = tuple[int, int]
T = TypeVar("T")

_LIVE: Final = "turn-live"
_NOW: Final = "turn-now"


class TurnImages:
    """Makes pictures when something they depend on has changed."""

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._wishes: dict[str, tuple[Any, ...]] = {}
        self.pictures = Pictures()
        self.views: Views | None = None

    def want_views(self, light: PlaceLight, scene: TurnScene) -> None:
        """Ask for goal and strip."""
        self._want("turn-views", (light, scene), lambda: views_of(light, scene), self._viewed)

    def want_target(
        self, head: Head, yaw_deg: float, own: UserStyle | None, name: str, size: Size
    ) -> None:
        """Ask for the target of a style at a yaw; `own` where it is one of the user's."""
        self._want(
            "turn-target",
            (head, yaw_deg, own, name, size),
            # To turn a head takes a while the first time: not in the thread of the window.
            lambda: target_portrait(head.turned(yaw_deg), own, name, size),
            lambda picture: self._put(target=picture),
        )

    def want_now(
        self,
        head: Head,
        yaw_deg: float,
        light: PlaceLight,
        facing_deg: float,
        size: Size,
        plan: LampPlan | None,
    ) -> None:
        """Ask for the head at a yaw as it is lit, maybe with a lamp, the nose at an azimuth."""
        # While one is made no other is begun: the next call asks again.
        if not self._services.runner.running(_NOW):
            self._want(
                _NOW,
                (head, yaw_deg, light, facing_deg, size, plan),
                lambda: now_portrait(head.turned(yaw_deg), light, facing_deg, size, plan),
                lambda picture: self._put(now=picture),
            )

    def want_live(
        self, picture: Bytes, size: Size, mode: Mode, overlay: LiveOverlay | None
    ) -> None:
        """Ask for the live picture, alone or over the goal."""
        if not self._services.runner.running(_LIVE):
            self._want(
                _LIVE,
                (picture, size, mode, *(overlay or (None, None, 0.0, False))),
                lambda: live_picture(picture, size, mode, overlay),
                lambda picture_over: self._put_live(picture, picture_over),
                # The next picture comes in a moment; a message for each would not help.
                lambda error: None,
            )

    def drop_live(self) -> None:
        """Show no live picture any more."""
        self._services.runner.cancel(_LIVE)
        self._wishes.pop(_LIVE, None)
        self.pictures = replace(self.pictures, live=None)

    def _want(
        self,
        key: str,
        wish: tuple[Any, ...],
        make: Callable[[], T],
        done: Callable[[T], None],
        failed: Callable[[Exception], None] | None = None,
    ) -> None:
        before = self._wishes.get(key)
        if before is None or len(before) != len(wish) or not all(map(_same, before, wish)):
            self._wishes[key] = wish
            submit = self._services.runner.submit
            submit(key, lambda token, report: make(), done=done, failed=failed)

    def _viewed(self, views: Views) -> None:
        self.views = views
        self._put(goal=views.goal_view, strip=views.strip)

    def _put_live(self, picture: Bytes, result: Bytes) -> None:
        # Left meanwhile, or another webcam was taken.
        wish = self._wishes.get(_LIVE)
        if wish is not None and wish[0] is picture:
            self._put(live=result)

    def _put(self, **pictures: Bytes) -> None:
        self.pictures = replace(self.pictures, **pictures)
        self._changed()


def _same(one: object, other: object) -> bool:
    """Compare by value what is small, by identity what holds arrays."""
    if one is other:
        return True
    arrays = isinstance(one, np.ndarray) or type(one).__eq__ is object.__eq__
    return not arrays and one == other


STRIP_DEG = 150.0
"""From edge to edge of the strip."""

TARGET_WIDTH = 720
"""Columns of the goal that the live picture is aligned with."""


@dataclass(frozen=True, slots=True)
class TurnScene:
    """All that goal and strip depend on, besides the panorama.

    Attributes:
        goal_deg: Whole degrees of turn.
        front_deg: Panorama azimuth at which the photographer stands at turn 0, deg.
        well, strip: Rows and columns of the pictures wanted.
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
    def panorama_fov_deg(self) -> float:
        """How much of the panorama fills the camera's picture, deg."""
        lens = Lens(self.fov_deg, (self.well[1], self.well[0]))
        wide = goal_lens(lens, camera_m=self.camera_m, looks=self.looks, mode=self.mode)
        return wide.fov_deg


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """What is made of a panorama for a scene.

    Attributes:
        goal: (h, w, 3) uint8. What the camera should see, of the well's size; not mirrored.
        goal_view: (h, w, 3) uint8. The same as it is shown: mirrored in selfie mode.
        target: (h, w, 3) uint8. The same again, for alignment.
        strip: (h, w, 3) uint8. 150° of background, the goal in the middle; mirrored as `goal_view`.
    """

    scene: TurnScene
    goal: Bytes = field(repr=False)
    goal_view: Bytes = field(repr=False)
    target: Bytes = field(repr=False)
    strip: Bytes = field(repr=False)


def views_of(light: PlaceLight, scene: TurnScene) -> Views:
    """Make goal and strip."""
    rows, columns = scene.well
    goal = _goal(light, scene, (columns, rows))
    target = _goal(light, scene, (TARGET_WIDTH, max(round(TARGET_WIDTH * rows / columns), 1)))
    azimuth = heading_of_turn(
        scene.goal_deg, looks=scene.looks, mode=scene.mode, front_deg=scene.front_deg
    )
    size = (scene.strip[1], scene.strip[0])
    strip = mirrored(strip_view(light.display, azimuth, size, STRIP_DEG), scene.mode)
    return Views(scene, goal, mirrored(goal, scene.mode), target, strip)


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
    """Mirror a picture in selfie mode, as one knows oneself; words are never mirrored."""
    return np.asarray(cv2.flip(picture, 1), np.uint8) if mode is Mode.SELFIE else picture


class LiveOverlay(NamedTuple):
    """What the live picture is laid over.

    Attributes:
        goal: (h, w, 3) uint8. Of the well's size, not mirrored.
        homography: (3, 3) float64 or None. From the live picture's pixels to those of a target of
            `TARGET_WIDTH` columns.
        opacity: Of the live picture, 0 to 1; where they are split, how much of the width it has.
        split: Live is on the left and the goal on the right, instead of one over the other.
    """

    goal: Bytes
    homography: Float64 | None
    opacity: float
    split: bool = False


def live_picture(
    picture: Bytes, size: tuple[int, int], mode: Mode, overlay: LiveOverlay | None = None
) -> Bytes:
    """Make the live picture for its well: its whole width, cut at top and bottom if it is higher.

    Args:
        picture: (H, W, 3) uint8. sRGB, as the camera sees it.
        size: Rows and columns of the well.

    Returns:
        (rows, columns, 3) uint8.
    """
    rows, columns = size
    high = max(round(picture.shape[0] * columns / picture.shape[1]), 1)
    method = cv2.INTER_AREA if columns < picture.shape[1] else cv2.INTER_LINEAR
    small = np.asarray(cv2.resize(picture, (columns, high), interpolation=method), np.uint8)
    scale = columns / picture.shape[1]
    if overlay is None:
        return mirrored(_fitted(small, rows), mode)
    if not overlay.split:
        return mirrored(_over(small, overlay, scale), mode)
    result = mirrored(_over(small, overlay._replace(opacity=1.0), scale), mode).copy()
    cut = round(overlay.opacity * result.shape[1])
    result[:, cut:] = mirrored(overlay.goal, mode)[:, cut:]
    result[:, max(cut - 1, 0) : cut + 1] = 255
    return result


def _over(small: Bytes, overlay: LiveOverlay, scale: float) -> Bytes:
    columns = overlay.goal.shape[1]
    if overlay.homography is None:
        return laid_over(overlay.goal, _fitted(small, overlay.goal.shape[0]), None, overlay.opacity)
    share = columns / TARGET_WIDTH
    to_well = np.diag([share, share, 1.0]) @ overlay.homography @ np.diag([1 / scale, 1 / scale, 1])
    return laid_over(overlay.goal, small, np.asarray(to_well, np.float64), overlay.opacity)


def _fitted(picture: Bytes, rows: int) -> Bytes:
    """Cut a picture to a height about its middle; a lower one gets its edges continued."""
    high = picture.shape[0]
    if high >= rows:
        top = (high - rows) // 2
        return np.ascontiguousarray(picture[top : top + rows])
    above = (rows - high) // 2
    return np.pad(picture, ((above, rows - high - above), (0, 0), (0, 0)), mode="edge")


def target_portrait(head: Head, own: UserStyle | None, name: str, size: Size) -> Bytes:
    """Show the target of a style: (rows, columns, 3) uint8, sRGB on the well's grey."""
    if own is not None:
        return head.portrait(head.target_of(own), size)
    style = head.pack.styles[head.pack.index(name)]
    return head.portrait(head.pack.target(name), size, style)


def now_portrait(
    head: Head,
    light: PlaceLight,
    facing_deg: float,
    size: tuple[int, int],
    plan: LampPlan | None = None,
) -> Bytes:
    """Show the head as it is lit here at a turn.

    (rows, columns, 3) uint8, sRGB; the place or the well's grey lies behind. The sitter faces an
    azimuth in the panorama.
    """
    if plan is not None:
        return plan.portrait(facing_deg, size)
    picture = picture_at(head.transport, light, facing_deg)
    return head.portrait(picture, size, Facing(light, facing_deg))
