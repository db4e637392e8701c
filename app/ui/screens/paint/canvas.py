"""The contents of the canvas: the weights, the target or the picture here, seen from any angle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, TypeAlias

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes, Float32
from app.core.painting.painting_session import Answer
from app.core.painting.stroke import Brush
from app.core.solver.place_light import picture_at
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.services import Services
from app.ui.screens.paint.document import PaintDocument
from app.ui.screens.paint.head_pixels import HeadLook, head_picture, turned_look

Point: TypeAlias = "tuple[float, float, float]"
"""Position of the pen in canvas pixels from the upper left corner, and its pressure, 0 to 1."""

FRONT_ONLY: Final = tr("This head can be painted only from the front.")
_TURN_JOB: Final = "paint-turn"


class CanvasMode(StrEnum):
    """The possible contents of the canvas."""

    WEIGHTS = "weights"
    TARGET = "target"
    HERE = "here"


@dataclass(frozen=True, slots=True, eq=False)
class CanvasState:
    """Everything on the canvas apart from the strokes.

    Attributes:
        notice: Text that is shown until a canvas is open.
        picture: Picture of the head to show instead of the weights, (N, N, 3) uint8 sRGB, extended
            beyond the edge of the head, or None to show the weights.
    """

    notice: str = ""
    brush: Brush = field(default_factory=Brush)
    mode: CanvasMode = CanvasMode.WEIGHTS
    head: HeadLook | None = field(default=None, repr=False)
    picture: Bytes | None = field(default=None, repr=False)


class CanvasLook:
    """Selects the contents of the canvas and the viewing angle."""

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._document: PaintDocument | None = None
        self._steps = 0  # views that are still to be rendered
        self.mode = CanvasMode.WEIGHTS

    def take(self, document: PaintDocument | None) -> None:
        """Switch to this painting."""
        self._document = document

    def show(self, mode: CanvasMode) -> None:
        """Show different contents on the canvas."""
        if mode is not self.mode:
            self.mode = mode
            if self._document is not None and mode is not CanvasMode.WEIGHTS:
                self._document.turned = None
            self._changed()

    def turn_head(self, steps: int) -> None:
        """Turn the head to its left by a number of views, to paint its side. 0 shows the front."""
        document = self._document
        if document is None or document.session.stroking:
            return
        yaw = document.turned.yaw_deg if steps and document.turned is not None else 0.0
        # Keys may be pressed faster than views are rendered.
        steps = self._steps = self._steps + steps if steps else 0
        head, tell = document.head, self._services.notify.tell

        def done(look: HeadLook | None) -> None:
            self._steps = 0
            if self._document is document and document.head is head:
                document.turned, self.mode = look, CanvasMode.WEIGHTS
                self._changed()

        def failed(_: Exception) -> None:
            self._steps = 0
            tell(FRONT_ONLY, kind="warning")

        self._services.runner.submit(
            _TURN_JOB, lambda *_: turned_look(head, yaw, steps), done=done, failed=failed
        )

    def resolve(self, document: PaintDocument, answer: Answer, brush: Brush) -> CanvasState:
        """Return the state of the canvas for a painting."""
        head = document.turned or document.look
        return CanvasState("", brush, self.mode, head, self._picture(document, answer.picture))

    def _picture(self, document: PaintDocument, linear: Float32 | None) -> Bytes | None:
        """Return the picture that replaces the weights, or None while the weights are shown.

        Args:
            linear: Picture of the head at the best turn here, (N, N, 3), or None if there is no
                light.
        """
        if self.mode is CanvasMode.WEIGHTS:
            return None
        model = self._services.model
        own = document.own_answer(model)
        if own is not None and model.light is not None:
            facing = wrap(own.nose_deg + model.front_deg)
            linear = picture_at(document.head.transport, model.light, facing)
        if self.mode is CanvasMode.TARGET or linear is None:
            linear, _ = document.target()
        return head_picture(linear, document.look.coverage)

    def actions(self) -> Sequence[Action]:
        """Return the view's keyboard actions."""
        weights, target, here = CanvasMode
        return (
            Action("show-weights", tr("Show the weights"), lambda: self.show(weights),
                   "layers", "W"),
            Action("show-target", tr("Show the target"), lambda: self.show(target), "target", "T"),
            Action("show-here", tr("Show the picture here"), lambda: self.show(here),
                   "person", "H"),
            Action("head-left", tr("Turn the head to its left"), lambda: self.turn_head(1),
                   "chevron-right", "."),
            Action("head-right", tr("Turn the head to its right"), lambda: self.turn_head(-1),
                   "chevron-left", ","),
        )  # fmt: skip
