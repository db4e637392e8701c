"""Timing the hot paths beside a plain implementation and the machine's own limit, in one run.

The limit is the time that the memory traffic alone would take: bytes touched over the bandwidth
measured in the same run. What fits a cache can be faster than that.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.angles import TURNS
from app.core.light_table import light_table
from app.core.painting.brush import Brush, Tool
from app.core.painting.canvas import canvas_size
from app.core.painting.session import PaintSession
from app.core.painting.start import from_weights
from app.core.search import curves, quality_curves
from app.core.solve import match_and_strength
from app.core.transport import preintegrate, render
from app.core.weights import paint, painted, target_weights

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from app.core.pack import StylePack
    from app.core.progress import Report, Token
    from app.core.transport import Transport

__all__ = ["Row", "bandwidth", "run_all"]

Float32: TypeAlias = NDArray[np.float32]

_STROKE: Final = 200  # pixels that one stroke changes
_SEGMENT: Final = 8.0  # canvas pixels that the brush moves from one event to the next
_BUFFER: Final = 1 << 26  # bytes; far beyond any cache


@dataclass(frozen=True, slots=True)
class Row:
    """One hot path.

    Attributes
    ----------
    name : str
        Stable name.
    seconds : float
        Best time of repeated calls.
    median_seconds : float
        Median of the same calls; the better of two rounds.
    baseline_seconds : float
        Best time of the plain implementation.
    limit_seconds : float
        Bytes touched over the bandwidth measured in the same run.
    baseline : str
        What the plain implementation is.
    """

    name: str
    seconds: float
    median_seconds: float
    baseline_seconds: float
    limit_seconds: float
    baseline: str

    @property
    def ratio(self) -> float:
        """How many times faster than the plain implementation."""
        return self.baseline_seconds / self.seconds


@dataclass(frozen=True, slots=True)
class _Case:
    name: str
    fast: Callable[[], object]
    plain: Callable[[], object]
    touched: int
    baseline: str


def bandwidth() -> float:
    """Measure memory bandwidth, bytes per second read and written by a large copy."""
    source = np.ones(_BUFFER // 8)
    target = np.empty_like(source)
    best, _ = _time(lambda: np.copyto(target, source), 0.3, 20)
    return 2 * source.nbytes / best


def run_all(
    transport: Transport, pack: StylePack, report: Report, token: Token
) -> tuple[tuple[Row, ...], float]:
    """Time every hot path.

    Parameters
    ----------
    transport : Transport
        Of the head.
    pack : StylePack
        Made from it.
    report : Report
        Told which row is being timed.
    token : Token
        Checked between rows.

    Returns
    -------
    tuple of Row
        One per hot path.
    float
        Memory bandwidth, bytes per second.
    """
    speed = bandwidth()
    cases = _cases(transport, pack)
    times: dict[str, list[tuple[float, float, float]]] = {case.name: [] for case in cases}
    # Two rounds, so that a moment in which the machine was busy spoils neither side of a ratio.
    for done, case in enumerate([*cases, *cases]):
        token.check()
        report(done / (2 * len(cases)), case.name)
        plain, _ = _time(case.plain, 0.5, 50)
        times[case.name].append((*_time(case.fast, 0.3, 2000), plain))
    report(1.0, "done")
    rows = []
    for case in cases:
        best, median, plain = np.min(times[case.name], axis=0).tolist()
        rows.append(Row(case.name, best, median, plain, case.touched / speed, case.baseline))
    return tuple(rows), speed


def _time(call: Callable[[], object], budget_s: float, most: int) -> tuple[float, float]:
    """Best and median seconds of up to `most` calls within a budget, three calls at least."""
    call()
    times: list[float] = []
    stop = time.perf_counter() + budget_s
    while len(times) < 3 or (time.perf_counter() < stop and len(times) < most):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times), float(np.median(times))


def _environment(shape: tuple[int, int]) -> Float32:
    """Make a lively environment; how long anything takes does not depend on what is in it."""
    rng = np.random.default_rng(2019)
    return np.exp(1.5 * rng.standard_normal((*shape, 3))).astype(np.float32)


def _cases(transport: Transport, pack: StylePack) -> list[_Case]:
    return [
        *_search_cases(transport, pack),
        *_transport_cases(transport, pack),
        _paint_case(transport),
    ]


def _search_cases(transport: Transport, pack: StylePack) -> Iterator[_Case]:
    light = _environment(pack.header.environment).mean(axis=2)
    tables, targets = pack.tables, pack.preintegrated
    seen = pack.seen(light)
    pixels = transport.pixels[transport.face]
    size = pack.header.picture**2
    weights = np.asarray(transport.header.luminance_weights, np.float32)
    flat = pack.targets.reshape(len(pack.styles), size, 3).astype(np.float32)
    pictures = (flat @ weights)[:, pixels]
    full = transport.luminance_basis[transport.face] @ transport.texel_basis
    out = 8 * TURNS * len(pack.styles)
    yield _Case(
        "solve.quality",
        lambda: quality_curves(tables, seen),
        lambda: _plain_quality(targets, light),
        tables.targets.nbytes + seen.nbytes + out,
        "per style and turn: roll, dot",
    )
    touched = tables.targets.nbytes + tables.basis.nbytes + seen.nbytes + 3 * out
    yield _Case(
        "solve.match",
        lambda: match_and_strength(pack, curves(tables, seen)),
        lambda: _plain_match(full, pictures, light),
        touched,
        "64 products T @ L, np.corrcoef",
    )
    yield _Case(
        "solve.match.product",
        lambda: match_and_strength(pack, curves(tables, seen)),
        lambda: _product_match(full, pictures, light),
        touched,
        "one product T @ L for 64 turns",
    )


def _transport_cases(transport: Transport, pack: StylePack) -> Iterator[_Case]:
    radiance = _environment(transport.environment_shape)
    luminance = render(transport, radiance.mean(axis=2))
    weights = target_weights(luminance, transport.face).astype(np.float32)
    full = transport.matrix()
    before = painted(transport, weights)
    stroke = np.flatnonzero(transport.face)[:_STROKE]
    values = np.linspace(0, 1, len(stroke))
    basis = transport.luminance_basis
    texels = transport.texel_basis.nbytes
    yield _Case(
        "preintegrate.full",
        lambda: preintegrate(transport, weights),
        lambda: weights @ full,
        basis.nbytes + texels,
        "f @ T, full matrix",
    )
    yield _Case(
        "preintegrate.stroke",
        lambda: paint(transport, before, stroke, values).preintegrated(transport),
        lambda: weights @ full,
        stroke.size * basis.itemsize * basis.shape[1] + texels,
        "f @ T, full matrix",
    )
    channels = [transport.matrix(c) for c in range(3)]
    flat = np.ascontiguousarray(radiance.reshape(-1, 3).T)
    yield _Case(
        "render.rgb",
        lambda: render(transport, radiance),
        lambda: [channels[c] @ flat[c] for c in range(3)],
        transport.pixel_basis.nbytes + texels,
        "T @ L per channel, full matrix",
    )


class _Painter:
    """Somebody who paints on and on: one call, one segment and its full answer."""

    def __init__(self, transport: Transport, radiance: Float32) -> None:
        luminance = radiance @ np.asarray(transport.header.luminance_weights, np.float32)
        picture = render(transport, luminance)
        start = from_weights(transport, target_weights(picture, transport.face))
        table = light_table(transport, radiance, pictures=True)
        self.session = PaintSession(transport, start, table)
        self._size = canvas_size(transport)
        self._segments = 0

    def __call__(self) -> None:
        """Move the brush over the face; every 32 segments a new stroke undoes the last."""
        count = self._segments
        angle = 2 * np.pi * _SEGMENT * count / self._size
        x, y = self._size * (0.5 + 0.25 * np.cos(angle)), self._size * (0.5 + 0.3 * np.sin(angle))
        if count % 32 == 0:
            self.session.commit()
            tool = (Tool.BRIGHTER, Tool.DARKER)[count // 32 % 2]
            self.session.begin(Brush(tool, diameter=0.16 * self._size, mirror=True), x, y)
        self.session.extend(x, y)
        self.session.answer()
        self._segments += 1


def _paint_case(transport: Transport) -> _Case:
    radiance = _environment(transport.environment_shape)
    painter = _Painter(transport, radiance)
    luminance = radiance @ np.asarray(transport.header.luminance_weights, np.float32)
    full = transport.luminance_basis[transport.face] @ transport.texel_basis
    channels = [transport.matrix(c) for c in range(3)]
    flat = np.ascontiguousarray(radiance.reshape(-1, 3).T)
    weights = painter.session.weights.weights[transport.face].astype(np.float32)

    def plain() -> None:
        assert (weights @ full).size
        _plain_match(full, weights[None], luminance)
        assert all((channels[c] @ flat[c]).size for c in range(3))

    brush = int(0.16 * painter.session.canvas.size) ** 2
    rows = brush // (painter.session.canvas.size // transport.size) ** 2
    touched = (
        2 * brush * 6 * 4  # both sides of the face: layers before and after, cover
        + 2 * rows * transport.luminance_basis.shape[1] * 4
        + transport.texel_basis.nbytes
        + transport.header.rank * TURNS * 8
        + 3 * len(transport.pixels) * 3 * 4
    )
    return _Case("paint.segment", painter, plain, touched, "f @ T, 64 products T @ L, picture")


def _plain_quality(targets: Float32, light: Float32) -> NDArray[np.float64]:
    """Eq. 5 as one would write it down: every style, every turn, roll and dot."""
    quality = np.empty((len(targets), TURNS))
    for style, target in enumerate(targets):
        for turn in range(TURNS):
            quality[style, turn] = np.dot(target.ravel(), np.roll(light, -turn, axis=1).ravel())
    return quality


def _plain_match(full: Float32, pictures: Float32, light: Float32) -> NDArray[np.float64]:
    """Match of every style from 64 pictures, each rendered with the full matrix."""
    match = np.empty((len(pictures), TURNS))
    for turn in range(TURNS):
        face = full @ np.roll(light, -turn, axis=1).ravel()
        for style, target in enumerate(pictures):
            match[style, turn] = 100 * np.corrcoef(target, face)[0, 1]
    return match


def _product_match(full: Float32, pictures: Float32, light: Float32) -> Float32:
    """Match of every style from one product of the full matrix with all turned environments."""
    turned = np.stack([np.roll(light, -turn, axis=1).ravel() for turn in range(TURNS)], axis=1)
    faces = full @ turned
    faces -= faces.mean(axis=0)
    wishes = pictures - pictures.mean(axis=1, keepdims=True)
    wishes /= np.linalg.norm(wishes, axis=1, keepdims=True)
    match: Float32 = 100 * (wishes @ faces) / np.linalg.norm(faces, axis=0)
    return match
