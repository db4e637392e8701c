"""What is on the easel: a canvas under way, what it began from, and what of it is saved."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import colour
from app.core.base.arrays import Bytes, Float32
from app.core.base.errors import CoreError, StyleError
from app.core.base.progress import Report, Token
from app.core.painting.canvas import Canvas, blank, from_style
from app.core.painting.session import Draft, PaintSession, find_draft, save_draft
from app.core.painting.user_style import UserStyle, from_user_style
from app.core.solver.relighting_cache import LightTable
from app.core.solver.styles import Style
from app.core.solver.transport import Transport, render, to_image
from app.core.storage.settings import Settings
from app.core.text import tr
from app.devices.clock import wait
from app.ui.presenters.heads import Head
from app.ui.presenters.saving import disk_words
from app.ui.presenters.services import Services
from app.ui.screens.paint.state import HeadLook

_JOB: Final = "paint-draft"
_DELAY_S: Final = 0.8


class DraftKeeper:
    """Writes drafts a moment after they change, off the thread of the screens."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[Path, Draft | None] = {}
        self._told = False

    def keep(self, path: Path, draft: Draft | None) -> None:
        """Write a draft soon; None takes the file away, as there is nothing unsaved any more."""
        with self._lock:
            self._waiting[path] = draft
        self._start()

    def flush(self) -> bool:
        """Write now what waits: the screen, or the window, is about to go.

        Returns whether it is on the disk; if not, that is told.
        """
        try:
            self._write()
        except (CoreError, OSError) as error:
            self._failed(error)
            return False
        return True

    def _start(self) -> None:
        runner = self._services.runner
        # One that waits already will take the newest.
        if not runner.running(_JOB):
            runner.submit(_JOB, self._work, done=self._written, failed=self._failed)

    def _work(self, token: Token, report: Report) -> None:
        del report
        wait(self._services.clock, _DELAY_S, token)
        self._write()

    def _write(self) -> None:
        # Only writers wait for the disk, one for the other: who comes second writes the newer
        # one. A stroke that ends meanwhile is handed over at once.
        with self._writing:
            with self._lock:
                waiting = tuple(self._waiting.items())
            for path, draft in waiting:
                if draft is None:
                    path.unlink(missing_ok=True)
                else:
                    path.parent.mkdir(parents=True, exist_ok=True)
                    save_draft(path, draft)
                with self._lock:
                    if self._waiting.get(path, self) is draft:
                        del self._waiting[path]

    def _written(self, _answer: None) -> None:
        self._told = False
        self._services.notify.mended("drafts")
        with self._lock:
            more = bool(self._waiting)
        if more:
            self._start()

    def _failed(self, error: Exception) -> None:
        # Once, not after every stroke; what could not be written is tried again with the next.
        if not self._told:
            self._told = True
            said = disk_words(error)
            if not said:
                said = error.message if isinstance(error, CoreError) else f"{error}"
            self._services.notify.tell(
                tr(
                    "The draft cannot be saved: {reason}. Your strokes are kept while "
                    "Turnlight is open. Save them as a style.",
                    reason=said.rstrip("."),
                ),
                kind="warning",
                about="drafts",
                stay=True,
            )


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
    return tr("My style") if style is None else tr("My {style}", style=style.title)


def named_style(
    head: Head, own: Sequence[UserStyle], name: str
) -> tuple[Style | None, UserStyle | None]:
    """Find a style by its name among the built-in ones and the user's own."""
    mine = next((style for style in own if style.name == name), None)
    if mine is not None:
        return None, mine
    return next((style for style in head.pack.styles if style.name == name), None), None


def open_canvas(folder: Path, key: str, head: Head, own: Sequence[UserStyle]) -> Opened:
    """Find the draft begun from a style, or start a new one."""
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
            notes = (*notes, tr("This style is no longer there; painting starts from nothing."))
    return Opened(key, canvas, look, path, key, title, mine, False, notes, saved)


_FACE: Final = 0.5  # from this share of the head on a pixel counts as face
_SOLID: Final = 0.9  # below this share its value is that of its neighbours: no fringe at the edge
_LEVEL: Final = 0.30  # linear grey of the median pixel: room for orange and blue on both sides
_SKY: Final = 0.8
_FRONT: Final = 0.7


def head_look(transport: Transport) -> HeadLook:
    """Light a head softly, so that its form is seen and no side is favoured."""
    rows, columns = transport.environment_shape
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)[:, None]
    azimuth = 2 * np.pi * ((np.arange(columns) + 0.5) / columns - 0.5)[None, :]
    ahead = np.clip(np.cos(elevation) * np.cos(azimuth), 0.0, None)
    light = _SKY * (0.5 + 0.5 * np.sin(elevation)) + _FRONT * ahead**2
    coverage = to_image(transport, transport.coverage)
    flat = np.maximum(render(transport, light), 0.0)
    grey = _continued(to_image(transport, flat), coverage)
    face = coverage >= _FACE
    # Sorted: numpy's own median first loads masked arrays, 40 ms at a time that counts.
    middle = float(np.sort(grey[face])[int(face.sum()) // 2]) if face.any() else 1.0
    shown = colour.srgb_encode(np.clip(grey * (_LEVEL / max(middle, 1e-30)), 0.0, 1.0))
    return HeadLook(np.asarray(shown, np.float32), coverage)


def head_picture(linear: NDArray[np.floating[Any]], coverage: Float32) -> Bytes:
    """Develop a picture of the head for the canvas.

    Args:
        linear: (N, N, 3) float. Linear Rec. 709 on black; pixels at the edge hold the head's share
            only.
        coverage: (N, N) float32. That share.

    Returns:
        (N, N, 3) uint8. sRGB, exposed by the rule of `app.core.base.colour.face_exposure`,
        continued beyond the edge.
    """
    whole = _continued(np.asarray(linear, np.float32), coverage)
    face = coverage >= _FACE
    gain = colour.face_exposure(colour.luminance(whole[face])) if face.any() else 1.0
    return colour.to_bytes(colour.tone_map(np.maximum(whole, 0.0), gain))


def _continued(picture: Float32, coverage: Float32) -> Float32:
    """Take the black out of edge pixels and carry the edge outward by a few pixels."""
    share = np.where(coverage >= _SOLID, coverage, 0.0).astype(np.float32)
    known = np.where(share > 0, 1.0, 0.0).astype(np.float32)
    wide = picture[..., None] if picture.ndim == 2 else picture
    values = np.where(share[..., None] > 0, wide / np.maximum(share, _SOLID)[..., None], 0.0)
    values = np.ascontiguousarray(values, np.float32)
    for _ in range(4):
        around = cv2.blur(values, (3, 3), borderType=cv2.BORDER_REPLICATE)
        around = np.asarray(around, np.float32).reshape(values.shape)
        weight = np.asarray(cv2.blur(known, (3, 3), borderType=cv2.BORDER_REPLICATE), np.float32)
        grown = (known == 0) & (weight > 1e-6)
        values[grown] = around[grown] / weight[grown][:, None]
        known[grown] = 1.0
    return values.reshape(picture.shape)


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
        """Continue with the same canvas on another head, in other light, or with other limits."""
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
        """Note that it was saved, and continue as that style."""
        self.key, self.title, self.style, self.path = style.name, style.title, style, path
        self._saved = (style.weights, style.ignore)


def _same(one: Float32, other: Float32) -> bool:
    return one is other or np.array_equal(one, other)
