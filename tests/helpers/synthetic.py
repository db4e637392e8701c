"""A head that needs no baking: an ellipsoid with a nose that casts shadows, plain matte skin.

Everything is left-right symmetric to the last bit, like the baked transports, so tests of signs,
turns and mirrors hold exactly here.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.core.solver.head_shape import HeadShape, save_shape, shape_path
from app.core.solver.style_signature import UNSIGNED
from app.core.solver.transport import Transport, TransportHeader, render, save_transport
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_build import build_pack
from app.core.styles.style_pack_file import pack_path, save_pack
from app.core.styles.styles import load_styles

Float = NDArray[np.float64]

ALBEDO = (0.72, 0.48, 0.36)
HEAD = np.array([0.078, 0.112, 0.098])  # semi-axes, metres: across, up, out of the face
_NOSE = np.array([0.013, 0.024, 0.026])
_NOSE_AT = np.array([0.0, -0.012, 0.094])
_HALF_FRAME = 0.125  # half the picture's side, metres


def texel_directions(height: int, width: int) -> Float:
    """(H, W, 3) unit vectors of the texels' centres at turn 0, head frame."""
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    a, e = np.meshgrid(azimuth, elevation)
    return np.stack([-np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)], axis=-1)


def solid_angles(height: int, width: int) -> Float:
    """(H,) solid angle of one texel of each row, sr."""
    edges = np.pi * (0.5 - np.arange(height + 1) / height)
    bands: Float = (2 * np.pi / width) * (np.sin(edges[:-1]) - np.sin(edges[1:]))
    return bands


def lamp_direction(azimuth_deg: float, elevation_deg: float) -> Float:
    """Return the unit vector of a lamp at a panorama azimuth, head frame at turn 0."""
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    return np.array([-np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def lamp_environment(
    azimuth_deg: float,
    elevation_deg: float,
    diameter_deg: float = 8.0,
    shape: tuple[int, int] = (32, 64),
    fill: float = 0.0,
) -> Float:
    """(H, W) luminance of one round lamp at a panorama azimuth, area-true on the texel grid.

    `fill` is a uniform radiance added to it. The lamp's irradiance is 1 whatever its size.
    """
    height, width = shape
    fine = 8
    rays = texel_directions(height * fine, width * fine)
    inside = rays @ lamp_direction(azimuth_deg, elevation_deg) >= np.cos(
        np.radians(diameter_deg / 2)
    )
    weight = inside * solid_angles(height * fine, width * fine)[:, None]
    power = weight.reshape(height, fine, width, fine).sum(axis=(1, 3))
    radiance: Float = power / power.sum() / solid_angles(height, width)[:, None]
    return radiance + fill


def one_texel(row: int, column: int, shape: tuple[int, int] = (32, 64)) -> Float:
    """(H, W) luminance with a single texel lit, irradiance 1."""
    light = np.zeros(shape)
    light[row, column] = 1.0 / solid_angles(*shape)[row]
    return light


def mirrored(environment: Float) -> Float:
    """Panorama seen in a mirror: columns reversed."""
    return np.ascontiguousarray(environment[:, ::-1])


@lru_cache(maxsize=4)
def lambert_sphere_transport(
    size: int = 36, shape: tuple[int, int] = (32, 64), rank: int = 160
) -> Transport:
    """Transport of a matte ellipsoid head with a nose: direct light and its own shadows.

    Args:
        size: Side of the picture, pixels (even).
        shape: (H, W) of the environment.
        rank: Largest rank of the low-rank form; the form loses what lies beyond.
    """
    inside, points, normals = _surface(size)
    half = _half_matrices(points, normals, shape, left=inside[:, : size // 2])
    count = int(inside.sum())
    pixels = np.flatnonzero(inside).astype(np.int32)
    place = np.full(size * size, -1)
    place[pixels] = np.arange(count)
    left = place.reshape(size, size)[:, : size // 2]
    right = place.reshape(size, size)[:, ::-1][:, : size // 2]
    left, right = left[left >= 0], right[right >= 0]
    pixel_basis = np.zeros((count, 0))
    texel_basis = np.zeros((0, shape[0] * shape[1]))
    for matrix, sign in zip(half, (1.0, -1.0), strict=True):
        u, s, vt = np.linalg.svd(matrix, full_matrices=False)
        keep = min(rank // 2, int((s > 1e-7 * s[0]).sum()))
        columns = np.zeros((count, keep))
        columns[left] = u[:, :keep] * s[:keep]
        columns[right] = sign * u[:, :keep] * s[:keep]
        rows = vt[:keep].reshape(keep, shape[0], shape[1] // 2) / 2
        full = np.concatenate([rows, sign * rows[:, :, ::-1]], axis=2).reshape(keep, -1)
        pixel_basis = np.concatenate([pixel_basis, columns], axis=1)
        texel_basis = np.concatenate([texel_basis, full], axis=0)
    header = TransportHeader(
        head="synthetic",
        skin="matte",
        environment=shape,
        picture=size,
        rank=texel_basis.shape[0],
        fov_deg=8.0,
        distance_m=1.8,
    )
    return Transport(
        header=header,
        pixels=pixels,
        coverage=np.ones(count, np.float32),
        pixel_basis=np.stack([a * pixel_basis for a in ALBEDO]).astype(np.float32),
        texel_basis=texel_basis.astype(np.float32),
        digest="synthetic",
    )


def lamp_target(
    transport: Transport,
    lamps: tuple[tuple[float, float, float], ...],
    diameter_deg: float = 8.0,
) -> NDArray[np.float32]:
    """(P, 3) picture under far lamps: (azimuth towards the sitter's left, elevation, power)."""
    shape = transport.environment_shape
    light = sum(
        power * lamp_environment(-azimuth, elevation, diameter_deg, shape)
        for azimuth, elevation, power in lamps
    )
    return render(transport, np.repeat(np.asarray(light)[..., None], 3, axis=-1))


@lru_cache(maxsize=2)
def synthetic_pack(size: int = 36, shape: tuple[int, int] = (32, 64)) -> StylePack:
    """Style pack of the built-in styles on the synthetic head, their lamps far away.

    It has no eyes and no neck, so the styles are without their signatures.
    """
    transport = lambert_sphere_transport(size, shape)
    styles = [replace(style, signature=UNSIGNED) for style in load_styles()]
    targets = np.stack([style_target(transport, style) for style in styles])
    return build_pack(transport, styles, targets, synthetic_shape(size))


@lru_cache(maxsize=2)
def synthetic_shape(size: int = 36) -> HeadShape:
    """Shape of the synthetic head: an ellipsoid; its nose does not stand out here."""
    pixels = lambert_sphere_transport(size).pixels
    row, column = np.divmod(pixels, size)
    step = 2 * _HALF_FRAME / size
    x, y = -_HALF_FRAME + (column + 0.5) * step, _HALF_FRAME - (row + 0.5) * step
    rest = np.maximum(1 - (x / HEAD[0]) ** 2 - (y / HEAD[1]) ** 2, 0.0)
    around = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    ring = np.stack([np.cos(around), np.sin(around)], axis=1)
    return HeadShape(
        head="synthetic",
        pixels=pixels,
        positions=np.stack([x, y, HEAD[2] * np.sqrt(rest)], axis=1).astype(np.float32),
        skin=(texel_directions(24, 48).reshape(-1, 3) * HEAD).astype(np.float32),
        above=(ring * HEAD[[0, 2]]).astype(np.float32),
        side=(ring * HEAD[[2, 1]]).astype(np.float32),
        eye_point=np.array([0.0, 0.02, 0.09], np.float32),
    )


def own_head(folder: Path, name: str) -> Path:
    """Save a tiny head as `turnlight bake` leaves it: transport, pack and shape; its transport."""
    folder.mkdir(exist_ok=True)
    path, pack = folder / f"{name}.npz", synthetic_pack()
    digest = save_transport(path, lambert_sphere_transport())
    save_pack(pack_path(path), replace(pack, header=replace(pack.header, transport_sha256=digest)))
    save_shape(shape_path(path), synthetic_shape())
    return path


def style_target(transport: Transport, style: Style) -> NDArray[np.float32]:
    """(P, 3) picture under a style's own lamps, moved far away.

    A ball shows nothing of light that only reaches its back: such a style has a little fill here.
    """
    lamps = tuple((lamp.azimuth_deg, lamp.elevation_deg, lamp.power) for lamp in style.lamps)
    if all(abs(azimuth) > 150.0 for azimuth, _, _ in lamps):
        lamps += ((0.0, 0.0, 0.02),)
    return lamp_target(transport, lamps)


def _surface(size: int) -> tuple[NDArray[np.bool_], Float, Float]:
    """First hits of a far camera in front: (N, N) covered, (P, 3) points, (P, 3) unit normals."""
    step = 2 * _HALF_FRAME / size
    right = -_HALF_FRAME + (np.arange(size) + 0.5) * step
    x, y = np.meshgrid(right, right[::-1])
    depth = np.full((size, size), -np.inf)
    normal = np.zeros((size, size, 3))
    for centre, axes in ((np.zeros(3), HEAD), (_NOSE_AT, _NOSE)):
        rest = 1 - ((x - centre[0]) / axes[0]) ** 2 - ((y - centre[1]) / axes[1]) ** 2
        z = centre[2] + axes[2] * np.sqrt(np.maximum(rest, 0))
        front = (rest > 0) & (z > depth)
        point = np.stack([x, y, z], axis=-1)
        outward = (point - centre) / axes**2
        outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
        depth = np.where(front, z, depth)
        normal = np.where(front[..., None], outward, normal)
    inside = np.isfinite(depth)
    points = np.stack([x, y, np.where(inside, depth, 0)], axis=-1)
    return inside, points[inside], normal[inside]


def _half_matrices(
    points: Float, normals: Float, shape: tuple[int, int], left: NDArray[np.bool_]
) -> tuple[Float, Float]:
    """Even and odd part of T on the picture's left half and the panorama's left half."""
    height, width = shape
    # Points of the left half only, in the row-major order of the left half's covered pixels.
    on_left = points[:, 0] < 0
    points, normals = points[on_left], normals[on_left]
    assert len(points) == int(left.sum())
    matrix = np.zeros((len(points), height * width))
    fine = 2
    rays = texel_directions(height * fine, width * fine).reshape(-1, 3)
    area = np.repeat(solid_angles(height * fine, width * fine), width * fine)
    for start in range(0, len(points), 64):
        block = slice(start, start + 64)
        cosine = np.maximum(normals[block] @ rays.T, 0)
        lit = np.ones(cosine.shape, bool)
        for centre, axes in ((np.zeros(3), HEAD), (_NOSE_AT, _NOSE)):
            lit &= ~_blocked(points[block] + 1e-4 * normals[block], rays, centre, axes)
        fine_matrix = (cosine * lit * area / np.pi).reshape(-1, height, fine, width, fine)
        matrix[block] = fine_matrix.sum(axis=(2, 4)).reshape(-1, height * width)
    grid = matrix.reshape(-1, height, width)
    west, east = grid[:, :, : width // 2], grid[:, :, ::-1][:, :, : width // 2]
    flat = (len(points), height * width // 2)
    return (west + east).reshape(flat), (west - east).reshape(flat)


def _blocked(origins: Float, rays: Float, centre: Float, axes: Float) -> NDArray[np.bool_]:
    """(points, rays) whether an ellipsoid stands in the ray's way."""
    o, d = (origins - centre) / axes, rays / axes
    a = (d * d).sum(axis=1)
    b = o @ d.T
    c = (o * o).sum(axis=1)[:, None] - 1
    root = b * b - a * c
    hit: NDArray[np.bool_] = (root > 0) & (-b + np.sqrt(np.maximum(root, 0)) > 0)
    return hit
