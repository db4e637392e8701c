"""Procedural eyeballs for the head meshes: shape, normals and vertex colours.

Lengths inside this module are millimetres in the frame of one eye: origin inside the
eyeball, +Z along the optical axis out of the face, +Y up, +X towards the sitter's left. Only
:func:`eye_pair` speaks the head's own units (1 unit = 10 cm).

Sizes follow the human eye: corneal radius of curvature 7.8 mm, visible iris radius 5.9 mm
(Atchison & Smith, *Optics of the Human Eye*, 2000). The sclera alone is larger than life (about
14 instead of 12 mm) because the eyelids of the mesh are modelled around a ball of that size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

MM_PER_UNIT = 100.0
CAMERA_DISTANCE = 18.0  # units: both optical axes meet at the camera, 1.8 m in front of the eyes

_SECTORS = 64
_BLEND = 0.30  # mm, half width of the rounded sulcus where cornea and sclera meet
_CLEARANCE = 0.25  # mm, how far behind the lid rim the sclera ends


@dataclass(frozen=True, slots=True)
class LidMargin:
    """Where the rim of the eyelids lies in the camera's view, around the optical axis.

    Attributes:
        reach: (n,) float64. Distance from the optical axis to the rim, mm; entry k at angle 360 k /
            n degrees, 0 towards the sitter's left, counter-clockwise as the camera sees it.
        depth: (n,) float64. Height of the rim above the centre of the eyeball along the optical
            axis, mm.
    """

    reach: Floats
    depth: Floats


@dataclass(frozen=True, slots=True)
class EyeSpec:
    """Shape and place of the sitter's left eye; the right one is its mirror image.

    Attributes:
        centre: Origin of the eye on its optical axis, head units, head frame.
        sclera, cornea, limbus, pupil: Radius of the sclera, radius of curvature of the cornea,
            radii of iris and pupil, mm.
        sclera_offset: (float, float). Centre of the scleral sphere in the eye's own x and y, mm:
            the iris sits a little off the middle of the ball where the lids ask for it.
        margin: When given, the sclera follows the eyelids in both corners of the eye.
    """

    centre: tuple[float, float, float]
    sclera: float
    cornea: float = 7.8
    limbus: float = 5.9
    pupil: float = 2.0
    sclera_offset: tuple[float, float] = (0.0, 0.0)
    margin: LidMargin | None = None


@dataclass(frozen=True, slots=True)
class EyeMesh:
    """Closed triangle mesh with normals and colours.

    Attributes:
        vertices, normals: (V, 3) float64. Positions in head units and unit normals, head frame.
        colours: (V, 3) float64. Diffuse albedo, linear Rec. 709.
        faces: (F, 3) int32. Counter-clockwise seen from outside.
    """

    vertices: Floats
    normals: Floats
    colours: Floats
    faces: Ints


def radius(spec: EyeSpec, polar: Floats, around: Floats) -> Floats:
    """Distance of the smooth eyeball from the origin, before it is fitted to the lids.

    Args:
        spec: Shape of the eye.
        polar, around: float64 of one shape. Angle from the optical axis and angle about it (0
            towards +X, then +Y), radians.

    Returns:
        float64, mm: the larger of scleral and corneal sphere, with a rounded transition.
    """
    along, across = np.cos(polar), np.sin(polar)
    ox, oy = spec.sclera_offset
    to_centre = across * (ox * np.cos(around) + oy * np.sin(around))
    ball = to_centre + np.sqrt(spec.sclera**2 - ox**2 - oy**2 + to_centre**2)
    apex_centre = cornea_centre(spec)
    inside = spec.cornea**2 - (apex_centre * across) ** 2
    bulge = apex_centre * along + np.sqrt(np.maximum(inside, 0.0))
    # smooth maximum: differentiable everywhere, exact away from the limbus
    result: Floats = 0.5 * (bulge + ball + np.sqrt((bulge - ball) ** 2 + _BLEND**2))
    return result


def cornea_centre(spec: EyeSpec) -> float:
    """Return the distance (mm) of the corneal sphere's centre from the origin."""
    flat = spec.limbus**2 + spec.sclera_offset[0] ** 2 + spec.sclera_offset[1] ** 2
    at_limbus = np.sqrt(spec.sclera**2 - flat)
    return float(at_limbus - np.sqrt(spec.cornea**2 - spec.limbus**2))


def _surface(spec: EyeSpec, polar: Floats, around: Floats) -> Floats:
    """Points (..., 3), mm, of the eyeball for polar angle and angle about the axis, radians."""
    dist = radius(spec, polar, around)
    out = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1
    )
    if spec.margin is not None:
        dist = dist + _lift(spec, spec.margin, dist * np.sin(polar), polar, around)
    result: Floats = out * dist[..., None]
    return result


def _lift(spec: EyeSpec, margin: LidMargin, rho: Floats, polar: Floats, around: Floats) -> Floats:
    """Radial offset (mm) that brings the sclera to the lid rim in the corners of the eye.

    Lids are not spherical: without it a slit up to 3 mm deep would show in the corners, which
    the tissue of a living eye (caruncle, folds of the conjunctiva) fills. The cornea is spared.
    """
    angles = 2.0 * np.pi * np.arange(len(margin.reach)) / len(margin.reach)
    flat = (margin.reach * np.cos(angles) - spec.sclera_offset[0]) ** 2
    flat += (margin.reach * np.sin(angles) - spec.sclera_offset[1]) ** 2
    sphere = np.sqrt(np.maximum(spec.sclera**2 - flat, 0.0))
    corner = _smoothstep(5.0, 7.5, margin.reach)
    gap = (margin.depth - _CLEARANCE - sphere) * corner * sphere / spec.sclera
    reach = _periodic(_blur(margin.reach, 2), angles, around)
    height = _periodic(_blur(gap, 6), angles, around)
    start = spec.limbus + 0.2
    rise = _smoothstep(0.0, 1.0, (rho - start) / np.maximum(reach - start, 2.5))
    fall = 1.0 - _smoothstep(0.5, 3.0, rho - reach)
    front = (polar < 0.5 * np.pi).astype(np.float64)
    result: Floats = height * rise * fall * front
    return result


def _blur(values: Floats, times: int) -> Floats:
    for _ in range(times):
        values = 0.25 * np.roll(values, 1) + 0.5 * values + 0.25 * np.roll(values, -1)
    return values


def _periodic(values: Floats, angles: Floats, at: Floats) -> Floats:
    result: Floats = np.interp(np.mod(at, 2.0 * np.pi), angles, values, period=2.0 * np.pi)
    return result


def _rings(spec: EyeSpec) -> Floats:
    """Polar angles (n,) in radians of the vertex rings, dense where the colour has an edge."""
    iris, pupil = spec.limbus, spec.pupil
    flat = np.concatenate(
        [
            np.linspace(0.0, pupil - 0.15, 4)[1:],
            pupil + np.array([-0.06, 0.0, 0.06, 0.2]),
            np.linspace(pupil + 0.5, iris - 0.9, 7),
            iris + np.array([-0.6, -0.4, -0.25, -0.1, 0.05, 0.2, 0.4, 0.7, 1.1]),
        ]
    )
    dense = np.linspace(0.0, 0.45 * np.pi, 4001)
    reach = radius(spec, dense, np.zeros_like(dense)) * np.sin(dense)
    front = np.interp(flat, reach, dense)
    visible = np.arange(front[-1] + 0.06, 1.7, 0.06)  # the corners of the eye end near 60 degrees
    back = np.concatenate([visible, np.arange(visible[-1] + 0.2, np.pi - 0.1, 0.2)])
    return np.concatenate([front, back])


def _smoothstep(low: float, high: float, x: Floats) -> Floats:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    result: Floats = t * t * (3.0 - 2.0 * t)
    return result


def _mix(a: Floats, b: Floats, t: Floats) -> Floats:
    result: Floats = a + (b - a) * t[:, None]
    return result


def colours(spec: EyeSpec, local: Floats) -> Floats:
    """Diffuse albedo of points on the eyeball.

    Args:
        spec: Shape of the eye.
        local: (V, 3) float64. Points on the left eye in its own frame, mm; -X is the side of the
            nose.

    Returns:
        (V, 3) float64, linear Rec. 709, within [0, 1].
    """
    rho = np.hypot(local[:, 0], local[:, 1])
    angle = np.arctan2(local[:, 1], local[:, 0])
    front = local[:, 2] > 0.0
    span = (rho - spec.pupil) / (spec.limbus - spec.pupil)

    # even in the angle about the horizontal axis, so nothing looks like a twist
    fibres = 0.5 * np.cos(16.0 * angle) * np.cos(5.0 * span) + 0.5 * np.cos(
        9.0 * angle + 2.0 * span
    )
    inner, outer = np.array([0.110, 0.058, 0.022]), np.array([0.065, 0.039, 0.020])
    iris = _mix(np.tile(inner, (len(rho), 1)), outer, _smoothstep(0.1, 0.6, span))
    iris *= (1.0 + 0.22 * fibres)[:, None]
    iris *= (1.0 - 0.55 * (1.0 - _smoothstep(0.0, 0.12, span)))[:, None]  # pupillary ruff
    iris *= (1.0 - 0.72 * _smoothstep(0.74, 1.0, span))[:, None]  # dark limbal ring

    white, pink = np.array([0.68, 0.63, 0.58]), np.array([0.60, 0.43, 0.37])
    flesh = np.array([0.50, 0.22, 0.17])
    # the conjunctiva reddens towards both corners and ends in the caruncle at the nose
    sclera = _mix(np.tile(white, (len(rho), 1)), pink, 0.8 * _smoothstep(6.5, 11.5, rho))
    sclera = _mix(sclera, flesh, _smoothstep(8.6, 10.4, -local[:, 0]))

    skin = _mix(iris, sclera, _smoothstep(spec.limbus - 0.15, spec.limbus + 0.45, rho))
    pupil = np.full((len(rho), 3), 0.005)
    full = _mix(pupil, skin, _smoothstep(spec.pupil - 0.06, spec.pupil + 0.06, rho))
    result: Floats = np.clip(np.where(front[:, None], full, sclera), 0.0, 1.0)
    return result


def _faces(rings: int) -> Ints:
    """Triangles of ``rings`` rings between two poles (front pole 0, back pole last)."""
    k = np.arange(_SECTORS)
    nxt = (k + 1) % _SECTORS
    first = 1 + k
    parts = [np.stack([np.zeros_like(k), first, 1 + nxt], axis=1)]
    for i in range(rings - 1):
        a, b = 1 + i * _SECTORS + k, 1 + i * _SECTORS + nxt
        c, d = a + _SECTORS, b + _SECTORS
        parts += [np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)]
    last = 1 + (rings - 1) * _SECTORS
    pole = np.full_like(k, last + _SECTORS)
    parts.append(np.stack([last + k, pole, last + nxt], axis=1))
    return np.concatenate(parts).astype(np.int32)


def _local_eye(spec: EyeSpec) -> tuple[Floats, Floats, Ints]:
    """Left eye in its own frame: vertices (V, 3) mm, unit normals (V, 3), faces (F, 3)."""
    polar = _rings(spec)
    around = 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS
    grid, turn = np.meshgrid(polar, around, indexing="ij")
    h = 1e-3
    down = _surface(spec, grid + h, turn) - _surface(spec, grid - h, turn)
    along = _surface(spec, grid, turn + h) - _surface(spec, grid, turn - h)
    normal = np.cross(down, along)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    ends = radius(spec, np.array([0.0, np.pi]), np.zeros(2))
    front, back = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]])
    points = _surface(spec, grid, turn).reshape(-1, 3)
    vertices = np.concatenate([front * ends[0], points, back * ends[1]])
    normals = np.concatenate([front, normal.reshape(-1, 3), back])
    return vertices, normals, _faces(len(polar))


def eye_pair(spec: EyeSpec) -> EyeMesh:
    """Both eyes as one mesh, looking at the camera 1.8 m in front of them.

    Args:
        spec: The sitter's left eye.

    Returns:
        Head units and frame; first the left eye (x > 0), then its mirror image with the same
        numbering and reversed winding.
    """
    local, normals, faces = _local_eye(spec)
    albedo = colours(spec, local)
    turn = np.arctan2(spec.centre[0], CAMERA_DISTANCE)  # towards the nose, that is towards -X
    c, s = np.cos(turn), np.sin(turn)
    rotate = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    vertices = local @ rotate.T / MM_PER_UNIT + np.asarray(spec.centre)
    normals = normals @ rotate.T
    flip = np.array([-1.0, 1.0, 1.0])
    mirrored = faces[:, ::-1] + np.int32(len(vertices))
    # rounding far below any visible size keeps the files equal across builds of NumPy
    vertices, normals, albedo = vertices.round(6), normals.round(5), albedo.round(5)
    return EyeMesh(
        np.concatenate([vertices, vertices * flip]),
        np.concatenate([normals, normals * flip]),
        np.concatenate([albedo, albedo]),
        np.concatenate([faces, mirrored]).astype(np.int32),
    )
