"""A tone curve for each frame, where no one curve explains the bracket: phones that tone-map.

What the eye likes is chosen by such a camera for every frame by itself. So each frame k gets a
curve of its own, log2 radiance = sRGB(z) - stops_k + d_k(z), all of them by one linear
least-squares problem from the codes that match between frames (`app.core.hdr.brightness_transfer`).
The frames leave open what monotone function of the radiance they agree on, and a flatter one always
makes them agree better. So what saturates a frame is held near its stated exposure, and the mean of
all d_k near 0: a camera that brightens one frame and darkens another does so around sRGB.

Curves that differ from place to place besides darken what is clipped, to codes well under 255; such
codes count as clipped.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.hdr.response_recovery import srgb_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Float64, Int64
    from app.core.hdr.brightness_transfer import CodeMatches

_NODES: Final = 14
_TOE: Final = 0.05
# Stops by which curves depart from sRGB at a node, and by which they bend between three of them.
_DEPARTS: Final = 1.0
_BENDS: Final = 0.25
# Stops by which white departs from the stated exposure, and by which the mean curve does from sRGB.
_WHITE: Final = 0.1
_MEAN: Final = 0.3
# What rows of compressed frames are systematically off, in stops and in codes; neighbouring codes
# are off alike, so that only every so many rows count.
_FLOOR_STOPS: Final = 0.03
_FLOOR_CODES: Final = 0.3
_ALIKE: Final = 16.0
_CAUCHY: Final = 3.0
_ROUNDS: Final = 8
_LEAST_RISE: Final = 0.2  # of sRGB's between two codes


def recover_own_curves(
    matches: CodeMatches, stops: Sequence[float]
) -> tuple[Float64, tuple[float, ...]]:
    """Recover each frame's curve, at stated exposures that fall.

    Returns tables, (K, 3, 256) float64: linear light of each code of each frame, rising from 0
    to 1, the same for all channels, 1 from the code on that `CodeMatches.whites` names; and the
    exposures that go with them, what saturates each frame.
    """
    frames = len(stops)
    white = np.minimum(matches.whites or [255] * frames, 255)
    base = np.log2(srgb_table()[1:])
    design, wanted, variance = _equations(
        matches.where(matches.code < white[matches.bright]), stops
    )
    prior, home = _prior(white, base)
    unknowns = np.zeros(frames * _NODES)
    for _ in range(_ROUNDS):
        off = wanted - design @ unknowns
        weighted = design.T / (variance * _ALIKE * (1.0 + off**2 / variance / _CAUCHY**2))
        pull = weighted @ wanted + home
        unknowns = np.asarray(np.linalg.solve(weighted @ design + prior, pull), np.float64)
    departs = unknowns.reshape(frames, _NODES) @ _hats().T
    logs = _rising(base + departs, base) - np.asarray(stops)[:, None]
    ends = logs[np.arange(frames), white - 1]
    tables = np.zeros((frames, 3, 256))
    tables[:, :, 1:] = np.exp2(np.minimum(logs - ends[:, None], 0.0))[:, None]
    return tables, tuple(float(-end) for end in ends)


def _equations(matches: CodeMatches, stops: Sequence[float]) -> tuple[Float64, Float64, Float64]:
    """Return the design, (R, unknowns), what it has to give, (R,), and its variance, (R,)."""
    hats, base = _hats(), np.log2(srgb_table()[1:])
    bright = matches.code - 1
    dark = np.clip(matches.dark_code, 1.0, 255.0)
    below = np.minimum(dark.astype(np.int64), 254) - 1
    part = np.log2(dark / (below + 1)) / np.log2((below + 2) / (below + 1.0))
    hat_dark = hats[below] * (1.0 - part)[:, None] + hats[below + 1] * part[:, None]
    base_dark = base[below] * (1.0 - part) + base[below + 1] * part
    rows = np.zeros((len(matches), len(stops), _NODES))
    index = np.arange(len(matches))
    rows[index, matches.bright] += hats[bright]
    rows[index, matches.dark] -= hat_dark
    wanted = matches.steps(stops) - (base[bright] - base_dark)
    slope = base[below + 1] - base[below]
    codes = np.maximum(matches.scatter, 0.5) ** 2 / matches.places + _FLOOR_CODES**2
    return rows.reshape(len(matches), -1), wanted, slope**2 * codes + _FLOOR_STOPS**2


def _hats() -> Float64:
    """Return what each node adds to each code from 1 on, (255, nodes)."""
    codes = np.arange(1, 256) / 255.0
    place = np.log1p(codes / _TOE) / np.log1p(1.0 / _TOE)
    nodes = np.linspace(0.0, 1.0, _NODES)
    return np.column_stack([np.interp(place, nodes, row) for row in np.eye(_NODES)])


def _prior(white: Int64, base: Float64) -> tuple[Float64, Float64]:
    """Quadratic form of what is unlikely, and its pull, given what code each frame clips at."""
    frames = len(white)
    bend = np.diff(np.eye(_NODES), 2, axis=0)
    form = np.kron(np.eye(frames), bend.T @ bend / _BENDS**2 + np.eye(_NODES) / _DEPARTS**2)
    form += np.kron(np.full((frames, frames), (1.0 / frames / _MEAN) ** 2), np.eye(_NODES))
    ends = np.kron(np.eye(frames), np.ones(_NODES)) * np.tile(_hats()[white - 1], frames)
    return form + ends.T @ ends / _WHITE**2, ends.T @ -base[white - 1] / _WHITE**2


def _rising(logs: Float64, base: Float64) -> Float64:
    """Let every curve rise, from its middle to both ends."""
    least = _LEAST_RISE * np.diff(base)
    rise = np.maximum(np.diff(logs, axis=1), least)
    middle = logs.shape[1] // 2
    run = np.concatenate([np.zeros((len(logs), 1)), np.cumsum(rise, axis=1)], axis=1)
    result: Float64 = run - run[:, middle : middle + 1] + logs[:, middle : middle + 1]
    return result
