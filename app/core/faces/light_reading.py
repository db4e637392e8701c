"""Reads from a face in a photograph where its key light stands, and which style it shows.

It is compared with the generic head under single lamps from all around, and with the styles'
targets: what counts is the correlation over the skin. Nothing is trained on people.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.base.colour import luminance
from app.core.faces.finder import Face, face_mesh
from app.core.faces.on_head import head_map, on_head
from app.core.faces.pose import Pose, head_pose
from app.core.solver.style_pack import load_named_pack
from app.core.text import tr

Key: TypeAlias = Literal["front", "behind"]

_STEP_DEG: Final = 5
_FARTHEST_DEG: Final = 130
_RISE_DEG: Final = (-45, 85)
_SIZES_DEG: Final = (10.0, 40.0, 80.0)
_LEAST_SIZE_DEG: Final = 8.0  # a texel and a half
_EDGE_DEG: Final = 1.5
_SOFT: Final = 0.003  # of correlation: how much worse a lamp is that still counts
_ALIKE: Final = 0.01
_BEHIND_DEG: Final = 91.0
_BEHIND_RISE_DEG: Final = (-25.0, 75.0)  # lower or higher, the direction is told
_FRONTAL_DEG: Final = 10.0  # a face turned by less looks into the lens
_PROFILE_DEG: Final = 50.0
_LEAST_LIKE: Final = 0.55
_LEAST_CONTRAST: Final = 0.12
_LEAST_SEEN: Final = 0.35
_BEST_ERROR_DEG: Final = 7.0
_LIT: Final = 0.15  # of likeness, for each stop that more or less of the skin is lit
_LAMP: Final = 0.01  # of likeness, that each lamp of a style must bring


@dataclass(frozen=True, slots=True)
class FaceLight:
    """What a face says of its light.

    Attributes:
        azimuth_deg, elevation_deg: Where the key stands, from the face's own front, positive toward
            the sitter's left, and from level; None for one from behind or that was not read.
        key: "behind" for light from beyond some 95 degrees, whose direction no face tells.
        error_deg: How far off the direction may be.
        softness_deg: How large the key looks.
        ratio_stops: How much brighter the brighter cheek is than the other.
        styles: Names and likeness, 0 to 1, of the styles that it may be, the likeliest first.
        reason: Why it was not read; empty when it was.
    """

    pose: Pose
    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    key: Key | None = None
    error_deg: float | None = None
    softness_deg: float | None = None
    ratio_stops: float | None = None
    styles: tuple[tuple[str, float], ...] = ()
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class _Lamps:
    """Single lamps: ways there, (n, 3), head frame; sizes, deg; what they show on the skin."""

    ways: Float64
    sizes: Float64
    pictures: Float32


def read_light(picture: Bytes, face: Face, focal_px: float | None = None) -> FaceLight:
    """Read the key's direction and softness, the lighting ratio and the style from a face.

    Args:
        picture: (H, W, 3) uint8. sRGB, upright, as the camera took it: not mirrored.
        focal_px: Focal length, pixels, where it is known.
    """
    size = picture.shape[0], picture.shape[1]
    found = FaceLight(head_pose(face, size, focal_px))
    if abs(found.pose.yaw_deg) > _PROFILE_DEG:
        return replace(found, reason=tr("The face is seen from the side."))
    grey, seen = on_head(picture, face)
    values, shown = grey[head_map().skin], seen[head_map().skin]
    if shown.mean() < _LEAST_SEEN:
        return replace(found, reason=tr("Too little of the face can be seen."))
    found = replace(found, ratio_stops=_ratio(grey, seen), styles=_styles(values, shown))
    if values[shown].std() < _LEAST_CONTRAST * values[shown].mean():
        return replace(found, reason=tr("The light is flat: no side of the face is brighter."))
    likeness = _likeness(values, shown, _lamps().pictures)
    if likeness.max() < _LEAST_LIKE:
        reason = tr("Something hides the face, or several lamps light it.")
        return replace(found, reason=reason)
    return _with_key(found, likeness)


def _with_key(found: FaceLight, likeness: Float64) -> FaceLight:
    """Add direction and size of the lamps that are likest."""
    lamps, best = _lamps(), float(likeness.max())
    weight = np.exp((likeness - best) / _SOFT)
    way = weight @ lamps.ways
    way /= np.linalg.norm(way)
    near = np.clip(lamps.ways[likeness > best - _ALIKE] @ way, -1, 1)
    apart = float(np.degrees(np.sqrt(np.mean(np.arccos(near) ** 2))))
    # As the lens sees it, so that up is up however the chin is held.
    level = found.pose.turned @ _usual_pose().turned.T @ way
    azimuth = math.degrees(math.atan2(level[0], level[2]))
    elevation = math.degrees(math.asin(min(max(float(level[1]), -1.0), 1.0)))
    softness = float(weight @ lamps.sizes / weight.sum())
    low, high = _BEHIND_RISE_DEG
    if abs(azimuth) > _BEHIND_DEG and low < elevation < high:
        return replace(found, key="behind", softness_deg=softness)
    if abs(found.pose.yaw_deg) >= _FRONTAL_DEG:
        azimuth = wrap(azimuth - found.pose.yaw_deg)
    return replace(
        found,
        azimuth_deg=azimuth,
        elevation_deg=elevation,
        key="front",
        error_deg=math.hypot(_BEST_ERROR_DEG, apart),
        softness_deg=softness,
    )


@lru_cache(maxsize=1)
def _usual_pose() -> Pose:
    """How landmarks say that the generic head is held, though it is level and straight."""
    places = face_mesh().on_head * 1000
    depth = np.zeros((len(places), 1), np.float32)
    return head_pose(Face(np.concatenate([places, depth], axis=1), 1.0), (1000, 1000), 1e4)


def _likeness(values: Float32, shown: Bools, pictures: Float32) -> Float64:
    """Correlation of what is shown with pictures, (n, Q); (n,)."""
    own = np.where(shown, values - values[shown].mean(), 0).astype(np.float32)
    counts = shown.astype(np.float32)
    mean, square = pictures @ counts / counts.sum(), np.square(pictures) @ counts
    size = np.linalg.norm(own) * np.sqrt(np.maximum(square - counts.sum() * mean**2, 0))
    return np.asarray(pictures @ own / np.maximum(size, 1e-12), np.float64)


def _styles(values: Float32, shown: Bools) -> tuple[tuple[str, float], ...]:
    """Styles by the likeness of their targets: of light, and of its root, which sees into shade."""
    names, lamps, targets = _targets()
    score = _likeness(values, shown, targets)
    score += _likeness(np.sqrt(np.maximum(values, 0)), shown, np.sqrt(np.maximum(targets, 0)))
    # How much of the skin is lit tells lamps apart of which it sees more and less.
    lit = _lit_share(values[None, shown])[0] - _lit_share(targets[:, shown])
    score = np.clip(score / 2 - _LIT * np.abs(lit), 0, 1)
    # Of two that look alike on the skin, it is the one with fewer lamps.
    order = np.argsort(_LAMP * lamps - score, kind="stable")
    return tuple((names[row], float(score[row])) for row in order)


def _lit_share(pictures: Float32) -> Float64:
    """Stops of the mean under the brightest skin, (n,)."""
    share = pictures.mean(axis=1) / np.maximum(np.percentile(pictures, 97, axis=1), 1e-9)
    return np.asarray(np.log2(np.maximum(share, 1e-3)), np.float64)


@lru_cache(maxsize=1)
def _targets() -> tuple[tuple[str, ...], Float64, Float32]:
    """Names of the styles, how many lamps each has, and their targets on the skin, (S, Q)."""
    pack, head = load_named_pack("generic"), head_map()
    pictures = luminance(pack.targets.astype(np.float32)).reshape(len(pack.styles), -1)
    lamps = np.array([len(style.lamps) for style in pack.styles], np.float64)
    targets = head.blurred(pictures[:, head.transport.pixels])
    return tuple(style.name for style in pack.styles), lamps, targets


def _ratio(grey: Float32, seen: Bools) -> float | None:
    """Stops from the darker cheek to the brighter one; None where one is not seen."""
    means = [float(grey[cheek & seen].sum()) for cheek in head_map().cheeks]
    counts = [int((cheek & seen).sum()) for cheek in head_map().cheeks]
    if not (min(counts) and min(means) > 0.0):
        return None
    return abs(math.log2(means[0] / counts[0] * counts[1] / means[1]))


@lru_cache(maxsize=1)
def _lamps() -> _Lamps:
    """Light the generic head by single lamps from all around."""
    head = head_map()
    azimuths = np.arange(-_FARTHEST_DEG, _FARTHEST_DEG + 1, _STEP_DEG)
    elevations = np.arange(_RISE_DEG[0], _RISE_DEG[1] + 1, _STEP_DEG)
    grid = np.meshgrid(_SIZES_DEG, elevations, azimuths, indexing="ij")
    sizes, rise, across = (part.ravel().astype(np.float64) for part in grid)
    ways = _ways(across, rise)
    rows, columns = head.transport.environment_shape
    up = 90 - 180 * (np.arange(rows) + 0.5) / rows
    # A panorama's azimuth grows toward the sitter's right.
    around = 180 - 360 * (np.arange(columns) + 0.5) / columns
    texels = _ways(*(part.ravel() for part in np.meshgrid(around, up)))
    apart = np.degrees(np.arccos(np.clip(ways @ texels.T, -1, 1)))
    edge = np.maximum(sizes, _LEAST_SIZE_DEG)[:, None] / 2
    light = 1 / (1 + np.exp((apart - edge) / _EDGE_DEG))
    light /= light @ np.repeat(np.cos(np.radians(up)), columns)[:, None]
    basis = head.blurred(head.transport.luminance_basis.T)
    pictures = light.astype(np.float32) @ head.transport.texel_basis.T @ basis
    return _Lamps(ways, sizes, pictures.astype(np.float32))


def _ways(azimuth_deg: Float64, elevation_deg: Float64) -> Float64:
    """Unit vectors of the head frame, (n, 3)."""
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    return np.stack([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)], axis=1)
