"""The pictures on the Turn screen, rendered in jobs when their inputs change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np

from app.core.base.arrays import Bytes
from app.core.guidance.who_moves import Mode
from app.core.painting.user_style import UserStyle
from app.core.portrait.head import Head
from app.core.solver.place_light import Expose, PlaceLight
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import LampPlan
from app.ui.screens.turn.goal import GoalViews, TurnScene, views_of
from app.ui.screens.turn.live.overlay import LiveOverlay, live_picture
from app.ui.screens.turn.portraits import now_portrait, target_portrait

Size: TypeAlias = tuple[int, int]
"""Size of a picture, in rows and columns of device pixels."""

T = TypeVar("T")

_LIVE: Final = "turn-live"
_NOW: Final = "turn-now"


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """The pictures, each an (h, w, 3) uint8 sRGB array, or None until it is rendered.

    A new picture is always a new array.

    Attributes:
        live, goal: Pictures for the wells, mirrored in selfie mode.
        strip: The 150° of background, mirrored in selfie mode.
        target, now: The Target and Now portraits.
    """

    live: Bytes | None = field(default=None, repr=False)
    goal: Bytes | None = field(default=None, repr=False)
    strip: Bytes | None = field(default=None, repr=False)
    target: Bytes | None = field(default=None, repr=False)
    now: Bytes | None = field(default=None, repr=False)


class TurnImages:
    """Renders the pictures.

    Attributes:
        pictures: The latest version of each picture.
        views: The goal and the strip, or None until they are rendered.
    """

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._wishes: dict[str, tuple[Any, ...]] = {}
        self.pictures = Pictures()
        self.views: GoalViews | None = None

    def want_views(self, light: PlaceLight, scene: TurnScene) -> None:
        """Render the goal and the strip."""
        self._want("turn-views", (light, scene), lambda: views_of(light, scene), self._viewed)

    def want_target(
        self, head: Head, yaw_deg: float, own: UserStyle | None, name: str, size: Size
    ) -> None:
        """Render the target portrait of a style at a yaw. Pass `own` only for a painted style."""
        self._want(
            "turn-target",
            (head, yaw_deg, own, name, size),
            # Rotating a head takes a while the first time.
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
        expose: Expose,
        plan: LampPlan | None,
    ) -> None:
        """Render the head facing an azimuth, lit by this place and by the lamp in a plan."""
        # One job at a time; the next call tries again.
        if not self._services.runner.running(_NOW):
            self._want(
                _NOW,
                (head, yaw_deg, light, facing_deg, size, expose, plan),
                lambda: now_portrait(head.turned(yaw_deg), light, facing_deg, size, expose, plan),
                lambda picture: self._put(now=picture),
            )

    def want_live(
        self, picture: Bytes, size: Size, mode: Mode, overlay: LiveOverlay | None
    ) -> None:
        """Render the live picture, either alone or over the goal."""
        if not self._services.runner.running(_LIVE):
            self._want(
                _LIVE,
                (picture, size, mode, *(overlay or (None, None, 0.0, False))),
                lambda: live_picture(picture, size, mode, overlay),
                lambda picture_over: self._put_live(picture, picture_over),
                # The next picture arrives in a moment, so no message is needed.
                lambda error: None,
            )

    def drop_live(self) -> None:
        """Remove the live picture."""
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

    def _viewed(self, views: GoalViews) -> None:
        self.views = views
        self._put(goal=views.goal_view, strip=views.strip)

    def _put_live(self, picture: Bytes, result: Bytes) -> None:
        # The result is obsolete after the screen is hidden or the webcam changes.
        wish = self._wishes.get(_LIVE)
        if wish is not None and wish[0] is picture:
            self._put(live=result)

    def _put(self, **pictures: Bytes) -> None:
        self.pictures = replace(self.pictures, **pictures)
        self._changed()


def _same(one: object, other: object) -> bool:
    """Compare arrays and their containers by identity, and everything else by value."""
    if one is other:
        return True
    arrays = isinstance(one, np.ndarray) or type(one).__eq__ is object.__eq__
    return not arrays and one == other
