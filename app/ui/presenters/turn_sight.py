"""Where the live camera points, and how its picture lies on the goal: work for other threads."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.errors import CoreError
from app.core.turning.align import Alignment, align
from app.core.turning.heading import UNSURE, Heading, HeadingIndex, build_index, find_heading

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.light_here import LightHere
    from app.devices.webcam import WebcamFrame
    from app.ui.presenters.services import Services

__all__ = ["Aligner", "Sight", "locate"]

Bytes: TypeAlias = NDArray[np.uint8]

_INDEX: Final = "turn-index"
_HEADING: Final = "turn-heading"
_ALIGN: Final = "turn-align"
_LEARNING: Final = "Learning the background"


def locate(picture: Bytes, index: HeadingIndex, fov_deg: float, near_deg: float | None) -> Heading:
    """Find where a picture points: near the last heading first, then everywhere.

    Parameters
    ----------
    picture : (H, W, 3) uint8
        sRGB, not mirrored.
    index : HeadingIndex
        Of the panorama.
    fov_deg : float
        Horizontal, deg.
    near_deg : float or None
        The last heading, deg; None when there is none.

    Returns
    -------
    Heading
    """
    if near_deg is not None:
        found = find_heading(picture, index, fov_deg, near_deg=near_deg)
        if found.status == "found":
            return found
    return find_heading(picture, index, fov_deg)


class Sight:
    """Locates the newest picture, one at a time; pictures that come meanwhile are passed over.

    Parameters
    ----------
    services : Services
        The window's.
    changed : callable
        Called when something is known that was not.

    Attributes
    ----------
    heading : Heading or None
        Of the last picture that was looked at; None before the first.
    error : CoreError or None
        Why no heading will be found in this panorama.
    """

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._light: LightHere | None = None
        self._index: HeadingIndex | None = None
        self._near_deg: float | None = None
        self._seen: Bytes | None = None
        self._on = False
        self.heading: Heading | None = None
        self.error: CoreError | None = None

    @property
    def learning(self) -> bool:
        """Whether the panorama's points are not yet known."""
        return self._light is not None and self._index is None and self.error is None

    def learn(self, light: LightHere) -> None:
        """Get to know a panorama; once for each.

        Parameters
        ----------
        light : LightHere
            Of the place.
        """
        if light is self._light:
            return
        self._light, self._index, self.error = light, None, None
        self.forget()
        self._services.runner.submit(
            _INDEX,
            lambda token, report: build_index(light.display, token, report),
            title=_LEARNING,
            done=lambda index: self._learnt(light, index),
            failed=lambda error: self._not_learnt(light, error),
            cancelled=lambda: self._given_up(light),
        )

    def start(self) -> None:
        """Look at pictures from now on."""
        self._on = True

    def stop(self) -> None:
        """Look at none any more; what was learnt is kept."""
        self._on = False
        self._services.runner.cancel(_HEADING)
        self.forget()

    def forget(self) -> None:
        """Know nothing of where the camera points."""
        self.heading, self._near_deg, self._seen = None, None, None

    def look(self, frame: WebcamFrame, fov_deg: float) -> None:
        """Locate a picture, unless one is being located.

        Parameters
        ----------
        frame : WebcamFrame
            The newest.
        fov_deg : float
            Horizontal field of view, deg.
        """
        index, picture = self._index, frame.picture
        # A camera that shows the very same picture again still points the same way.
        if not self._on or index is None or picture is self._seen:
            return
        if self._services.runner.running(_HEADING):
            return
        self._seen, near = picture, self._near_deg
        self._services.runner.submit(
            _HEADING,
            lambda token, report: locate(picture, index, fov_deg, near),
            done=lambda heading: self._located(index, heading),
            # One picture that cannot be worked on is no more than one without a heading.
            failed=lambda error: self._located(index, UNSURE),
        )

    def _located(self, index: HeadingIndex, heading: Heading) -> None:
        if self._on and index is self._index:
            self.heading, self._near_deg = heading, heading.heading_deg
            self._changed()

    def _learnt(self, light: LightHere, index: HeadingIndex) -> None:
        if light is self._light:
            self._index = index
            self._changed()

    def _not_learnt(self, light: LightHere, error: Exception) -> None:
        if light is not self._light:
            return
        if isinstance(error, CoreError):
            self.error = error
        else:
            self.error = CoreError("The background cannot be learnt.", "Turn by the number.")
            self._services.notify.tell_error(error)
        self._changed()

    def _given_up(self, light: LightHere) -> None:
        """Somebody pressed Cancel: it is tried again when the screen is next entered."""
        if light is self._light:
            self.error = CoreError(
                "The background was not learnt.", "Leave this step and come back to try again."
            )
            self._light = None
            self._changed()


@dataclass(slots=True, eq=False)
class Aligner:
    """Finds, again and again, how the newest picture lies on the goal.

    Attributes
    ----------
    alignment : Alignment or None
        Of the last picture that was looked at.
    """

    services: Services
    changed: Callable[[], None]
    on: bool = False
    alignment: Alignment | None = None
    _seen: tuple[Bytes, Bytes] | None = field(default=None, repr=False)

    def switch(self, on: bool) -> None:
        """Begin or end."""
        self.on, self.alignment, self._seen = on, None, None
        if not on:
            self.services.runner.cancel(_ALIGN)

    def look(self, picture: Bytes, target: Bytes, fovs_deg: tuple[float, float]) -> None:
        """Lay a picture on the goal, unless one is being laid.

        Parameters
        ----------
        picture, target : (H, W, 3) uint8
            sRGB, not mirrored; what the camera sees, and what it should see.
        fovs_deg : tuple of float
            Of the target in the panorama, and of the camera; deg.
        """
        same = self._seen is not None and self._seen[0] is picture and self._seen[1] is target
        if not self.on or same or self.services.runner.running(_ALIGN):
            return
        self._seen = (picture, target)
        self.services.runner.submit(
            _ALIGN,
            lambda token, report: align(
                target, picture, fov_deg=fovs_deg[0], view_fov_deg=fovs_deg[1]
            ),
            done=self._aligned,
            failed=lambda error: self._aligned(None),
        )

    def _aligned(self, alignment: Alignment | None) -> None:
        if self.on:
            self.alignment = alignment
            self.changed()
