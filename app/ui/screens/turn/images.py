"""The pictures of the Turn screen, each made by a job of its own; the newest wish wins."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.ui.screens.turn.pictures import (
    live_picture,
    now_portrait,
    target_portrait,
    views_of,
)
from app.ui.screens.turn.state import Pictures

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.painting.user_style import UserStyle
    from app.core.solver.place_light import PlaceLight
    from app.core.text.turns import Mode
    from app.ui.presenters.model import Head
    from app.ui.presenters.services import Services
    from app.ui.screens.light.pictures import LampPlan
    from app.ui.screens.turn.pictures import Overlay, Scene, Views

Bytes: TypeAlias = NDArray[np.uint8]
Size: TypeAlias = tuple[int, int]
Wish: TypeAlias = tuple[Any, ...]

_LIVE: Final = "turn-live"
_NOW: Final = "turn-now"


class TurnImages:
    """Makes pictures when something they depend on has changed."""

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._wishes: dict[str, Wish] = {}
        self.pictures = Pictures()
        self.views: Views | None = None

    def want_views(self, light: PlaceLight, scene: Scene) -> None:
        """Ask for goal and strip."""
        if self._new("turn-views", (light, scene)):
            self._services.runner.submit(
                "turn-views", lambda token, report: views_of(light, scene), done=self._viewed
            )

    def want_target(self, head: Head, own: UserStyle | None, name: str, size: Size) -> None:
        """Ask for the target of a style; `own` where it is one of the user's."""
        if self._new("turn-target", (head, own, name, size)):
            self._services.runner.submit(
                "turn-target",
                lambda token, report: target_portrait(head, own, name, size),
                done=lambda picture: self._put(target=picture),
            )

    def want_now(
        self,
        head: Head,
        light: PlaceLight,
        facing_deg: float,
        size: Size,
        plan: LampPlan | None = None,
    ) -> None:
        """Ask for the head as it is lit, maybe with a lamp, the face at an azimuth."""
        # While one is made no other is begun: the next call asks again.
        if not self._services.runner.running(_NOW) and self._new(
            _NOW, (head, light, facing_deg, size, plan)
        ):
            self._services.runner.submit(
                _NOW,
                lambda token, report: now_portrait(head, light, facing_deg, size, plan),
                done=lambda picture: self._put(now=picture),
            )

    def want_live(self, picture: Bytes, size: Size, mode: Mode, overlay: Overlay | None) -> None:
        """Ask for the live picture, alone or over the goal."""
        over: Wish = (None, None, 0.0)
        if overlay is not None:
            over = (overlay.goal, overlay.homography, overlay.opacity)
        if not self._services.runner.running(_LIVE) and self._new(
            _LIVE, (picture, size, mode, *over)
        ):
            self._services.runner.submit(
                _LIVE,
                lambda token, report: live_picture(picture, size, mode, overlay),
                done=lambda made: self._put_live(picture, made),
                # The next picture comes in a moment; a message for each would help nobody.
                failed=lambda error: None,
            )

    def drop_live(self) -> None:
        """Show no live picture any more."""
        self._services.runner.cancel(_LIVE)
        self._wishes.pop(_LIVE, None)
        self.pictures = replace(self.pictures, live=None)

    def _new(self, key: str, wish: Wish) -> bool:
        before = self._wishes.get(key)
        if before is not None and len(before) == len(wish) and all(map(_same, before, wish)):
            return False
        self._wishes[key] = wish
        return True

    def _viewed(self, views: Views) -> None:
        self.views = views
        self._put(goal=views.shown, strip=views.strip)

    def _put_live(self, picture: Bytes, made: Bytes) -> None:
        # Left meanwhile, or another webcam was taken.
        wish = self._wishes.get(_LIVE)
        if wish is not None and wish[0] is picture:
            self._put(live=made)

    def _put(self, **pictures: Bytes) -> None:
        self.pictures = replace(self.pictures, **pictures)
        self._changed()


def _same(one: object, other: object) -> bool:
    """Compare by value what is small, by identity what holds arrays."""
    if one is other:
        return True
    arrays = isinstance(one, np.ndarray) or type(one).__eq__ is object.__eq__
    return not arrays and one == other
