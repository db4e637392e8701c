"""Timing the search of a second light beside the loop that eq. 7 asks for."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.angles import TURNS
from app.core.bench import Row
from app.core.light_table import normalised
from app.core.second_light.added import AddedLight, from_captured
from app.core.second_light.captured import CapturedLamp, make_lamp, placed
from app.core.second_light.lamp_tables import LampTables, lamp_tables, see_place
from app.core.second_light.placements import COUNT
from app.core.second_light.seeking import seek

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.pack import StylePack
    from app.core.progress import Report, Token
    from app.core.transport import Transport

__all__ = ["run_light"]

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_ROUNDS: Final = 3
_CALLS: Final = 40
_BUDGET_S: Final = 1.0
_SHAPE: Final = (256, 512)
_HALF_DEG: Final = (7.0, 14.0)  # of the lamp's face: a telephone 30 cm away
_SEED: Final = 7


def run_light(
    pack: StylePack, transport: Transport, report: Report, token: Token, speed: float
) -> tuple[Row, ...]:
    """Time the full search of a second light, 36,864 combinations a style.

    Parameters
    ----------
    pack : StylePack
        Head and styles.
    transport : Transport
        The pack was made from.
    report : Report
        Told what is being timed.
    token : Token
        Checked between rounds.
    speed : float
        Memory bandwidth, bytes per second.

    Returns
    -------
    tuple of Row
        ``light.one`` and ``light.all``, one style and all by quality, and ``light.match``, all
        by match. The lamp is prepared before. The plain loop composites and multiplies as eq. 7
        reads; one in 64 of its combinations is timed.
    """
    report(0.0, "light")
    added = from_captured(transport, placed(_lamp()), token)
    tables = lamp_tables(pack, transport, added)
    rng = np.random.default_rng(_SEED)
    radiance = np.exp(1.5 * rng.standard_normal((*pack.header.environment, 3))).astype(np.float32)
    light, scale = normalised(radiance, pack.header.environment)
    every = range(len(pack.styles))

    def by_quality(rows: range) -> object:
        return seek(tables, see_place(tables, light, scale, targets=True), rows, "paper")

    def by_match() -> object:
        return seek(tables, see_place(tables, light, scale), every)

    calls: dict[str, tuple[Callable[[], object], int, int]] = {
        "light.one": (lambda: by_quality(range(1)), 1, 1),
        "light.all": (lambda: by_quality(every), len(every), len(every)),
        "light.match": (by_match, len(every), len(tables.lit)),
    }
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in calls}
    for turn in range(_ROUNDS):
        for name, (call, styles, _) in calls.items():
            token.check()
            report(turn / _ROUNDS, name)
            plain = _plain(tables, added, radiance, styles)
            found[name].append((*_time(call), plain))
    rows = []
    for name, (_, styles, lines) in calls.items():
        best, median, plain = np.min(found[name], axis=0).tolist()
        touched = _touched(tables, lines, match=name == "light.match")
        plainly = "per combination: composite, dot" if styles == 1 else "the same, every style"
        rows.append(Row(name, best, median, plain, touched / speed, plainly))
    report(1.0, "done")
    return tuple(rows)


def _lamp() -> CapturedLamp:
    """Make a white screen straight in front, in a room without any light."""
    height, width = _SHAPE
    azimuth = np.abs(360.0 * ((np.arange(width) + 0.5) / width - 0.5))
    elevation = np.abs(90.0 - 180.0 * (np.arange(height) + 0.5) / height)
    alpha = np.outer(elevation <= _HALF_DEG[1], azimuth <= _HALF_DEG[0]).astype(np.float32)
    return make_lamp("screen", 600.0 * np.repeat(alpha[..., None], 3, axis=2), alpha)


def _plain(tables: LampTables, added: AddedLight, radiance: Float32, styles: int) -> float:
    """Time the plain loop: every 64th combination of one style, and as often as there are."""
    pack = tables.pack
    lamp = added.light
    assert lamp is not None
    first = pack.target_rows[0].astype(np.float64)
    height = pack.header.environment[0]
    target = pack.mixing[0][:, None, None] * first[:height]
    second = np.einsum("kh,kw->hw", pack.mixtures, first[height:])
    target = np.ascontiguousarray(
        (target + pack.mixing[1][:, None, None] * second).transpose(1, 2, 0)
    )
    target = target.astype(np.float32)
    start = time.perf_counter()
    for number in range(COUNT):
        turn = number % TURNS
        turned = np.roll(radiance, -turn, axis=1)
        light = lamp[number] + (1.0 - added.alpha[number])[..., None] * turned
        np.dot(target.ravel(), light.ravel())
    return (time.perf_counter() - start) * TURNS * styles


def _touched(tables: LampTables, lines: int, *, match: bool) -> int:
    """Bytes read and written at least."""
    touched = 8 * TURNS * COUNT * lines
    touched += sum(int(table[0].nbytes) for table in tables.hidden) * lines
    if match:
        touched += sum(int(table.nbytes) for table in tables.added.contrast.hidden)
    return touched


def _time(call: Callable[[], object]) -> tuple[float, float]:
    call()
    times: list[float] = []
    stop = time.perf_counter() + _BUDGET_S
    while len(times) < 3 or (time.perf_counter() < stop and len(times) < _CALLS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times), float(np.median(times))
