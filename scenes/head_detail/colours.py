"""The variation of the skin's colour, relative to its tone.

Every rule is a function of position, so it can be evaluated at any point of the skin: a mesh with 3
mm between its vertices is too coarse for the border of a lip. Rules use the frame of `Head.local`,
where 0.01 is a millimetre on the generic head.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from scenes.head_detail.brows import brow_weight
from scenes.head_detail.hairline import hair_weight
from scenes.head_detail.heads import MM, Floats, Head, load
from scenes.head_detail.noise import fractal, noise
from scenes.head_detail.outline import signed_distance, smooth, step

_LEAST, _MOST = 0.3, 1.3
_LEVEL = (1.055, 1.125, 1.125)
"""Restores the mean over the face to about 1, since most tints darken."""
_LIP = (0.94, 0.64, 0.65)
_SLIT = (0.50, 0.32, 0.33)
_RED = (1.02, 0.92, 0.91)
_EAR = (1.02, 0.84, 0.82)
_YELLOW = (1.02, 1.00, 0.93)
_UNDER_EYE = (0.94, 0.90, 0.92)
_LID = (0.98, 0.91, 0.90)
_NOSTRIL = (0.45, 0.30, 0.30)
_BROW = (0.80, 0.77, 0.75)
_BEARD = (0.76, 0.80, 0.84)
_SCALP = (0.42, 0.38, 0.35)
_PORES = 0.18
_WHITE = (0.76, 0.71, 0.70)
"""Relative to the mesh's own white: L* of about 74 instead of 83, for vessels and tears."""
_LIMBUS = (5.8 * MM, 6.5 * MM)


def head_colours(name: str, *, beard: bool = False, scalp: bool = True) -> NDArray[np.float32]:
    """Return the relative albedo of each vertex of a head's skin, (V, 3)."""
    head = load(name)
    return relative_albedo(name, head.vertices, head.normals, beard=beard, scalp=scalp)


def relative_albedo(
    name: str, positions: Floats, normals: Floats, *, beard: bool = False, scalp: bool = True
) -> NDArray[np.float32]:
    """Return the factor on the skin tone's linear RGB at points of the skin, (N, 3), in [0.3, 1.3].

    Args:
        positions, normals: (N, 3). Head units; unit length.
        beard: Add the shadow of a shaved beard.
        scalp: Darken the skin under the hair, so that gaps between strands do not shine.
    """
    head = load(name)
    positions = np.asarray(positions, np.float64)
    local = head.local(positions)
    colour = np.tile(_LEVEL, (len(local), 1))
    for weight, tint in _regions(head, positions, np.asarray(normals, np.float64), local):
        _tint(colour, weight, tint)
    if beard:
        _tint(colour, _beard(head, positions, local), _BEARD)
    if scalp:
        _tint(colour, 0.9 * hair_weight(head, positions), _SCALP)
    colour *= _mottling(positions / head.scale)
    lips, slit = _lips(head, positions)
    _tint(colour, lips, _LIP)
    _tint(colour, slit, _SLIT)
    return colour.clip(_LEAST, _MOST).astype(np.float32)


def eye_albedo(name: str, positions: Floats) -> NDArray[np.float32]:
    """Return the factor on the eye mesh's colours at points of either eye, (N, 3)."""
    eye, colour = load(name).eye, np.ones((len(positions), 3))
    away = np.hypot(np.abs(positions[:, 0]) - eye[0], positions[:, 1] - eye[1])
    _tint(colour, step(away, *_LIMBUS), _WHITE)
    return colour.astype(np.float32)


def lip_distance(head: Head, positions: Floats) -> Floats:
    """Return the distance to the lips' border, (N,), seen from the front, positive on the lips."""
    distance = np.full(len(positions), -1.0)
    near = np.abs(positions[:, :2] - head.mouth[:2]).max(axis=1) < 0.4
    near &= positions[:, 2] > head.mouth[2] - 0.25
    flat = np.stack([np.abs(positions[near, 0]), positions[near, 1]], axis=1)
    distance[near] = signed_distance(flat, _lip_outline(head.name))
    return distance


@cache
def _lip_outline(name: str) -> Floats:
    head = load(name)
    line = smooth(head.lips[:, :2], 160, 5.0)
    # The mesh's loop runs around the corners of the mouth; the red of the lips tapers to them.
    out = step(line[:, 0] / line[:, 0].max(), 0.55, 1.0)
    above = line[:, 1] > head.mouth[1]
    line[:, 1] -= (line[:, 1] - head.mouth[1]) * out * np.where(above, 0.45, 0.75)
    return line


def _tint(colour: Floats, weight: Floats, tint: tuple[float, float, float]) -> None:
    """Multiply colours by `tint`, weighted by `weight` (N,)."""
    colour *= 1.0 + weight[:, None] * (np.array(tint) - 1.0)


def _blob(local: Floats, centre: Floats, size: tuple[float, float, float]) -> Floats:
    """Return a soft ellipsoid: 1 in its centre, 0.6 at `size`."""
    away = (local - centre) / np.array(size)
    weight: Floats = np.exp(-0.5 * np.einsum("ij,ij->i", away, away))
    return weight


def _regions(
    head: Head, positions: Floats, normals: Floats, local: Floats
) -> list[tuple[Floats, tuple[float, float, float]]]:
    """Return weights (N,) and tints of the face's parts, except lips and hair."""
    eye_x = head.eye[0] / head.scale
    nose = head.local(head.nose[None])[0]
    chin = head.local(head.mouth[None])[0] + np.array([0.0, -0.32, 0.0])
    ear = head.local(head.ear)
    cheek = np.array([eye_x + 0.14, 0.55 * nose[1], 0.05])
    facing = step(normals[:, 2], -0.1, 0.6)
    ear_weight = _blob(local, ear.mean(axis=0), (0.10, 0.24, 0.16)) * step(
        local[:, 0], ear[:, 0].min() - 0.02, ear[:, 0].min() + 0.08
    )
    forehead = _blob(local, np.array([0.0, 0.45, 0.15]), (0.35, 0.16, 0.3))
    return [
        (forehead * facing, _YELLOW),
        (_blob(local, chin, (0.2, 0.12, 0.3)), _YELLOW),
        (_blob(local, cheek, (0.17, 0.16, 0.2)) * facing, _RED),
        (_blob(local, nose + np.array([0.0, 0.01, 0.0]), (0.13, 0.11, 0.12)), _RED),
        (_blob(local, chin, (0.10, 0.07, 0.2)) * 0.5, _RED),
        (ear_weight, _EAR),
        (_under_eye(head, positions), _UNDER_EYE),
        (_lids(head, positions), _LID),
        (_nostrils(head, positions), _NOSTRIL),
        (brow_weight(head, positions), _BROW),
    ]


def _under_eye(head: Head, positions: Floats) -> Floats:
    """Return the crescent under the lower lid, strongest at its inner end."""
    local = head.local(positions)
    line = head.local(head.lower_lashes)
    order = np.argsort(line[:, 0])
    edge = np.interp(local[:, 0], line[order, 0], line[order, 1])
    below = edge - local[:, 1]
    inner, outer = line[order[0], 0], line[order[-1], 0]
    along = step(local[:, 0], inner - 0.06, inner + 0.05)
    along *= 1.0 - step(local[:, 0], inner + 0.1, outer + 0.02)
    band = step(below, 0.0, 0.03) * (1.0 - step(below, 0.05, 0.14))
    crescent: Floats = along * band * (local[:, 2] > -0.2)
    return crescent


def _lids(head: Head, positions: Floats) -> Floats:
    """Return the lids: skin within a few millimetres of the eyeball, reddest at the rim."""
    left = np.concatenate([np.abs(positions[:, :1]), positions[:, 1:]], axis=1)
    away = np.linalg.norm((left - head.eye) * np.array([0.75, 1.15, 1.0]), axis=1)
    lid = 1.0 - step(away, head.eye_radius + 1.5 * MM, head.eye_radius + 7.0 * MM)
    lower = np.exp(-0.5 * (_near_line(left, head.lower_lashes) / (1.2 * MM)) ** 2)
    upper = np.exp(-0.5 * (_near_line(left, head.upper_lashes) / (1.0 * MM)) ** 2)
    weight: Floats = np.maximum.reduce([0.55 * lid, 0.9 * lower, 2.6 * upper])
    return weight


def _near_line(points: Floats, line: Floats) -> Floats:
    """Return the distance of points to a line, (N,), refined between its points."""
    fine = smooth(line, 60, 2.0)
    best = np.full(len(points), np.inf)
    near = np.abs(points - fine.mean(axis=0)).max(axis=1) < 0.3
    for spot in fine:
        best[near] = np.minimum(best[near], np.linalg.norm(points[near] - spot, axis=1))
    return best


def _nostrils(head: Head, positions: Floats) -> Floats:
    left = np.concatenate([np.abs(positions[:, :1]), positions[:, 1:]], axis=1)
    spot = head.nostril + np.array([0.0, 0.0, -0.02]) * head.scale
    away = (left - spot) / (np.array([0.052, 0.042, 0.09]) * head.scale)
    return 1.0 - step(np.linalg.norm(away, axis=1), 0.55, 1.2)


def _beard(head: Head, positions: Floats, local: Floats) -> Floats:
    """Return jaw, chin and upper lip, with the grain of stubble."""
    mouth = head.local(head.mouth[None])[0]
    ear = head.local(head.ear)
    x, y, z = local.T
    # The upper edge runs from the sideburn to the corner of the mouth.
    edge = np.interp(x, [0.0, 0.1, 0.3, 0.6], [0.10, 0.12, 0.02, 0.30]) + mouth[1]
    weight = step(edge - y, -0.08, 0.12) * (1.0 - step(mouth[1] - y, 0.42, 0.6))
    weight *= step(z, ear[:, 2].max() - 0.1, ear[:, 2].max() + 0.05)
    grain = noise(positions, 0.9 * MM, 71) * 0.25 + 1.0
    stubble: Floats = weight * grain.clip(0.4, 1.4)
    return stubble


def _mottling(positions: Floats) -> Floats:
    """Return uneven blood and pigment, (N, 3): clouds of 12 mm, blotches of 2 mm, grain, pores."""
    blood = 0.4 * fractal(positions, 12.0 * MM, 11) + 0.5 * noise(positions, 2.0 * MM, 21)
    pigment = 0.3 * fractal(positions, 7.0 * MM, 31) + 0.6 * noise(positions, 1.1 * MM, 41)
    grain = noise(positions, 0.7 * MM, 42)
    # Each pore is a dark point; the skin in between is correspondingly lighter. Some areas have
    # few.
    pores = (noise(positions, 0.6 * MM, 103) - 0.3).clip(0.0, None) - _PORES
    pores *= (1.0 + 0.35 * noise(positions, 14.0 * MM, 43)).clip(0.4, 1.6)
    red = np.array([0.006, 0.060, 0.056])
    brown = np.array([0.027, 0.045, 0.063])
    dark = np.array([0.07, 0.095, 0.105]) * pores[:, None] + 0.025 * grain[:, None]
    factor: Floats = np.exp(-blood[:, None] * red - pigment[:, None] * brown - dark)
    return factor


def _lips(head: Head, positions: Floats) -> tuple[Floats, Floats]:
    """Return the weights of the lips and of the dark slit between them, (N,) each."""
    distance = lip_distance(head, positions) / head.scale
    wavy = distance + 0.2 * MM * noise(positions, 1.5 * MM, 51)
    streaks = noise(positions, (0.9 * MM, 6.0 * MM, 6.0 * MM), 61)
    # The lower lip's border is the softer one.
    soft = 1.0 + 0.8 * step(head.mouth[1] - positions[:, 1], 0.0, 3.0 * MM)
    lips = step(wavy, -0.35 * MM * soft, 0.9 * MM * soft) * (0.85 + 0.06 * streaks)
    slit = np.abs(positions[:, 1] - head.mouth[1]) / head.scale
    # Lips recede towards the corners of the mouth; only points near the slit are inside it.
    inside = step(head.mouth[2] - positions[:, 2], -0.03, 0.02) * (distance > 0.0)
    inside *= 1.0 - step(slit, 0.8 * MM, 2.5 * MM)
    return lips, np.maximum(inside, 0.5 * step(distance, 1.5 * MM, 4 * MM) * np.exp(-slit / 0.02))
