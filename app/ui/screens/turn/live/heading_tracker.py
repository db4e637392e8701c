"""Tracks the live camera's heading.

One job at a time locates the newest picture, and pictures that arrive in the meantime are skipped.
The `Track` is passed to the job and returned with its result, so the threads share nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.localization.features import HeadingIndex, keep_index
from app.core.localization.heading import UNSURE, find_heading
from app.core.localization.live.tracking import LOST, Seeing, Track, missed, track
from app.core.localization.sitter import find_sitter
from app.core.solver.place_light import PlaceLight
from app.core.text import tr
from app.ui.presenters.services import Services

if TYPE_CHECKING:
    from app.devices.webcam import WebcamFrame


_INDEX: Final = "turn-index"
_KEEP: Final = "turn-index-keep"
_HEADING: Final = "turn-heading"
_LEARNING: Final = tr("Learning the background")


class HeadingTracker:
    """Locates the newest picture in the panorama.

    Attributes:
        track: Result for the last picture, or None before the first one.
        index: Feature points of the panorama, or None until the index is built.
        error: The reason why there is no index.
    """

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._light: PlaceLight | None = None
        self._folder: Path | None = None
        self._frame: Bytes | None = None
        self._on = False
        self._round = 0
        self.track: Track | None = None
        self.index: HeadingIndex | None = None
        self.error: CoreError | None = None

    @property
    def learning(self) -> bool:
        """Whether the index is being built."""
        return self._light is not None and self.index is None and self.error is None

    def learn(self, light: PlaceLight, folder: Path | None = None) -> None:
        """Load the index of a panorama, or build it if the place has no saved index.

        Args:
            folder: Folder of the place, or None if the place has not been saved.
        """
        before, self._folder = self._folder, folder
        if light is self._light:
            if folder != before:
                self._keep()
            return
        self._light, self.error = light, None
        self.forget()
        backgrounds = self._services.backgrounds
        self.index = backgrounds.at_hand(light)
        if self.index is not None:
            self._services.runner.cancel(_INDEX)
            self._keep()
            self._changed()
            return
        self._services.runner.submit(
            _INDEX,
            lambda token, report: backgrounds.find(light, folder, token, report),
            title=_LEARNING,
            done=lambda index: self._learnt(light, index),
            failed=lambda error: self._not_learnt(light, error),
            cancelled=lambda: self._cancelled(light),
        )

    def start(self) -> None:
        """Start locating pictures."""
        self._on = True

    def stop(self) -> None:
        """Stop locating pictures but keep the index."""
        self._on = False
        self._services.runner.cancel(_HEADING)
        self.forget()

    def forget(self) -> None:
        """Discard the track."""
        self.track, self._frame = None, None
        self._round += 1  # marks a running job as obsolete

    def look(
        self,
        frame: WebcamFrame,
        fov_deg: float | None,
        *,
        sees_sitter: bool = True,
        asked_deg: float | None = None,
    ) -> None:
        """Locate a picture, unless one is already being located.

        Args:
            fov_deg: Horizontal field of view in degrees, or None to estimate it.
            sees_sitter: Whether the person in the picture is the sitter.
            asked_deg: Remaining turn to the light, in degrees, or None if no turn is needed.
        """
        index, picture = self.index, frame.picture
        if not self._on or index is None or not self._new(picture):
            return
        if self._services.runner.running(_HEADING):
            return
        self._frame, state, this = picture, self.track or LOST, self._round
        now_s = self._services.clock.now()
        self._services.runner.submit(
            _HEADING,
            lambda token, report: track(
                picture,
                index,
                fov_deg,
                state,
                now_s,
                sees_sitter=sees_sitter,
                asked_deg=asked_deg,
                seeing=Seeing(find_heading, find_sitter),
            ),
            done=lambda result: self._located(this, result),
            # A picture that causes an error counts as a picture without a heading.
            failed=lambda error: self._located(this, replace(missed(state, now_s), raw=UNSURE)),
        )

    def _new(self, picture: Bytes) -> bool:
        """Return whether to locate a picture, skipping repeats unless the heading is pending."""
        return picture is not self._frame or (self.track is not None and self.track.pending)

    def _located(self, this: int, track: Track) -> None:
        if self._on and this == self._round:
            self.track = track
            self._changed()

    def _learnt(self, light: PlaceLight, index: HeadingIndex) -> None:
        if light is self._light:
            self.index = index
            self._keep()
            self._changed()

    def _keep(self) -> None:
        light, folder, index = self._light, self._folder, self.index
        if light is not None and folder is not None and index is not None:
            self._services.runner.submit(
                _KEEP, lambda token, report: keep_index(folder, light.display, index)
            )

    def _not_learnt(self, light: PlaceLight, error: Exception) -> None:
        if light is not self._light:
            return
        if isinstance(error, CoreError):
            self.error = error
        else:
            self.error = CoreError(
                tr("The background cannot be learnt."), tr("Turn by the number shown.")
            )
            self._services.notify.tell_error(error)
        self._changed()

    def _cancelled(self, light: PlaceLight) -> None:
        """Report that the user cancelled the indexing. Reopening the screen starts it again."""
        if light is self._light:
            self.error = CoreError(
                tr("The background was not learnt."),
                tr("Leave this step and come back to try again."),
            )
            self._light = None
            self._changed()
