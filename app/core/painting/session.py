"""A painting session: strokes, live answers, and its draft.

Strokes are drawn at once. The answer is computed when there is time, from the pixels changed since
the last one. Between strokes everything is computed again from the canvas, so that an answer
depends only on the canvas and not on its history.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from app.core.base.archive import CONTRADICTIONS, parse_header, read_arrays, write_arrays
from app.core.base.arrays import Bools, Float32, Float64, Indices
from app.core.base.atomic_files import make_folder, open_file
from app.core.base.errors import StyleError, TransportError
from app.core.painting.canvas import (
    IGNORED,
    MAX_SIZE,
    Advice,
    Canvas,
    Region,
    advice,
    block_means,
    canvas_size,
    make_canvas,
    resized,
    weights_of,
)
from app.core.painting.stroke import Brush, Stroke, TileChange, apply, revert
from app.core.solver.relighting_cache import CountedLight, LightTable, counted_light, table_picture
from app.core.solver.solve import solve_on_table
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import LIMITS, Limits, Objective
from app.core.solver.weights import PaintedWeights, paint
from app.core.text import tr


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Answer for the painted weights."""

    # (H, W), pre-integrated target F (eq. 3) in panorama coordinates at turn 0: positive where
    # light helps, negative where it harms
    preintegrated: Float32 = field(repr=False)
    advice: Advice | None  # what the painting needs before it can be saved
    # best turn, match, strength and curves here, or None without a place
    result: StyleResult | None
    # (N, N, 3), linear Rec. 709 picture at the refined best turn on black, in the unit of the
    # environment, or None without a place or without colours
    picture: Float32 | None = field(repr=False)


class PaintSession:
    """A canvas with its head and the light of a place. Not thread-safe.

    Args:
        front_deg: Azimuth of the photographer at turn 0, in degrees.
    """

    def __init__(
        self,
        transport: Transport,
        canvas: Canvas,
        table: LightTable | None = None,
        *,
        objective: Objective = "picture",
        limits: Limits = LIMITS,
        front_deg: float = 0.0,
    ) -> None:
        self._transport = transport
        self._table = table
        self._front_deg = front_deg
        self._objective: Objective = objective
        self._limits = limits
        place = np.full(transport.size**2, -1)
        place[transport.pixels[transport.face]] = np.flatnonzero(transport.face)
        self._place = place.reshape(transport.size, transport.size)
        self._stroke: Stroke | None = None
        self._dirty: list[Region] = []
        self._count_cache: tuple[Bools, CountedLight] | None = None
        self.replace(canvas)

    @property
    def canvas(self) -> Canvas:
        """The canvas, including the current stroke."""
        return self._canvas if self._stroke is None else self._stroke.canvas

    @property
    def stroking(self) -> bool:
        """Whether a stroke is in progress."""
        return self._stroke is not None

    @property
    def weights(self) -> PaintedWeights:
        """The current weights."""
        if self._dirty:
            self._weights = self._caught_up()
            self._dirty.clear()
        return self._weights

    def set_light(self, table: LightTable | None, front_deg: float = 0.0) -> None:
        """Set the light of a place, or none.

        Args:
            front_deg: Azimuth of the photographer at turn 0, in degrees.
        """
        self._table, self._front_deg, self._count_cache = table, front_deg, None

    def replace(self, canvas: Canvas) -> None:
        """Replace the canvas and abort the current stroke."""
        size = canvas_size(self._transport)
        if canvas.size != size:
            layers = (canvas.weights, canvas.ignore, canvas.start_weights, canvas.start_ignore)
            canvas = make_canvas(*(resized(layer, size) for layer in layers))
        self._stroke = None
        self._start_afresh(canvas)

    def begin(self, brush: Brush, x: float, y: float, pressure: float = 1.0) -> tuple[Region, ...]:
        """Begin a stroke and abort the current one.

        Args:
            x, y: Canvas pixels from the upper left corner.
            pressure: 0 to 1.

        Returns:
            Changed regions.
        """
        self.abort()
        self._stroke = Stroke(self._canvas, brush, x, y, pressure)
        self._dirty += self._stroke.start_regions
        return self._stroke.start_regions

    def extend(self, x: float, y: float, pressure: float = 1.0) -> tuple[Region, ...]:
        """Extend the stroke to a point; no-op without a stroke. Arguments as `begin`."""
        if self._stroke is None:
            return ()
        regions = self._stroke.extend(x, y, pressure)
        self._dirty += regions
        return regions

    def commit(self) -> TileChange:
        """End the stroke and return its change, for undo; empty without a stroke."""
        if self._stroke is None:
            return TileChange(())
        canvas, change = self._stroke.commit()
        self._stroke = None
        self._start_afresh(canvas)
        return change

    def abort(self) -> None:
        """Abort the current stroke."""
        if self._stroke is not None:
            self._stroke = None
            self._start_afresh(self._canvas)

    def apply(self, change: TileChange) -> None:
        """Redo a change; see `app.core.painting.stroke.apply`."""
        self.abort()
        self._start_afresh(apply(self._canvas, change))

    def revert(self, change: TileChange) -> None:
        """Undo a change; see `app.core.painting.stroke.revert`."""
        self.abort()
        self._start_afresh(revert(self._canvas, change))

    def answer(self) -> Answer:
        """Solve the canvas: compute its target and its best turn."""
        weights, table = self.weights, self._table
        target = weights.preintegrated(self._transport)
        missing = advice(self.canvas, weights)
        if table is None:
            return Answer(target, missing, None, None)
        result = solve_on_table(
            table,
            weights,
            self._objective,
            counted=self._counted_now(table, weights.active),
            limits=self._limits,
        )
        picture = None
        if table.pictures is not None:
            picture = table_picture(table, result.turn_refined_deg)
        at_front = result.seen_from(self._front_deg) if self._front_deg else result
        return Answer(target, missing, at_front, picture)

    def _start_afresh(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._weights = weights_of(canvas, self._transport)
        self._dirty.clear()

    def _counted_now(self, table: LightTable, active: Bools) -> CountedLight:
        cache = self._count_cache
        if cache is None or not np.array_equal(cache[0], active):
            cache = self._count_cache = active, counted_light(table, active)
        return cache[1]

    def _caught_up(self) -> PaintedWeights:
        """Return the weights, updated with the changes since the last call."""
        pixels, values, ignored = (
            np.concatenate(parts)
            for parts in zip(*(self._region_changes(region) for region in self._dirty), strict=True)
        )
        pixels, first = np.unique(pixels, return_index=True)
        return paint(self._transport, self._weights, pixels, values[first], ignored[first])

    def _region_changes(self, region: Region) -> tuple[Indices, Float64, Bools]:
        """Return the changed face pixels in a region of the canvas, with their new values."""
        canvas, size = self.canvas, self._transport.size
        step = canvas.size // size
        part = Region(
            region.left // step,
            region.top // step,
            -(-region.right // step),
            -(-region.bottom // step),
        )
        place = self._place[part.slices]
        on_face = place >= 0
        pixels = place[on_face]
        values = block_means(canvas.weights, size, part)[on_face]
        ignored = block_means(canvas.ignore, size, part)[on_face] >= IGNORED
        before = self._weights
        same = (values == before.values[pixels]) & (ignored == ~before.active[pixels])
        return pixels[~same], values[~same], ignored[~same]


DRAFT_FORMAT: Final = 1
"""Version of the file's layout."""
_LAYERS: Final = ("weights", "ignore", "start_weights", "start_ignore")
_MAX_BYTES: Final = 4 * len(_LAYERS) * MAX_SIZE**2 + 65_536
_TEXTS: Final = ("title", "origin", "style", "head")
_LONGEST: Final = 400
_HINT: Final = tr("The draft’s file is unchanged; painting starts from the style itself.")
_MOST_DRAFTS: Final = 20
_AWAY: Final = "draft.npz"


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """Unsaved painting."""

    canvas: Canvas
    title: str = ""
    origin: str = ""
    style: str = ""
    head: str = ""


def draft_version(path: Path) -> str:
    """Return the version of a draft on disk, or "" if there is none."""
    with contextlib.suppress(OSError), open_file(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
    return ""


def put_draft_aside(path: Path) -> Path:
    """Rename a draft of another process; return its new path."""
    for number in range(2, _MOST_DRAFTS + 1):
        aside = path.with_name(f"{path.name.partition('.')[0]}.{number}.npz")
        if not os.path.lexists(aside):
            path.rename(aside)
            return aside
    raise StyleError(tr("There are too many drafts in {folder}.", folder=path.parent))


def save_draft(path: Path, draft: Draft) -> None:
    """Save a draft atomically."""
    header = {"format": DRAFT_FORMAT, **{key: getattr(draft, key)[:_LONGEST] for key in _TEXTS}}
    arrays = {name: getattr(draft.canvas, name) for name in _LAYERS}
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    write_arrays(path, arrays)


def load_draft(path: Path) -> Draft:
    """Read a draft; raises `StyleError` if the file is missing or damaged."""
    try:
        arrays = read_arrays(path, tr("draft"), _HINT, _MAX_BYTES)
    except (TransportError, OSError) as error:
        words = error.message if isinstance(error, TransportError) else f"{path.name}: {error}."
        raise StyleError(words, _HINT) from error
    try:
        header = parse_header(arrays["header"])
        version = int(header["format"])
        texts = {key: str(header[key])[:_LONGEST] for key in _TEXTS}
        layers = [np.asarray(arrays[name]) for name in _LAYERS]
    except CONTRADICTIONS as error:
        raise StyleError(tr("{name} is damaged or not a draft.", name=path.name), _HINT) from error
    if version > DRAFT_FORMAT:
        raise StyleError(
            tr(
                "{name} was made by a newer Turnlight (format {version}).",
                name=path.name,
                version=version,
            ),
            tr("Update Turnlight."),
        )
    if version < DRAFT_FORMAT or any(layer.dtype != np.float32 for layer in layers):
        raise StyleError(tr("{name} is damaged or not a draft.", name=path.name), _HINT)
    return Draft(make_canvas(*layers), **texts)


def find_draft(folder: Path, key: str) -> tuple[Path, Draft | None, tuple[str, ...]]:
    """Find the draft of a style.

    An unreadable file stays as it is, and the next free name beside it is used.

    Returns:
        path: Where the draft will be saved from now on.
        draft: The draft, if there is one.
        notes: Problems of unreadable files.
    """
    notes: list[str] = []
    stem = f"paint-{key}" if key else "paint"
    for number in range(1, _MOST_DRAFTS + 1):
        path = folder / (f"{stem}.npz" if number == 1 else f"{stem}.{number}.npz")
        if not path.exists():
            return path, None, tuple(notes)
        try:
            return path, load_draft(path), tuple(notes)
        except StyleError as error:
            notes.append(str(error))
    return folder / f"{stem}.{_MOST_DRAFTS + 1}.npz", None, tuple(notes)


def put_draft_away(folder: Path, key: str, trash: Path) -> None:
    """Move the draft of a deleted style to the trash, so that a namesake starts clean."""
    path, draft, _ = find_draft(folder, key)
    if draft is not None:
        # If it cannot be moved, it stays where the style will look for it.
        with contextlib.suppress(OSError):
            os.replace(path, trash / _AWAY)


def bring_draft_back(folder: Path, key: str, trash: Path) -> None:
    """Move the draft of a restored style back, under the style's current name."""
    path, other, _ = find_draft(folder, key)
    if other is None and (trash / _AWAY).exists():
        make_folder(folder)
        os.replace(trash / _AWAY, path)
