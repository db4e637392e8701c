"""What is on the easel, and what its strokes come to in this place: pictures, numbers, words."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import colour
from app.core.base.angles import direction_of, wrap
from app.core.base.arrays import Bytes, Float32
from app.core.base.atomic_files import make_folder
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError, StyleError
from app.core.base.progress import Report, Token
from app.core.painting.canvas import Advice, Canvas, blank, from_style
from app.core.painting.session import (
    Answer,
    Draft,
    PaintSession,
    draft_version,
    find_draft,
    put_draft_aside,
    save_draft,
)
from app.core.painting.user_style import UserStyle, from_user_style, target_picture
from app.core.portrait.head import Head
from app.core.solver.place_light import Facing, PlaceLight, picture_at
from app.core.solver.relighting_cache import LightTable, light_table
from app.core.solver.solve import StyleResult
from app.core.solver.transport import Transport, render, to_image
from app.core.solver.turn_choice import LIMITS
from app.core.storage.data_lock import writing
from app.core.storage.settings import Settings
from app.core.styles.styles import Style
from app.core.text import tr
from app.devices.clock import wait
from app.ui.presenters.model import Model
from app.ui.presenters.saving import disk_words
from app.ui.presenters.services import Services
from app.ui.screens.paint.state import HeadLook, LiveState
from app.words.painting import advice_words
from app.words.phrases.turns import arc_words, direction_lines, signed, size_words
from app.words.shortfall import out_of_reach_sentence, reason_sentence
from app.words.styles import side_words

_JOB: Final = "paint-draft"
_DELAY_S: Final = 0.8


class DraftKeeper:
    """Writes drafts a moment after they change, off the thread of the screens."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[Path, Draft | None] = {}
        self._versions: dict[Path, str] = {}
        self._others: list[Path] = []
        self._has_warned = False

    def opened(self, path: Path, version: str) -> None:
        """Note which version of a draft was read: any other is of another window."""
        self._versions[path] = version

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
        self._tell_others()
        return True

    def _start(self) -> None:
        runner = self._services.runner
        # One that waits already will take the newest.
        if not runner.running(_JOB):
            runner.submit(_JOB, self._work, done=self._on_written, failed=self._failed)

    def _work(self, token: Token, _report: Report) -> None:
        wait(self._services.clock, _DELAY_S, token)
        self._write()

    def _write(self) -> None:
        # Only writers wait for the disk, one for the other: who comes second writes the newer
        # one. A stroke that ends meanwhile is handed over at once.
        with self._writing:
            with self._lock:
                waiting = tuple(self._waiting.items())
            for path, draft in waiting:
                if draft is not None:
                    make_folder(path.parent)
                with writing(path.parent) if path.parent.is_dir() else nullcontext():
                    self._replace(path, draft)
                with self._lock:
                    if self._waiting.get(path, self) is draft:
                        del self._waiting[path]

    def _replace(self, path: Path, draft: Draft | None) -> None:
        """Write a draft, or take it away; one of another window gets a name of its own."""
        here = draft_version(path)
        if here and here != self._versions.get(path, here):
            self._others.append(put_draft_aside(path))
        if draft is None:
            path.unlink(missing_ok=True)
        else:
            save_draft(path, draft)
        self._versions[path] = draft_version(path)

    def _tell_others(self) -> None:
        others, self._others = self._others, []
        for other in others:
            self._services.notify.tell(
                tr(
                    "Another window painted on this style as well. Its draft is kept as {name}.",
                    name=other.name,
                ),
                kind="warning",
            )

    def _on_written(self, _answer: None) -> None:
        self._tell_others()
        self._has_warned = False
        self._services.notify.mended("drafts")
        with self._lock:
            more = bool(self._waiting)
        if more:
            self._start()

    def _failed(self, error: Exception) -> None:
        # Once, not after every stroke; what could not be written is tried again with the next.
        if not self._has_warned:
            self._has_warned = True
            why = disk_words(error)
            words = tr(
                "The draft cannot be saved: {reason}. Your strokes are kept while "
                "Turnlight is open. Save them as a style.",
                reason=why or str(error),
            )
            if not why and isinstance(error, CoreError):
                words = tr(
                    "The draft cannot be saved. {message} Your strokes are kept while "
                    "Turnlight is open. Save them as a style.",
                    message=error.message,
                )
            self._services.notify.tell(
                words,
                kind="warning",
                about="drafts",
                stay=True,
            )


Layers: TypeAlias = tuple[Float32, Float32]


@dataclass(frozen=True, slots=True, eq=False)
class OpenedCanvas:
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
    version: str = ""  # of the draft's file
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


def open_canvas(folder: Path, key: str, head: Head, own: Sequence[UserStyle]) -> OpenedCanvas:
    """Find the draft begun from a style, or start a new one."""
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
            notes = (*notes, tr("This style is no longer there; painting starts from nothing."))
    return OpenedCanvas(key, canvas, look, path, key, title, mine, False, notes, version, saved)


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
    grey = _continued(to_image(transport, np.maximum(render(transport, light), 0.0)), coverage)
    face = coverage >= _FACE
    # Sorted: numpy's own median first loads masked arrays, 40 ms at a time that counts.
    middle = float(np.sort(grey[face])[int(face.sum()) // 2]) if face.any() else 1.0
    tones = colour.srgb_encode(np.clip(grey * (_LEVEL / max(middle, 1e-30)), 0.0, 1.0))
    return HeadLook(np.asarray(tones, np.float32), coverage)


def turned_look(head: Head, yaw_deg: float, steps: int) -> HeadLook | None:
    """Look from some views further to its left at a head; None from the front."""
    yaws = head.aside.yaws
    yaw = yaws[min(max(yaws.index(yaw_deg) + steps, 0), len(yaws) - 1)]
    if not yaw:
        return None
    painted = head.painted()
    view = painted.view(yaw)
    return replace(head_look(view.transport), yaw_deg=yaw, places=painted.places_on_front(view))


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
    weights = np.where(share > 0, 1.0, 0.0).astype(np.float32)
    wide = picture[..., None] if picture.ndim == 2 else picture
    values = np.where(share[..., None] > 0, wide / np.maximum(share, _SOLID)[..., None], 0.0)
    values = np.ascontiguousarray(values, np.float32)
    for _ in range(4):
        around = cv2.blur(values, (3, 3), borderType=cv2.BORDER_REPLICATE)
        around = np.asarray(around, np.float32).reshape(values.shape)
        weight = np.asarray(cv2.blur(weights, (3, 3), borderType=cv2.BORDER_REPLICATE), np.float32)
        grown = (weights == 0) & (weight > 1e-6)
        values[grown] = around[grown] / weight[grown][:, None]
        weights[grown] = 1.0
    return values.reshape(picture.shape)


class PaintDocument:
    """A canvas under way."""

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
        """Continue with the same canvas on another head, or in other light."""
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
        """Whether there is anything on the canvas that no style has."""
        canvas = self.session.canvas
        if self._saved is None:
            return canvas.touched
        return not (_same(canvas.weights, self._saved[0]) and _same(canvas.ignore, self._saved[1]))

    @property
    def built_in(self) -> str:
        """The built-in style that it is until the first stroke; empty for any other."""
        if self.unsaved:
            return ""
        name = self.start if self.style is None else self.style.copy_of
        return name if any(style.name == name for style in self.head.pack.styles) else ""

    def own_answer(self, model: Model) -> StyleResult | None:
        """Return the answer of the style that it still is; None from the first stroke on."""
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


Size: TypeAlias = tuple[int, int]


_LIGHT_JOB: Final = "paint-light"


NO_LIGHT: Final = tr("No light measured yet.")
PREPARING: Final = tr("Preparing the light of this place…")
NO_STROKES: Final = tr("Paint where the face should be brighter, and where darker.")


class LightOnHead:
    """Keeps one light table; has another made in a job when light or head are others."""

    def __init__(self, services: Services, ready: Callable[[], None]) -> None:
        self._services = services
        self._ready = ready
        self._table: LightTable | None = None
        self._of: tuple[PlaceLight, Transport, bool] | None = None
        self.trouble = ""

    def table(self) -> LightTable | None:
        """Give the table of the model's light and head; None while there is none."""
        model = self._services.model
        if model.light is None or model.head is None:
            return None
        light, transport = model.light, model.head.transport
        key, grey = self._of, model.settings.objective == "paper"
        same = key is not None and key[0] is light and key[1] is transport
        if key is None or not same or key[2] != grey:
            self._of, self._table, self.trouble = (light, transport, grey), None, ""
            self._make(light, transport, grey)
        return self._table

    def _make(self, light: PlaceLight, transport: Transport, grey: bool) -> None:
        key = self._of

        def work(token: Token, _report: Report) -> LightTable:
            token.check()
            return light_table(transport, light.searched, pictures=True, grey=grey)

        def done(table: LightTable) -> None:
            if self._of is key:
                self._table = table
                self._ready()

        def failed(error: Exception) -> None:
            if self._of is key:
                message = error.message if isinstance(error, CoreError) else ""
                self.trouble = message or tr("The light of this place cannot be used.")
                self._services.notify.tell_error(error)
                self._ready()

        self._services.runner.submit(_LIGHT_JOB, work, done=done, failed=failed)


ALL_SAVED: Final = tr("Everything is saved")
NOTHING: Final = ("", tr("Nothing"), tr("an empty face"))


def starts_of(
    document: PaintDocument, own: Sequence[UserStyle]
) -> tuple[tuple[str, str, str], ...]:
    """List what painting can start from.

    Returns key, title and side: nothing first, then the user's own, then the built-in styles.
    What was saved here begins from something else: it is no start of its own.
    """
    mine = tuple((one.name, one.title, side_words(one) or tr("painted by you")) for one in own)
    names = {one.name for one in own}
    rest = (one for one in document.head.pack.styles if one.name not in names)
    starts = (NOTHING, *mine, *((one.name, one.title, side_words(one)) for one in rest))
    return tuple(one for one in starts if one[0] != document.key or document.key == document.start)


def status_of(document: PaintDocument) -> str:
    """Say whether what is painted is saved."""
    if document.unsaved:
        return tr("not saved yet") if document.style is None else tr("changes not saved yet")
    return tr("saved") if document.style is not None else tr("nothing painted yet")


def save_words(document: PaintDocument) -> str:
    """Words on the main button."""
    return tr("Save as my style") if document.style is None else tr("Save changes")


def save_why(advice: Advice | None, document: PaintDocument) -> str:
    """Say why what is painted cannot be saved now; empty when it can."""
    if not document.unsaved:
        return advice_words(Advice.NOTHING_PAINTED) if document.style is None else ALL_SAVED
    # Restored to what it began from, yet another than what was saved: that can be saved as well.
    restored = advice is Advice.NOTHING_PAINTED and document.style is not None
    return "" if restored else advice_words(advice)


def live_state(
    document: PaintDocument, answer: Answer, model: Model, size: Size, trouble: str
) -> LiveState:
    """Resolve the live column; `size` is rows and columns of the portrait."""
    light, result = model.light, answer.result
    same_head = document.head is model.head and document.head.name == model.head_name
    own = document.own_answer(model)
    if own is not None:
        same_head = same_head and not model.computing
        result = own if light is not None else None
    state = LiveState(
        stale=not same_head,
        limit=_limit(document, model),
        weights=answer.preintegrated,
        front=model.front_deg,
        panorama=None if light is None else light.display,
        origin=origin_words(model, document.head, document.start),
    )
    if result is None:
        target, lamps = document.target()
        return replace(
            state,
            sentence=NO_LIGHT if light is None else trouble or PREPARING,
            offers_probe=light is None,
            picture=document.head.portrait(target, size, lamps) if target.any() else None,
            picture_tag=tr("Target"),
        )
    here = picture_here(document, answer, model, size)
    if here is not None:
        # At the pace of the brush.
        state = replace(state, picture=here(quick=True))
    if not np.any(result.match_curve):
        return replace(state, sentence=NO_STROKES)
    return replace(_with_numbers(state, result), picture_tag=tr("At the best turn"))


def picture_here(
    document: PaintDocument, answer: Answer, model: Model, size: Size
) -> Callable[..., Bytes] | None:
    """What makes the picture at the best turn; None while there is none."""
    light, result, linear, head = model.light, answer.result, answer.picture, document.head
    own = document.own_answer(model)
    if own is not None and light is not None:
        view_head = head.turned(own.yaw_deg)
        facing = Facing(light, wrap(own.nose_deg + model.front_deg))
        picture = picture_at(view_head.transport, light, facing.turn_deg)
        return lambda quick: view_head.portraits([picture], size, [facing], quick=quick)[0]
    if light is None or result is None or linear is None:
        return None
    here = Facing(light, result.turn_refined_deg + model.front_deg)
    return lambda quick: head.portraits([linear], size, [here], quick=quick)[0]


def _limit(document: PaintDocument, model: Model) -> float:
    """Match that the style in reach has at least; as on its card."""
    pack, name = document.head.pack, document.built_in
    own = pack.styles[pack.index(name)].signature if name else None
    return own.match[1] if own is not None and own.relations else LIMITS.match


def origin_words(model: Model, head: Head, start: str) -> str:
    """Say what the style that painting began from reaches here: "Rembrandt itself: 96, at 96°"."""
    result = next((one for one in model.results if one.name == start), None)
    if result is None or model.head is not head or model.computing:
        return ""
    match = max(math.floor(result.match), 0)
    return tr(
        "{style} itself: {match}, at {turn}",
        style=result.title,
        match=match,
        turn=signed(result.turn_refined_deg),
    )


def _with_numbers(state: LiveState, result: StyleResult) -> LiveState:
    turn = result.turn_refined_deg
    good = tr("Good from {arc}.", arc=arc_words(result.arc_deg))
    if not result.attainable:
        good = out_of_reach_sentence(result.shortfall)
    elif result.shortfall is not None:
        good = tr("{good} Nearly. {what}.", good=good, what=reason_sentence(result.shortfall))
    return replace(
        state,
        turn=size_words(turn),
        direction=direction_lines(turn),
        way=direction_of(turn),
        match=f"{max(math.floor(result.match), 0)}",
        match_value=max(result.match, 0.0),
        turn_deg=turn,
        curve=tuple(float(value) for value in result.match_curve),
        arc=result.arc_deg if result.attainable else None,
        peaks=tuple(peak.turn_refined_deg for peak in result.peaks[1:]),
        good=good,
        dashed=tr("The dashed ring is the limit of reach, {limit:.0f}.", limit=state.limit),
    )
