"""What is on the easel: a canvas under way, what it began from, and what of it is saved."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import StyleError
from app.core.painting.canvas import blank, from_style
from app.core.painting.session import PaintSession
from app.core.painting.user_style import Draft, from_user_style
from app.ui.screens.paint.drafts import find_draft
from app.ui.screens.paint.looks import head_look

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from app.core.painting.canvas import Canvas
    from app.core.painting.user_style import UserStyle
    from app.core.solver.relighting_cache import LightTable
    from app.core.solver.styles import Style
    from app.core.storage.settings import Settings
    from app.ui.presenters.model import Head
    from app.ui.screens.paint.state import HeadLook

Float32: TypeAlias = NDArray[np.float32]
Layers: TypeAlias = tuple[Float32, Float32]


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """A canvas that was made or found."""

    key: str
    canvas: Canvas
    look: HeadLook
    path: Path
    start: str
    title: str
    style: UserStyle | None
    restored: bool
    notes: tuple[str, ...] = ()
    saved: Layers | None = field(default=None, repr=False)


def first_title(style: Style | UserStyle | None) -> str:
    """Name for what is painted from a style: "My Rembrandt"."""
    return "My style" if style is None else f"My {style.title}"


def named_style(
    head: Head, own: Sequence[UserStyle], name: str
) -> tuple[Style | None, UserStyle | None]:
    """Find a style by its name among the built-in ones and the user's own."""
    mine = next((style for style in own if style.name == name), None)
    if mine is not None:
        return None, mine
    return next((style for style in head.pack.styles if style.name == name), None), None


def open_canvas(folder: Path, key: str, head: Head, own: Sequence[UserStyle]) -> Opened:
    """Find the draft begun from a style, or begin anew."""
    built_in, mine = named_style(head, own, key)
    path, draft, notes = find_draft(folder, key)
    look = head_look(head.transport)
    title = mine.title if mine is not None else first_title(built_in)
    saved = (mine.weights, mine.ignore) if mine is not None else None
    if draft is not None:
        start = draft.origin if mine is not None and draft.origin else key
        if mine is None:
            title = draft.title or title
        return Opened(key, draft.canvas, look, path, start, title, mine, True, notes, saved)
    if mine is not None:
        canvas = from_user_style(mine, head.transport)
    elif built_in is not None:
        try:
            canvas = from_style(head.pack, head.transport, key)
        except StyleError as error:
            canvas, notes = blank(head.transport), (*notes, str(error))
    else:
        canvas = blank(head.transport)
        if key:
            notes = (*notes, "This style is no longer there; painting starts from nothing.")
    return Opened(key, canvas, look, path, key, title, mine, False, notes, saved)


class PaintDocument:
    """A canvas under way."""

    def __init__(
        self,
        opened: Opened,
        head: Head,
        table: LightTable | None,
        settings: Settings,
        front_deg: float,
    ) -> None:
        self.key, self.start, self.title = opened.key, opened.start, opened.title
        self.style, self.look, self.path = opened.style, opened.look, opened.path
        self._saved = opened.saved
        self.head = head
        self.session = self._session(opened.canvas, table, settings, front_deg)

    def renew(
        self, head: Head, table: LightTable | None, settings: Settings, front_deg: float
    ) -> None:
        """Go on with the same canvas on another head, in other light, or with other limits."""
        if head is not self.head:
            self.head, self.look = head, head_look(head.transport)
        self.session = self._session(self.session.canvas, table, settings, front_deg)

    def _session(
        self, canvas: Canvas, table: LightTable | None, settings: Settings, front_deg: float
    ) -> PaintSession:
        return PaintSession(
            self.head.transport,
            canvas,
            table,
            objective="paper" if settings.objective == "paper" else "picture",
            limits=settings.limits,
            front_deg=front_deg,
        )

    @property
    def unsaved(self) -> bool:
        """Whether there is anything on the canvas that no style has."""
        canvas = self.session.canvas
        if self._saved is None:
            return canvas.touched
        return not (_same(canvas.weights, self._saved[0]) and _same(canvas.ignore, self._saved[1]))

    def draft(self) -> Draft | None:
        """Return what is to be kept of it now; None when all is saved."""
        if not self.unsaved:
            return None
        name = self.style.name if self.style is not None else ""
        return Draft(self.session.canvas, self.title, self.start, name, self.head.name)

    def saved_as(self, style: UserStyle, path: Path) -> None:
        """Note that it was saved, and go on as that style."""
        self.key, self.title, self.style, self.path = style.name, style.title, style, path
        self._saved = (style.weights, style.ignore)


def _same(one: Float32, other: Float32) -> bool:
    return one is other or np.array_equal(one, other)
