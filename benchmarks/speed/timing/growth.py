"""Growth of the cost with the number of styles, of turns, of texels and of frames."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from app.core.base.angles import TURNS
from app.core.environment.environment import SHAPE, from_radiance, reduce_radiance
from app.core.measure.bracket.measure import measure
from app.core.solver.place_light import picture_at, pictures_at, prepare
from app.core.solver.search import build_tables, curves
from benchmarks.answers.evaluation.report.svg import Series, growth_plot
from benchmarks.speed.timing.merge import debevec, decoded, make_bracket
from benchmarks.speed.timing.runner.machine import describe_machine, load_average
from benchmarks.speed.timing.runner.rows import clock
from benchmarks.speed.timing.search import lively, plain_quality

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from app.core.base.progress import PhraseReport, Token
    from app.core.solver.place_light import PlaceLight
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack
    from benchmarks.speed.timing.runner.rows import Work

Sizes: TypeAlias = tuple[float, ...]

_STYLES: Final = (1, 2, 4, 9, 18, 36, 72, 144)
_TURNS: Final = (1, 2, 4, 8, 16, 32, 64)
_ROWS: Final = (16, 32, 64, 128, 256)  # of the search's light
_WIDTHS: Final = (128, 256, 512, 1024, 2048, 4096, 8192)
_FRAMES: Final = ((0.0, -2.0), (0.0, 2.0, -2.0), tuple(range(-3, 2)), tuple(range(-6, 3)))
_MANY: Final = tuple(range(-9, 4))
_FRAME_SHAPE: Final = (1344, 2688)
_BUDGET_S: Final = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """Time of one operation at several sizes."""

    name: str
    sizes: Sizes
    axis: str
    series: dict[str, Sizes]

    @property
    def slope(self) -> float:
        """Exponent of the program's own cost by size, over the larger half."""
        half = max(min(len(self.sizes) // 2, len(self.sizes) - 2), 0)
        own = next(iter(self.series.values()))
        return float(np.polyfit(np.log(self.sizes[half:]), np.log(own[half:]), 1)[0])


def grow(
    transport: Transport,
    pack: StylePack,
    report: PhraseReport,
    token: Token,
    *,
    shape: tuple[int, int] = _FRAME_SHAPE,
) -> tuple[Growth, ...]:
    """Measure the growth of the cost.

    Args:
        shape: Rows and columns of the bracket's frames.

    Returns:
        ``styles``, ``turns``, ``light`` (size of the search's light), ``panorama`` (size of its
        source), ``frames``.
    """
    works: dict[str, Callable[[], Growth]] = {
        "styles": lambda: _by_styles(pack, token),
        "turns": lambda: _by_turns(transport, token),
        "light": lambda: _by_light(pack, token),
        "panorama": lambda: _by_panorama(token),
        "frames": lambda: _by_frames(pack, token, shape),
    }
    found = []
    for done, (name, work) in enumerate(works.items()):
        report(done / len(works), name)
        found.append(work())
    report(1.0, "done")
    return tuple(found)


def growth_svg(growth: Growth) -> str:
    """Draw one on logarithmic axes; a whole SVG file."""
    series = [
        Series(name, [1e3 * value for value in values]) for name, values in growth.series.items()
    ]
    return growth_plot(growth.sizes, series, (growth.axis, "milliseconds"))


def growth_json(found: Sequence[Growth], head: str) -> dict[str, Any]:
    """Convert the measurements to plain values for saving and printing."""
    return {
        "head": head,
        "machine": describe_machine() | {"load_after": load_average()},
        "growth": [
            {
                "name": one.name,
                "axis": one.axis,
                "sizes": list(one.sizes),
                "power": round(one.slope, 3),
                "seconds": {name: list(values) for name, values in one.series.items()},
            }
            for one in found
        ],
    }


def _measured(
    name: str,
    axis: str,
    sizes: Sequence[float],
    cases: Iterator[dict[str, Work]],
    token: Token,
) -> Growth:
    """Time every way at every size; `cases` yields one size after another."""
    series: dict[str, list[float]] = {}
    for works in cases:
        for way, work in works.items():
            token.check()
            times = [t for _ in range(2) for t in clock(work, _BUDGET_S, least=2, most=500)]
            series.setdefault(way, []).append(min(times))
    values = {way: tuple(times) for way, times in series.items()}
    return Growth(name, tuple(map(float, sizes)), axis, values)


def _by_styles(pack: StylePack, token: Token) -> Growth:
    light = lively(SHAPE).mean(axis=2)
    seen = pack.project(light)

    def cases() -> Iterator[dict[str, Work]]:
        for count in _STYLES:
            rows = np.resize(pack.target_rows, (count, *pack.target_rows.shape[1:]))
            tables = build_tables(
                rows,
                pack.mean_rows,
                pack.basis_even,
                pack.basis_odd,
                paired=pack.header.paired,
                others=np.concatenate([pack.area_rows, pack.face_rows]),
            )
            plain = np.resize(pack.preintegrated, (count, *SHAPE))
            yield {
                "here": partial(curves, tables, seen),
                "roll and dot": partial(plain_quality, plain, light),
            }

    return _measured("styles", "styles, at 64 turns each", _STYLES, cases(), token)


def _by_turns(transport: Transport, token: Token) -> Growth:
    light = prepare(from_radiance(lively((256, 512)), "lively"))

    def cases() -> Iterator[dict[str, Work]]:
        for count in _TURNS:
            turns = [360.0 * k / count for k in range(count)]
            yield {
                "here": partial(pictures_at, transport, light, turns),
                "one by one": partial(_one_by_one, transport, light, turns),
            }

    return _measured("turns", "pictures, each at its own turn", _TURNS, cases(), token)


def _by_light(pack: StylePack, token: Token) -> Growth:
    chance = np.random.default_rng(0)
    styles = len(pack.styles)
    even, odd = len(pack.basis_even), len(pack.basis_odd)

    def cases() -> Iterator[dict[str, Work]]:
        for height in _ROWS:
            width = 2 * height
            targets = chance.standard_normal((styles, height, width)).astype(np.float32)
            halves = chance.standard_normal((even + odd, height, height)).astype(np.float32)
            tables = build_tables(targets, targets[0], halves[:even], halves[even:])
            light = lively((height, width)).mean(axis=2)
            yield {
                "here": partial(curves, tables, light),
                "roll and dot": partial(plain_quality, targets, light, max(width // TURNS, 1)),
            }

    texels = [2 * height * height for height in _ROWS]
    return _measured("light", "texels of the light searched", texels, cases(), token)


def _by_panorama(token: Token) -> Growth:
    def cases() -> Iterator[dict[str, Work]]:
        for width in _WIDTHS:
            panorama = np.resize(lively((64, 128)), (width // 2, width, 3))
            copy = np.empty_like(panorama)
            yield {
                "here": partial(reduce_radiance, panorama, SHAPE),
                "copying it": partial(np.copyto, copy, panorama),
            }

    texels = [width * width / 2e6 for width in _WIDTHS]
    return _measured("panorama", "million texels of the panorama reduced", texels, cases(), token)


def _by_frames(pack: StylePack, token: Token, shape: tuple[int, int]) -> Growth:
    stops = [*_FRAMES, _MANY]

    def cases() -> Iterator[dict[str, Work]]:
        for wanted in stops:
            with tempfile.TemporaryDirectory() as folder:
                bracket = make_bracket(Path(folder), [float(s) for s in wanted], shape)
                yield {
                    "here": partial(measure, bracket.files, token=token),
                    "OpenCV": partial(debevec, bracket),
                    "decoding alone": partial(decoded, bracket),
                }

    axis = f"frames of {shape[1]} x {shape[0]}"
    return _measured("frames", axis, [len(wanted) for wanted in stops], cases(), token)


def _one_by_one(transport: Transport, light: PlaceLight, turns: Sequence[float]) -> object:
    return [picture_at(transport, light, turn) for turn in turns]
