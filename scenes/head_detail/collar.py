"""A crew-neck collar and the start of the shoulders, which hide the neck's cut.

It is a shell of cloth around the neck: a ribbed band that leans on the skin, and below it the shirt
that extends over the shoulders and down past the cut. The mesh is closed and does not touch the
skin, so that the medium inside the skin is not affected.
"""

from __future__ import annotations

import numpy as np

from scenes.head_detail.heads import MM, Floats, Head, Ints, load
from scenes.head_detail.noise import fractal
from scenes.head_detail.outline import step
from scenes.head_detail.strands import unit
from scenes.head_detail.surface import Surface, surface

_HALF_TURN = 241
"""Columns from the middle of the front to the middle of the back."""
_BAND = np.array([0.0, 0.015, 0.04, 0.08, 0.12, 0.15, 0.165])
_BAND_OFF = np.array([1.6, 3.2, 4.0, 4.2, 4.4, 4.2, 3.0]) * MM
_BODY = np.array([0.02, 0.08, 0.16, 0.26, 0.38, 0.52, 0.68, 0.84, 1.0])
_OFF_SKIN = 0.6 * MM
_THICK = 2.6 * MM


def collar(name: str) -> tuple[Floats, Floats, Ints]:
    """Return vertices (V, 3), normals (V, 3) and faces (F, 3) of a head's collar, head units."""
    head, skin = load(name), surface(name)
    outer = _outer_rows(head, skin)
    inner = _inner_rows(outer, skin)
    half = np.concatenate([outer, inner[::-1]])
    # Both middles belong to both halves: the mirrored half leaves them out.
    other = half[:, -2:0:-1] * np.array([-1.0, 1.0, 1.0])
    half[:, [0, -1], 0] = 0.0
    rows = np.concatenate([half, other], axis=1)
    faces = _tube(*rows.shape[:2])
    vertices = rows.reshape(-1, 3)
    return vertices, _normals(vertices, faces), faces


def _around() -> Floats:
    """Return directions (columns, 3) from the front via the left to the back."""
    angle = np.linspace(0.0, np.pi, _HALF_TURN)
    return np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)


def _neckline(head: Head) -> Floats:
    """Return the height of the band's upper edge, (columns,): low in front, high at the nape."""
    angle = np.linspace(0.0, np.pi, _HALF_TURN)
    height = np.interp(angle, np.radians([0, 45, 90, 135, 180]), [0.285, 0.315, 0.40, 0.50, 0.535])
    smooth = np.convolve(np.pad(height, 30, mode="reflect"), np.ones(61) / 61.0, mode="valid")
    line: Floats = head.cut + smooth * head.scale
    return line


def _neck_at(head: Head, skin: Surface, height: Floats) -> Floats:
    """Return points of the neck's skin at given heights, (columns, 3), found from outside."""
    around = _around()
    axis = np.stack([np.zeros_like(height), height, np.full_like(height, 0.30)], axis=1)
    reach = np.full(_HALF_TURN, 1.1 * head.scale)
    for _ in range(60):
        spots = axis + reach[:, None] * around
        foot, normal = skin.nearest(spots)
        side = np.sign(np.einsum("ij,ij->i", spots - foot, normal))
        reach -= 0.8 * side * np.linalg.norm(spots - foot, axis=1)
    return axis + reach[:, None] * around


def _outer_rows(head: Head, skin: Surface) -> Floats:
    """Return the cloth's outside, (rows, columns, 3): the band from its edge, then the shirt."""
    around, line = _around(), _neckline(head)
    ribs = 0.25 * MM * np.cos(np.arange(_HALF_TURN) * np.pi / 2.0)
    rows = []
    for depth, off in zip(_BAND, _BAND_OFF, strict=True):
        neck = _neck_at(head, skin, line - depth * 0.55 * head.scale)
        # Cloth bridges hollows: it follows the neck's round shape, not its cords.
        rows.append(_calm(neck) + (off + ribs * (0.03 < depth < 0.14))[:, None] * around)
    rim = rows[-1]
    rows += [_shirt(head, rim, part) for part in _BODY]
    body = np.array(rows[len(_BAND) :])
    flat = _lift(skin, body.reshape(-1, 3))
    flat = skin.push_out(flat, np.full(len(flat), _OFF_SKIN + _THICK))
    folds = 1.6 * MM * fractal(flat, 60.0 * MM, 601, 2)
    flat[:, 1] += folds * step(line.min() - flat[:, 1], 0.05, 0.3)
    flat = skin.push_out(flat, np.full(len(flat), _OFF_SKIN + _THICK))
    band = np.array(rows[: len(_BAND)])
    lean = np.repeat(_BAND_OFF - 0.5 * MM, _HALF_TURN).clip(None, 2.0 * MM)
    band = skin.push_out(band.reshape(-1, 3), lean).reshape(band.shape)
    return np.concatenate([band, flat.reshape(body.shape)])


def _lift(skin: Surface, points: Floats) -> Floats:
    """Raise points inside broad shoulders, just above the flat cut, towards their top."""
    raised = points.copy()
    for _ in range(12):
        foot, normal = skin.nearest(raised)
        raised[(normal[:, 1] < -0.8) & (raised[:, 1] > foot[:, 1]), 1] += 3.0 * MM
    return raised


def _calm(line: Floats, width: int = 9) -> Floats:
    """Return a row blurred along itself; the front and the back stay symmetric."""
    padded = np.concatenate([line[width:0:-1], line, line[-2 : -width - 2 : -1]])
    padded[:width, 0] *= -1.0
    padded[-width:, 0] *= -1.0
    kernel = np.ones(2 * width + 1) / (2 * width + 1)
    return np.stack([np.convolve(column, kernel, mode="valid") for column in padded.T], axis=1)


def _shirt(head: Head, rim: Floats, part: float) -> Floats:
    """Return a row of the shirt, (columns, 3), `part` of the way from the band to the hem."""
    around = _around()
    ahead = np.where(around[:, 2] > 0.0, 1.15, 0.95)
    outer = np.stack([1.95 * around[:, 0], np.zeros(_HALF_TURN), ahead * around[:, 2]], axis=1)
    outer[:, 2] += 0.15
    row = rim + part * (outer * head.scale - rim)
    # On the sides the cloth extends along the shoulder; in front and behind it falls.
    side = np.abs(around[:, 0]) ** 2
    shoulder = 0.50 * part + 0.5 * step(np.full(_HALF_TURN, part), 0.62, 1.1)
    chest = 1.15 * part**0.8
    row[:, 1] = rim[:, 1] - head.scale * (side * shoulder + (1.0 - side) * chest)
    return row


def _inner_rows(outer: Floats, skin: Surface) -> Floats:
    """Return the cloth's inside: `_THICK` within its outside, clear of the skin."""
    along = np.gradient(outer, axis=0)
    across = np.gradient(outer, axis=1)
    inward = unit(np.cross(along, across))
    centre = outer.mean(axis=(0, 1)) * np.array([0.0, 1.0, 1.0])
    flip = np.sign(np.einsum("ijk,ijk->", inward, centre - outer))
    inner = (outer + flip * inward * _THICK).reshape(-1, 3)
    return skin.push_out(inner, np.full(len(inner), _OFF_SKIN)).reshape(outer.shape)


def _tube(rows: int, columns: int) -> Ints:
    """Return the triangles of a surface closed in both directions."""
    row, column = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    down, right = (row + 1) % rows, (column + 1) % columns
    a, b = row * columns + column, row * columns + right
    c, d = down * columns + right, down * columns + column
    quads = np.stack([a, d, c, b], axis=-1).reshape(-1, 4)
    faces: Ints = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int64)
    return faces


def _normals(vertices: Floats, faces: Ints) -> Floats:
    """Return smooth normals, (V, 3), weighted by area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    total = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(total, faces[:, k], normal)
    return unit(total)
