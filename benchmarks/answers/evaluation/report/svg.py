"""Plots as inline SVG: lines, histograms and bars, in the colours of the surrounding page.

Colours are CSS variables of the page, with a fallback for viewers without them.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

COLOURS: Final = ("#2f7d4f", "#c8442d", "#2b62b8", "#8a5fb0", "#b0791a", "#4d8a99")
_WIDTH: Final = 640
_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 14, 14, 44


@dataclass(frozen=True, slots=True)
class Series:
    """One line or group of bars."""

    name: str
    values: Sequence[float]


@dataclass(frozen=True, slots=True)
class _Frame:
    """Positions of numbers in the plot."""

    x: tuple[float, float]
    y: tuple[float, float]
    height: int

    def at(self, x: float, y: float) -> tuple[float, float]:
        across = (x - self.x[0]) / max(self.x[1] - self.x[0], 1e-12)
        up = (y - self.y[0]) / max(self.y[1] - self.y[0], 1e-12)
        wide, high = _WIDTH - _LEFT - _RIGHT, self.height - _TOP - _BOTTOM
        return _LEFT + across * wide, self.height - _BOTTOM - up * high


def lines(
    x: NDArray[np.float64], series: Sequence[Series], labels: tuple[str, str], height: int = 240
) -> str:
    """Draw curves over turns.

    Args:
        x: (n,) float64. Ascending, deg.
        height: Height of the plot, px.
    """
    every = np.concatenate([np.asarray(one.values, np.float64) for one in series])
    low, high = float(every.min()), float(every.max())
    frame = _Frame((float(x[0]), float(x[-1])), (low, high + 0.05 * (high - low)), height)
    parts = [_axes(frame, _nice(frame.x), _nice(frame.y), labels)]
    for number, one in enumerate(series):
        points = " ".join(
            f"{a:.1f},{b:.1f}"
            for a, b in (frame.at(u, v) for u, v in zip(x, one.values, strict=True))
        )
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{COLOURS[number % 6]}" '
            f'stroke-width="{3.4 - 1.1 * min(number, 2):.1f}" stroke-linejoin="round"/>'
        )
    parts.append(_legend([one.name for one in series]))
    return _svg(parts, height)


def histogram(
    series: Sequence[Series],
    edges: NDArray[np.float64],
    labels: tuple[str, str],
    height: int = 240,
) -> str:
    """Draw a histogram of values; those beyond the last edge count in the last bin.

    Args:
        edges: (n + 1,) float64. Ascending.
        height: Height of the plot, px.
    """
    inside = [np.clip(np.asarray(s.values, np.float64), edges[0], edges[-1] - 1e-9) for s in series]
    counts = [np.histogram(values, edges)[0] for values in inside]
    most = max(1.0, *(float(c.max()) for c in counts))
    frame = _Frame((float(edges[0]), float(edges[-1])), (0.0, 1.06 * most), height)
    parts = [_axes(frame, _nice(frame.x), _nice(frame.y), labels)]
    for number, count in enumerate(counts):
        for k, value in enumerate(count):
            wide = (edges[k + 1] - edges[k]) / len(series)
            begin = edges[k] + number * wide
            parts.append(_bar(frame, (begin, begin + wide), float(value), number))
    parts.append(_legend([one.name for one in series]))
    return _svg(parts, height)


def bars(names: Sequence[str], series: Sequence[Series], label: str, limit: float = 0.0) -> str:
    """Draw horizontal bars, one per series for each name, and a line at a limit."""
    thick, gap, left, right = 7, 9, 150, 20
    row = thick * len(series) + gap
    height = row * len(names) + _TOP + _BOTTOM
    values = np.array([one.values for one in series], np.float64)
    top = max(float(np.nanmax(values)) if np.isfinite(values).any() else 1.0, limit) * 1.05
    scale = (_WIDTH - left - right) / top
    parts = []
    for tick in _nice((0.0, top)):
        x = left + tick * scale
        parts.append(_line((x, _TOP), (x, height - _BOTTOM), "grid"))
        parts.append(_text((x, height - _BOTTOM + 16), f"{tick:g}", "middle"))
    for k, name in enumerate(names):
        y = _TOP + row * k
        parts.append(_text((left - 8, y + row / 2), name, "end"))
        for number, value in enumerate(values[:, k]):
            if np.isfinite(value):
                parts.append(
                    f'<rect x="{left}" y="{y + gap / 2 + thick * number:.1f}" '
                    f'width="{max(value * scale, 0.5):.1f}" height="{thick - 1}" '
                    f'fill="{COLOURS[number % 6]}"/>'
                )
    if limit > 0:
        x = left + limit * scale
        parts.append(_line((x, _TOP), (x, height - _BOTTOM), "limit"))
    middle = left + (_WIDTH - left - right) / 2
    parts.append(_text((middle, height - 8), label, "middle"))
    return _svg(parts, height) + _key([one.name for one in series])


def growth_plot(
    sizes: Sequence[float], series: Sequence[Series], labels: tuple[str, str], height: int = 300
) -> str:
    """Draw growth on logarithmic axes: a power of the size is a straight line.

    Args:
        height: Height of the plot, px.

    Returns:
        The plot, for light and dark backgrounds, inside a page and by itself.
    """
    x = np.log10(np.asarray(sizes, np.float64))
    every = np.log10(np.concatenate([np.asarray(one.values, np.float64) for one in series]))
    low, high = np.floor(every.min()), np.ceil(every.max() + 0.1)  # the legend needs some room
    frame = _Frame((float(x[0]), float(x[-1])), (float(low), float(high)), height)
    up = [float(k) for k in range(int(low), int(high) + 1)]
    parts = [_axes(frame, [float(k) for k in x], up, labels, lambda k: _number(_short(10.0**k)))]
    for number, one in enumerate(series):
        places = [frame.at(u, v) for u, v in zip(x, np.log10(one.values), strict=True)]
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
        colour = COLOURS[number % 6]
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>'
        )
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colour}"/>' for a, b in places]
    parts.append(_legend([one.name for one in series]))
    return _svg(parts, height)


def _short(value: float) -> float:
    """Round to three digits, enough beside an axis."""
    return float(f"{value:.3g}")


def _svg(parts: Sequence[str], height: int) -> str:
    return (
        f'<svg viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" height="{height}" role="img" '
        'xmlns="http://www.w3.org/2000/svg" font-family="Inter, Helvetica, Arial, sans-serif" '
        f'font-size="12" fill="#888">{"".join(parts)}</svg>'
    )


def _axes(
    frame: _Frame,
    across: Sequence[float],
    up: Sequence[float],
    labels: tuple[str, str],
    words: Callable[[float], str] | None = None,
) -> str:
    words = _number if words is None else words
    parts = []
    for tick in up:
        x, y = frame.at(frame.x[0], tick)
        parts.append(_line((x, y), (_WIDTH - _RIGHT, y), "grid"))
        parts.append(_text((x - 6, y + 4), words(tick), "end"))
    for tick in across:
        x, y = frame.at(tick, frame.y[0])
        parts.append(_line((x, y), (x, y + 4), "axis"))
        parts.append(_text((x, y + 17), words(tick), "middle"))
    x, y = frame.at(frame.x[0], frame.y[0])
    parts.append(_line((x, y), (_WIDTH - _RIGHT, y), "axis"))
    parts.append(_text(((_LEFT + _WIDTH - _RIGHT) / 2, frame.height - 6), labels[0], "middle"))
    middle = (frame.height - _BOTTOM + _TOP) / 2
    parts.append(
        f'<text x="14" y="{middle:.0f}" text-anchor="middle" '
        f'transform="rotate(-90 14 {middle:.0f})">{escape(labels[1])}</text>'
    )
    return "".join(parts)


def _bar(frame: _Frame, across: tuple[float, float], value: float, number: int) -> str:
    x0, y0 = frame.at(across[0], value)
    x1, y1 = frame.at(across[1], 0.0)
    return (
        f'<rect x="{x0 + 0.5:.1f}" y="{y0:.1f}" width="{max(x1 - x0 - 1, 0.5):.1f}" '
        f'height="{max(y1 - y0, 0.0):.1f}" fill="{COLOURS[number % 6]}"/>'
    )


def _legend(names: Sequence[str]) -> str:
    if len(names) < 2:
        return ""
    parts, x = [], float(_WIDTH - _RIGHT)
    for number in range(len(names) - 1, -1, -1):
        x -= 7.0 * len(names[number]) + 22
        colour = COLOURS[number % 6]
        parts.append(f'<rect x="{x:.0f}" y="{_TOP - 8}" width="10" height="10" fill="{colour}"/>')
        parts.append(_text((x + 14, _TOP + 1), names[number], "start"))
    return "".join(parts)


def _key(names: Sequence[str]) -> str:
    """Return the legend as HTML, for plots with a long one."""
    words = (
        f'<span><i style="background:{COLOURS[k % 6]}"></i>{escape(name)}</span>'
        for k, name in enumerate(names)
    )
    return f'<p class="key">{"".join(words)}</p>'


def _line(a: tuple[float, float], b: tuple[float, float], kind: str) -> str:
    stroke, width = {
        "grid": ("#8884", 1.0),
        "axis": ("#888", 1.0),
        "limit": ("#c8442d", 1.5),
    }[kind]
    opacity = ' stroke-opacity="0.25"' if kind == "grid" else ""
    return (
        f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" '
        f'stroke="{stroke[:4]}" stroke-width="{width}"{opacity}/>'
        if kind != "limit"
        else f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" '
        f'stroke="{stroke}" stroke-width="{width}" stroke-dasharray="4 3"/>'
    )


def _text(at: tuple[float, float], words: str, anchor: str) -> str:
    return f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" text-anchor="{anchor}">{escape(words)}</text>'


def _number(value: float) -> str:
    return f"{value:g}".replace("-", "−")


def _nice(span: tuple[float, float]) -> list[float]:
    """Return about six round numbers within a span; multiples of 45 for a full turn."""
    low, high = span
    if high - low >= 300:
        step = 45.0
    else:
        rough = max(high - low, 1e-12) / 6
        power = 10.0 ** np.floor(np.log10(rough))
        step = float(next(power * f for f in (1, 2, 5, 10) if power * f >= rough))
    first = int(np.ceil(low / step - 1e-9))
    last = int(np.floor(high / step + 1e-9))
    return [round(k * step, 10) for k in range(first, last + 1)]
