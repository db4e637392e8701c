"""The open painting, with its canvas, its head, its original style and its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np

from app.core.base.arrays import Float32
from app.core.base.colour import FloatImage
from app.core.base.errors import StyleError
from app.core.painting.canvas import Canvas, blank, from_style
from app.core.painting.draft_file import Draft, draft_version, find_draft
from app.core.painting.painting_session import PaintSession
from app.core.painting.user_style import UserStyle, from_user_style, target_picture
from app.core.portrait.head import Head
from app.core.solver.relighting_cache import LightTable
from app.core.solver.style_result import StyleResult
from app.core.storage.settings import Settings
from app.core.styles.style import Style
from app.core.text import tr
from app.ui.presenters.window_model import Model
from app.ui.screens.paint.head_pixels import HeadLook, head_look

Layers: TypeAlias = tuple[Float32, Float32]


@dataclass(frozen=True, slots=True, eq=False)
class OpenedCanvas:
    """A new canvas, or the canvas from a draft."""

    key: str
    canvas: Canvas
    look: HeadLook
    path: Path
    start: str
    title: str
    style: UserStyle | None
    restored: bool
    notes: tuple[str, ...] = ()
    version: str = ""  # version of the draft's file
    saved: Layers | None = field(default=None, repr=False)


def first_title(style: Style | UserStyle | None) -> str:
    """Return a title for a painting based on a style, such as "My Rembrandt"."""
    return tr("My style") if style is None else tr("My {style}", style=style.title)


def named_style(
    head: Head, own: Sequence[UserStyle], name: str
) -> tuple[Style | None, UserStyle | None]:
    """Return the style with the given name, either a built-in style or one of the user's own."""
    mine = next((style for style in own if style.name == name), None)
    if mine is not None:
        return None, mine
    return next((style for style in head.pack.styles if style.name == name), None), None


def open_canvas(folder: Path, key: str, head: Head, own: Sequence[UserStyle]) -> OpenedCanvas:
    """Open the draft based on a style, or start a new canvas."""
    built_in, mine = named_style(head, own, key)
    path, draft, notes = find_draft(folder, key)
    version = draft_version(path)
    look = head_look(head.transport)
    title = mine.title if mine is not None else first_title(built_in)
    saved = (mine.weights, mine.ignore) if mine is not None else None
    if draft is not None:
        start = draft.origin if mine is not None and draft.origin else key
        if mine is None:
            title = draft.title or title
        canvas = draft.canvas
        return OpenedCanvas(
            key, canvas, look, path, start, title, mine, True, notes, version, saved
        )
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
            notes = (*notes, tr("This style no longer exists, so the canvas starts empty."))
    return OpenedCanvas(key, canvas, look, path, key, title, mine, False, notes, version, saved)


class PaintDocument:
    """The open painting and its editing session."""

    def __init__(
        self,
        opened: OpenedCanvas,
        head: Head,
        table: LightTable | None,
        settings: Settings,
        front_deg: float,
    ) -> None:
        self.key, self.start, self.title = opened.key, opened.start, opened.title
        self.style, self.look, self.path = opened.style, opened.look, opened.path
        self._saved = opened.saved
        self.head = head
        self.turned: HeadLook | None = None
        self.session = self._session(opened.canvas, table, settings, front_deg)

    def renew(
        self, head: Head, table: LightTable | None, settings: Settings, front_deg: float
    ) -> None:
        """Transfer the canvas to another head, light or set of settings."""
        if head is not self.head:
            self.head, self.look, self.turned = head, head_look(head.transport), None
        self.session = self._session(self.session.canvas, table, settings, front_deg)

    def _session(
        self, canvas: Canvas, table: LightTable | None, settings: Settings, front_deg: float
    ) -> PaintSession:
        return PaintSession(
            self.head.transport,
            canvas,
            table,
            objective=settings.objective,
            front_deg=front_deg,
        )

    @property
    def unsaved(self) -> bool:
        """Whether the canvas has unsaved changes.

        The canvas is compared with the saved style or, if it was never saved, with its starting
        point.
        """
        canvas = self.session.canvas
        if self._saved is None:
            return canvas.touched
        return not (_same(canvas.weights, self._saved[0]) and _same(canvas.ignore, self._saved[1]))

    @property
    def built_in(self) -> str:
        """Name of the built-in style that the canvas still matches, or "" after a change."""
        if self.unsaved:
            return ""
        name = self.start if self.style is None else self.style.copy_of
        return name if any(style.name == name for style in self.head.pack.styles) else ""

    def own_answer(self, model: Model) -> StyleResult | None:
        """Return the result of the style that the canvas still matches, or None after a change."""
        if self.unsaved or self.session.stroking or self.head is not model.head:
            return None
        name = self.start if self.style is None else self.style.name
        return next((one for one in model.results if one.name == name), None)

    def target(self) -> tuple[FloatImage, Style | None]:
        """Return the target picture, (N, N, 3) linear, and the style whose lamps light it."""
        pack, name = self.head.pack, self.built_in
        if name and not self.session.stroking:
            return pack.target(name), pack.styles[pack.index(name)]
        return target_picture(self.head.transport, self.session.weights), None

    def draft(self) -> Draft | None:
        """Return the unsaved painting, or None if everything is saved."""
        if not self.unsaved:
            return None
        name = self.style.name if self.style is not None else ""
        return Draft(self.session.canvas, self.title, self.start, name, self.head.name)

    def saved_as(self, style: UserStyle, path: Path) -> None:
        """Continue with the style saved in `path`."""
        self.key, self.title, self.style, self.path = style.name, style.title, style, path
        self._saved = (style.weights, style.ignore)


def _same(one: Float32, other: Float32) -> bool:
    return one is other or np.array_equal(one, other)
