"""Checks the light on the sitter's face in the live picture against the style."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from app.core.base.arrays import Bytes
from app.core.faces.finder import Face, find_faces
from app.core.faces.shot_against_goal import Check, Promise, check_face, graded_by, promise_of_place
from app.core.portrait.head import Head
from app.core.solver.place_light import PlaceLight
from app.ui.presenters.services import Services

_FACE: Final = "turn-face"
_LEAST_FACE: Final = 90.0  # pixels; a smaller face does not resolve its shadows
_EVERY_S: Final = 0.25


@dataclass(slots=True, eq=False)
class FaceReader:
    """Checks the light on the sitter's face, one picture at a time.

    Attributes:
        check: Result for the newest picture, or None if no face could be evaluated.
    """

    services: Services
    changed: Callable[[], None]
    check: Check | None = None
    _wish: FaceWish | None = None
    _promise: Promise | None = field(default=None, repr=False)
    _next_s: float = 0.0

    def look(self, picture: Bytes, face: Face | None, wish: FaceWish, turn_deg: float) -> None:
        """Check a face, unless another check is running or has just finished.

        Args:
            face: The face in the previous picture, or None if there was no face.
            turn_deg: Panorama azimuth of the lens as seen from the sitter, in degrees.
        """
        now_s, runner = self.services.clock.now(), self.services.runner
        if now_s < self._next_s or runner.running(_FACE):
            return
        self._next_s = now_s + _EVERY_S
        if face is None or face.side < _LEAST_FACE:
            self._read(None, self._promise)
            return
        before = self._promise if wish == self._wish else None
        self._wish = wish
        runner.submit(
            _FACE,
            lambda token, report: _read_face(picture, face, wish, turn_deg, before),
            done=lambda reading: self._read(*reading),
            # The next picture arrives in a moment, so no message is needed.
            failed=lambda error: self._read(None, None),
        )

    def forget(self) -> None:
        """Discard the last check."""
        self.services.runner.cancel(_FACE)
        self.check = None

    def _read(self, check: Check | None, promise: Promise | None) -> None:
        self._promise, before, self.check = promise, self.check, check
        if check is not before:
            self.changed()


@dataclass(frozen=True, slots=True)
class FaceWish:
    """The style, the head and the place against which a face is checked.

    Attributes:
        goal_deg, arc_deg: Panorama azimuths of the goal and of the arc, in degrees.
    """

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
