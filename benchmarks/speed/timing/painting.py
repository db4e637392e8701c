"""Time a painted stroke: target, weights, pre-integration, answer and picture per segment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.painting.canvas import canvas_size, from_weights
from app.core.painting.painting_session import PaintSession
from app.core.painting.stroke import Brush, Tool
from app.core.solver.relighting_cache import light_table
from app.core.solver.transport import render
from app.core.solver.weights import target_weights
from benchmarks.speed.plain_search import matrix
from benchmarks.speed.timing.runner.rows import Case
from benchmarks.speed.timing.search import lively, plain_match

if TYPE_CHECKING:
    from app.core.solver.transport import Transport

Float32: TypeAlias = NDArray[np.float32]

_SEGMENT: Final = 8.0  # canvas pixels that the brush moves between two events


class _Painter:
    """Paints continuously: each call is one segment and its full answer."""

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


def paint_case(transport: Transport) -> Case:
    """Return the case of one segment of a stroke and its full answer."""
    radiance = lively(transport.environment_shape)
    painter = _Painter(transport, radiance)
    luminance = radiance @ np.asarray(transport.header.luminance_weights, np.float32)
    full = transport.luminance_basis[transport.face] @ transport.texel_basis
    channels = [matrix(transport, c) for c in range(3)]
    flat = np.ascontiguousarray(radiance.reshape(-1, 3).T)
    weights = painter.session.weights.weights[transport.face].astype(np.float32)
    root = np.ones_like(weights)

    def plain() -> None:
        assert (weights @ full).size
        plain_match(full, weights[None], root, luminance)
        assert all((channels[c] @ flat[c]).size for c in range(3))

    brush = int(0.16 * painter.session.canvas.size) ** 2
    rows = brush // (painter.session.canvas.size // transport.size) ** 2
    touched = (
        2 * brush * 6 * 4  # both sides of the face: layers before and after, coverage
        + 2 * rows * transport.luminance_basis.shape[1] * 4
        + transport.texel_basis.nbytes
        + transport.header.rank * TURNS * 8
        + 3 * len(transport.pixels) * 3 * 4
    )
    return Case("paint.segment", painter, plain, "f @ T, 64 products T @ L, picture", touched)
