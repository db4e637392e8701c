"""Time the search of a second light against the plain loop of eq. 7."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.second_light.added_light import AddedLight, from_captured
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, make_lamp, place_lamp
from app.core.second_light.contrast import prepare_face
from app.core.second_light.lamp_tables import LampTables, lamp_tables, see_place
from app.core.second_light.placements import COUNT
from app.core.second_light.search_kernel import seek
from app.core.solver.relighting_cache import normalised
from benchmarks.speed.timing.runner.rows import Case
from benchmarks.speed.timing.search import lively

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.core.base.progress import Token
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack
    from benchmarks.speed.timing.runner.rows import Work

Float32: TypeAlias = NDArray[np.float32]

_SHAPE: Final = (256, 512)
_HALF_DEG: Final = (7.0, 14.0)  # of the lamp's face: a phone 30 cm away


def light_cases(transport: Transport, pack: StylePack, token: Token) -> Iterator[Case]:
    """Yield the full search of a second light, 36,864 combinations per style.

    The lamp is prepared before. The plain loop composites and multiplies literally as in eq. 7; one
    in 64 of its combinations is timed.

    Yields:
        ``light.one`` and ``light.all``, one style and all by quality, and ``light.match``, all by
        match.
    """
    face = prepare_face(transport, pack.region_on(transport))
    added = from_captured(transport, place_lamp(_lamp()), token, face=face)
    tables = lamp_tables(pack, transport, added)
    radiance = lively(pack.header.environment)
    light, scale = normalised(radiance, pack.header.environment)
    every = range(len(pack.styles))
    target = _target(pack)

    def by_quality(rows: range) -> object:
        return seek(tables, see_place(tables, light, scale, targets=True), rows, "paper")

    def by_match() -> object:
        return seek(tables, see_place(tables, light, scale), every)

    calls: tuple[tuple[str, Work, int, int], ...] = (
        ("light.one", lambda: by_quality(range(1)), 1, 1),
        ("light.all", lambda: by_quality(every), len(every), len(every)),
        ("light.match", by_match, len(every), len(tables.lamp_products)),
    )
    for name, fast, styles, lines in calls:
        yield Case(
            name,
            fast,
            lambda: _plain(target, added, radiance),
            "per combination: composite, dot" if styles == 1 else "the same, every style",
            _touched(tables, lines, match=name == "light.match"),
            share=1.0 / (TURNS * styles),
            rounds=3,
            least=1,
            most=40,
        )


def _lamp() -> CapturedLamp:
    """Return a white screen straight in front, in a room without light."""
    height, width = _SHAPE
    azimuth = np.abs(360.0 * ((np.arange(width) + 0.5) / width - 0.5))
    elevation = np.abs(90.0 - 180.0 * (np.arange(height) + 0.5) / height)
    alpha = np.outer(elevation <= _HALF_DEG[1], azimuth <= _HALF_DEG[0]).astype(np.float32)
    return make_lamp("screen", 600.0 * np.repeat(alpha[..., None], 3, axis=2), alpha)


def _target(pack: StylePack) -> Float32:
    """Return a style's target for coloured light, (H, W, 3)."""
    first = pack.target_rows[0].astype(np.float64)
    height = pack.header.environment[0]
    target = pack.mixing[0][:, None, None] * first[:height]
    second = np.einsum("kh,kw->hw", pack.mixtures, first[height:])
    target = target + pack.mixing[1][:, None, None] * second
    return np.ascontiguousarray(target.transpose(1, 2, 0)).astype(np.float32)


def _plain(target: Float32, added: AddedLight, radiance: Float32) -> float:
    """Evaluate every 64th combination of one style, literally as in eq. 7."""
    lamp, best = added.light, 0.0
    assert lamp is not None
    for number in range(COUNT):
        turned = np.roll(radiance, -(number % TURNS), axis=1)
        light = lamp[number] + (1.0 - added.alpha[number])[..., None] * turned
        best = max(best, float(np.dot(target.ravel(), light.ravel())))
    return best


def _touched(tables: LampTables, lines: int, *, match: bool) -> int:
    """Return the minimum number of bytes read and written."""
    touched = 8 * TURNS * COUNT * lines
    hidden = tables.hidden_face if match else tables.hidden_whole
    touched += sum(int(table[0].nbytes) for table in hidden) * lines
    if match:
        touched += sum(int(table.nbytes) for table in tables.lamp_light.contrast.hidden)
    return touched
