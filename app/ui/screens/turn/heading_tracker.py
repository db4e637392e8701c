"""Where the live camera points, and how its picture lies on the goal: work for other threads.

One picture is looked at at a time; those that come meanwhile are passed over, and the newest one is
next. What is known from one picture to the next is a `Track`, and an `SteadyOverlay`: plain values
that go into the work and come out of it, so that nothing is shared between threads.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.faces.finder import Face, find_faces
from app.core.faces.shot_check import Check, Promise, check_face, graded_by, promise_of_place
from app.core.localization.align import BARE, SteadyOverlay, align, steady_overlay
from app.core.localization.features import HeadingIndex, build_index, keep_index, read_index
from app.core.localization.heading import UNSURE, find_heading
from app.core.localization.homography import Alignment
from app.core.localization.sitter import Sitter, background_mask, find_sitter
from app.core.localization.tracking import LOST, Seeing, Track, missed, track
from app.core.portrait.head import Head
from app.core.solver.place_light import PlaceLight
from app.core.text import tr
from app.ui.presenters.services import Services

if TYPE_CHECKING:
    from app.devices.webcam import WebcamFrame


_INDEX: Final = "turn-index"
_KEEP: Final = "turn-index-keep"
_HEADING: Final = "turn-heading"
_ALIGN: Final = "turn-align"
_FACE: Final = "turn-face"
_LEAST_FACE: Final = 90.0  # pixels: shadows of a smaller one are lost
_FACE_S: Final = 0.25  # between two readings
_LEARNING: Final = tr("Learning the background")
_PLACES: Final = 3  # whose points are kept; some 5 MB each
_COARSE: Final = 4


class HeadingTracker:
    """Locates the newest picture, one at a time; pictures that come meanwhile are passed over.

    Attributes:
        track: What the last picture gave; None before the first.
        index: The panorama's points; None until they are learnt.
    """

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._light: PlaceLight | None = None
        self._folder: Path | None = None
        self._indexes: OrderedDict[bytes, HeadingIndex] = OrderedDict()
        self._frame: Bytes | None = None
        self._on = False
        self._round = 0
        self.track: Track | None = None
        self.index: HeadingIndex | None = None
        self.error: CoreError | None = None

    @property
    def learning(self) -> bool:
        """Whether the panorama's points are not yet known."""
        return self._light is not None and self.index is None and self.error is None

    def learn(self, light: PlaceLight, folder: Path | None = None) -> None:
        """Get to know a panorama; once for each, and what was learnt stays in its place's folder.

        `folder`: None while the place is not saved.
        """
        before, self._folder = self._folder, folder
        if light is self._light:
            if folder != before:
                self._keep()
            return
        self._light, self.error = light, None
        self.forget()
        key = _key(light)
        self.index = self._indexes.get(key)
        if self.index is not None:
            self._indexes.move_to_end(key)
            self._services.runner.cancel(_INDEX)
            self._keep()
            self._changed()
            return
        self._services.runner.submit(
            _INDEX,
            lambda token, report: (
                (None if folder is None else read_index(folder, light.display))
                or build_index(light.display, token, report)
            ),
            title=_LEARNING,
            done=lambda index: self._learnt(light, key, index),
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
        self.track, self._frame = None, None
        self._round += 1  # what is being worked out is of no use any more

    def look(
        self,
        frame: WebcamFrame,
        fov_deg: float | None,
        *,
        sees_sitter: bool = True,
        asked_deg: float | None = None,
    ) -> None:
        """Locate a picture, unless one is being located.

        Args:
            fov_deg: Horizontal field of view, deg; None when it is unknown, and to be learnt.
            asked_deg: How far it still is to the light, deg; None where no turn is asked for.
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
            # One picture that cannot be worked on is no more than one without a heading.
            failed=lambda error: self._located(this, replace(missed(state, now_s), raw=UNSURE)),
        )

    def _new(self, picture: Bytes) -> bool:
        """Whether there is something to learn from a picture: from the very same one seldom."""
        return picture is not self._frame or (self.track is not None and self.track.pending)

    def _located(self, this: int, track: Track) -> None:
        if self._on and this == self._round:
            self.track = track
            self._changed()

    def _learnt(self, light: PlaceLight, key: bytes, index: HeadingIndex) -> None:
        self._indexes[key] = index
        while len(self._indexes) > _PLACES:
            self._indexes.popitem(last=False)
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
                tr("The background cannot be learnt."), tr("Turn by the number.")
            )
            self._services.notify.tell_error(error)
        self._changed()

    def _given_up(self, light: PlaceLight) -> None:
        """Somebody pressed Cancel: it is tried again when the screen is next entered."""
        if light is self._light:
            self.error = CoreError(
                tr("The background was not learnt."),
                tr("Leave this step and come back to try again."),
            )
            self._light = None
            self._changed()


def _key(light: PlaceLight) -> bytes:
    """Say in a few bytes what a panorama shows: the same place may be opened again."""
    coarse = np.ascontiguousarray(light.display[::_COARSE, ::_COARSE])
    return hashlib.blake2b(coarse.tobytes(), digest_size=16).digest()


@dataclass(slots=True, eq=False)
class Aligner:
    """Finds, again and again, how the newest picture lies on the goal.

    `alignment`: what to show, steadied; None before the first picture.
    """

    services: Services
    changed: Callable[[], None]
    on: bool = False
    alignment: Alignment | None = None
    _pictures: tuple[Bytes, Bytes] | None = field(default=None, repr=False)
    _state: tuple[SteadyOverlay, Sitter | None] = field(default=(BARE, None), repr=False)

    def switch(self, on: bool) -> None:
        """Begin or end."""
        self.on, self.alignment, self._pictures = on, None, None
        self._state = (BARE, None)
        if not on:
            self.services.runner.cancel(_ALIGN)

    def look(self, picture: Bytes, target: Bytes, fovs_deg: tuple[float, float]) -> None:
        """Lay a picture on the goal, unless one is being laid.

        Args:
            picture, target: (H, W, 3) uint8. sRGB, not mirrored; what the camera sees, and what it
                should see.
            fovs_deg: Of the target in the panorama, and of the camera; deg.
        """
        before, pictures = self._state, self._pictures
        same = pictures is not None and pictures[0] is picture and pictures[1] is target
        same = same and before[0].rival is None
        if not self.on or same or self.services.runner.running(_ALIGN):
            return
        if pictures is not None and pictures[1] is not target:
            before = (BARE, before[1])  # another goal: nothing lies on it yet
        self._pictures, now_s = (picture, target), self.services.clock.now()
        self.services.runner.submit(
            _ALIGN,
            lambda token, report: _lay(picture, target, fovs_deg, before, now_s),
            done=self._take_overlay,
            failed=lambda error: self._take_overlay((BARE, None)),
        )

    def _take_overlay(self, state: tuple[SteadyOverlay, Sitter | None]) -> None:
        if self.on:
            self._state, self.alignment = state, state[0].alignment
            self.changed()


def _lay(
    picture: Bytes,
    target: Bytes,
    fovs_deg: tuple[float, float],
    before: tuple[SteadyOverlay, Sitter | None],
    now_s: float,
) -> tuple[SteadyOverlay, Sitter | None]:
    """Lay a picture on the goal by what is behind the sitter."""
    overlay, near = before
    try:
        sitter = find_sitter(picture, fovs_deg[1], near)
    except CoreError:
        sitter = None
    alignment = align(
        target,
        picture,
        fov_deg=fovs_deg[0],
        view_fov_deg=fovs_deg[1],
        sitter_deg=0.0 if sitter is None else sitter.angle_deg,
        mask=None if sitter is None else background_mask(sitter, picture.shape[:2]),
    )
    sizes = ((picture.shape[1], picture.shape[0]), (target.shape[1], target.shape[0]))
    return steady_overlay(overlay, alignment, sizes, now_s), sitter


@dataclass(slots=True, eq=False)
class FaceReader:
    """Reads, again and again, what the sitter's face shows of the style.

    `check`: of the newest picture; None where no face can be read.
    """

    services: Services
    changed: Callable[[], None]
    check: Check | None = None
    _wish: FaceWish | None = None
    _promise: Promise | None = field(default=None, repr=False)
    _next_s: float = 0.0

    def look(self, picture: Bytes, face: Face | None, wish: FaceWish, turn_deg: float) -> None:
        """Read a face, unless one is being read or was a moment ago.

        Args:
            face: In a picture a moment before; None where there is none.
            turn_deg: Panorama azimuth of the lens from the sitter, deg.
        """
        now_s, runner = self.services.clock.now(), self.services.runner
        if now_s < self._next_s or runner.running(_FACE):
            return
        self._next_s = now_s + _FACE_S
        if face is None or face.side < _LEAST_FACE:
            self._read(None, self._promise)
            return
        before = self._promise if wish == self._wish else None
        self._wish = wish
        runner.submit(
            _FACE,
            lambda token, report: _read_face(picture, face, wish, turn_deg, before),
            done=lambda reading: self._read(*reading),
            # The next picture comes in a moment.
            failed=lambda error: self._read(None, None),
        )

    def forget(self) -> None:
        """Know nothing of a face."""
        self.services.runner.cancel(_FACE)
        self.check = None

    def _read(self, check: Check | None, promise: Promise | None) -> None:
        self._promise, before, self.check = promise, self.check, check
        if check is not before:
            self.changed()


@dataclass(frozen=True, slots=True)
class FaceWish:
    """What a face is held against: a style of a head in a place, and where it is to look."""

    light: PlaceLight
    head: Head
    name: str
    goal_deg: float
    arc_deg: tuple[float, float] | None


def _read_face(
    picture: Bytes, near: Face, wish: FaceWish, turn_deg: float, promise: Promise | None
) -> tuple[Check | None, Promise]:
    if promise is None:
        pack = graded_by(wish.head.name, wish.head.pack, wish.name)
        promise = promise_of_place(
            wish.light, wish.goal_deg, wish.arc_deg, pack, wish.name, wish.head.transport
        )
    faces = find_faces(picture, near, small=False)
    if not faces:
        return None, promise
    return check_face(picture, faces[0], promise, lens_deg=turn_deg, key=False), promise
