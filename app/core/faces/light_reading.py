"""Reads from a face in a photograph where its key light stands, and which style it shows.

It is compared with the generic head under single lamps from all around, alone and beside a frontal
fill, and with the styles' targets: what counts is the correlation over the skin, and how each place
differs from its mirror image, which has the same skin. Only the stated error is fitted to people.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bools, Bytes, Float32, Float64, Indices
from app.core.base.colour import luminance
from app.core.base.sphere import directions
from app.core.faces.finder import Face, face_mesh
from app.core.faces.on_head import head_map, on_head
from app.core.faces.pose import HeadPose, head_pose
from app.core.styles.style_pack import load_named_pack

Key: TypeAlias = Literal["front", "behind", "flat"]

FRONTAL_DEG: Final = 10.0
"""A face that is turned by less looks into the lens."""

_STEP_DEG: Final = 5
_FARTHEST_DEG: Final = 130
_RISE_DEG: Final = (-45, 85)
_SIZES_DEG: Final = (10.0, 40.0, 80.0)
FILLS: Final = (8.0, 4.0, 2.5)  # key and fill to fill
_FILL_DEG: Final = 90.0
_ASIDE_DEG: Final = (15.0, 85.0)  # of a key that a fill can be told from
_PAIRS: Final = 3.0  # of likeness, for what differs between mirrored places beside a fill
_PAIRS_ALONE: Final = 1.0
_EVERY: Final = 3  # of the mirrored places
_FILL_GAIN: Final = 0.6  # of what differs without a fill: by so much it must be better with one
_UNSURE: Final = 0.3  # more or less of that, and both are likely
_ALL_ALIKE: Final = 1e-3  # of what differs without a fill: it tells nothing
_AT_ONCE: Final = 256
_LEAST_SIZE_DEG: Final = 8.0  # a texel and a half
_EDGE_DEG: Final = 1.5
_SOFT: Final = 0.003  # of correlation: how much worse a lamp is that still counts
_ALIKE: Final = 0.01
_BEHIND_DEG: Final = 91.0
_BEHIND_RISE_DEG: Final = (-25.0, 75.0)  # lower or higher, the direction is told
_PROFILE_DEG: Final = 50.0
_WELL_BEHIND_DEG: Final = 100.0  # of a key beside a fill
_LOPSIDED: Final = 0.02  # mean square of what differs between mirrored places: less is no rim
_FLASH_RISE_DEG: Final = 10.0
_LEAST_LIKE: Final = 0.55
_LEAST_SEEN: Final = 0.35
_LEAST_SHARE: Final = 0.3
_HALF_SHARE: Final = 0.5
_LEAST_SHADING: Final = 0.1  # of the mean, that the key explains
_FLAT_CONTRAST: Final = 0.4  # of the mean: paint and shine make so much in flat light
_FAINT: Final = 0.35  # of the mean: with more contrast, an unlike face has something in front of it
_LIT_COST: Final = (
    0.2  # of likeness, for each stop that more or less of the skin is lit by hard light
)
_LAMP: Final = 0.01  # of likeness, that each lamp of a style must bring


class Unread(Enum):
    """Why no direction of light was read from a face."""

    PROFILE = "profile"
    HIDDEN = "hidden"
    FLAT = "flat"
    MIXED = "mixed"  # something hides a part, or several lamps light it


@dataclass(frozen=True, slots=True)
class FaceLight:
    """What a face says of its light.

    Attributes:
        azimuth_deg, elevation_deg: Where the key stands, from the face's own front, positive toward
            the sitter's left, and from level; None for one from behind or that was not read.
        key: "behind" for light from beyond some 95 degrees, whose direction no face tells; "flat"
            for light that shades the face too little to have a direction.
        error_deg: Angle to the key's true direction that holds in 70 % of all cases.
        softness_deg: How large the key looks.
        fill_ratio: Key and frontal fill to the fill alone; None where no fill was read.
        ratio_stops: How much brighter the brighter cheek is than the other.
        styles: Names and likeness, 0 to 1, of the styles that it may be, the likeliest first.
        reason: Why it was not read, or has no direction; None when it was.
    """

    pose: HeadPose
    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    key: Key | None = None
    error_deg: float | None = None
    softness_deg: float | None = None
    fill_ratio: float | None = None
    ratio_stops: float | None = None
    styles: tuple[tuple[str, float], ...] = ()
    reason: Unread | None = None

    @property
    def at_lens(self) -> bool:
        """Whether the key may stand at the lens, or up to 10 degrees above, as a flash does."""
        if self.azimuth_deg is None or self.elevation_deg is None or self.error_deg is None:
            return False
        from_side = abs(self.pose.yaw_deg) >= FRONTAL_DEG
        aside = wrap(self.azimuth_deg + self.pose.yaw_deg * from_side)
        above = min(max(self.elevation_deg, 0.0), _FLASH_RISE_DEG)
        return math.hypot(aside, self.elevation_deg - above) <= self.error_deg


@dataclass(frozen=True, slots=True, eq=False)
class _LampSet:
    """Single lamps.

    Attributes:
        ways, sizes: (n, 3) and (n,) float64. Where they are from the head, and how large, deg.
        pictures, fill: (n, Q) and (Q,) float32. What they and a frontal fill show on the skin.
        pairs: (1 + F, n, M) float32. How a place and its mirror image differ, by their sum: alone
            and beside each fill.
        halves: (2, M) intp. Those places, some of `HeadMap.halves`.
        aside, around: (n,) bool. Which may have a fill: in front, and with those from behind.
    """

    ways: Float64
    sizes: Float64
    pictures: Float32
    fill: Float32
    pairs: Float32
    halves: Indices
    aside: Bools
    around: Bools


@dataclass(frozen=True, slots=True)
class _Shading:
    """How light and shade of a face compare with those that its key would make alone.

    Attributes:
        contrast: Standard deviation over the skin, by its mean.
        fit: Correlation with the key's picture.
        share: Contrast that the key explains, by what it would make alone: its share of the light.
        lopsided: Mean square of what differs between mirrored places, by their sum.
    """

    contrast: float
    fit: float
    share: float
    lopsided: float

    @property
    def flat(self) -> bool:
        """Whether hardly any of the light comes from the key."""
        weak = self.share < _HALF_SHARE and self.fit * self.contrast < _LEAST_SHADING
        return self.contrast < _FLAT_CONTRAST and (self.share < _LEAST_SHARE or weak)

    @property
    def unlike(self) -> bool:
        """Whether a face that looks like the head under no lamp has more than faint shading."""
        return self.share < _LEAST_SHARE or self.contrast > _FAINT


@dataclass(frozen=True, slots=True, eq=False)
class _Key:
    """A key: the way there, its size and how sure that is, deg; what fill, and how likely."""

    way: Float64
    size: float
    spread: float
    fill: int = 0
    likely: float = 0.0


def read_light(picture: Bytes, face: Face, focal_px: float | None = None) -> FaceLight:
    """Read the key's direction and softness, the lighting ratio and the style from a face.

    Args:
        picture: (H, W, 3) uint8. sRGB, upright, as the camera took it: not mirrored.
        focal_px: Focal length, pixels, where it is known.
    """
    pose = head_pose(face, (picture.shape[0], picture.shape[1]), focal_px)
    return light_on_head(*on_head(picture, face), pose)


def light_on_head(grey: Float32, visible: Bools, pose: HeadPose) -> FaceLight:
    """Read the same from a face that was brought onto the head, see `on_head`."""
    reading = FaceLight(pose)
    if abs(pose.yaw_deg) > _PROFILE_DEG:
        return replace(reading, reason=Unread.PROFILE)
    values, skin_visible = grey[head_map().skin], visible[head_map().skin]
    if skin_visible.mean() < _LEAST_SEEN:
        return replace(reading, reason=Unread.HIDDEN)
    reading = replace(reading, ratio_stops=_ratio(grey, visible))
    likeness = _likeness(values, skin_visible, _lamps().pictures, _lamps().fill, FILLS)
    apart, lopsided = _apart(grey, visible)
    alone, key = _mean(likeness[0]), _key(likeness, apart, _lamps().aside)
    reading = replace(reading, styles=_styles(values, skin_visible, alone.size))
    shading = _shading(values[skin_visible], skin_visible, key, lopsided)
    if shading.flat:
        return replace(reading, key="flat", softness_deg=None, reason=Unread.FLAT)
    rim = _key(likeness, apart, _lamps().around)
    if _is_behind(reading.pose, alone, rim, shading):
        return replace(reading, key="behind", softness_deg=alone.size)
    if likeness[0].max() < _LEAST_LIKE and shading.unlike:
        return replace(reading, reason=Unread.MIXED)
    return _with_key(reading, key, shading)


def _is_behind(pose: HeadPose, alone: _Key, rim: _Key, shading: _Shading) -> bool:
    """Tell a key from behind: alone, or as a rim beside a fill that lights the rest of the face."""
    low, high = _BEHIND_RISE_DEG
    azimuth, elevation = _level(pose, alone.way)
    if abs(azimuth) > _BEHIND_DEG and low < elevation < high:
        return True
    azimuth, elevation = _level(pose, rim.way)
    beside = rim.likely > 0.5 and shading.lopsided > _LOPSIDED
    return beside and abs(azimuth) > _WELL_BEHIND_DEG and low < elevation < high


def _with_key(reading: FaceLight, key: _Key, shading: _Shading) -> FaceLight:
    """Add where the key stands."""
    azimuth, elevation = _level(reading.pose, key.way)
    if abs(reading.pose.yaw_deg) >= FRONTAL_DEG:
        azimuth = wrap(azimuth - reading.pose.yaw_deg)
    return replace(
        reading,
        azimuth_deg=azimuth,
        elevation_deg=elevation,
        key="front",
        error_deg=_error(key, shading, azimuth, elevation),
        softness_deg=key.size,
        fill_ratio=FILLS[key.fill - 1] if key.likely > 0.5 else None,
    )


def _error(key: _Key, shading: _Shading, azimuth: float, elevation: float) -> float:
    """Angle within which 70 % of the true keys lie, deg.

    Its logarithm is linear in what the fit shows: quantile regression over 19 people under single
    lamps and beside fills of 8:1 to 1.5:1 (`benchmarks/faces/photos.py`, left out one by one).
    """
    return math.exp(
        1.096
        + 0.272 * key.spread / 5
        - 0.638 * math.log(max(shading.fit, 0.2))
        - 0.493 * math.log(min(max(shading.share, 0.1), 1.2))
        + 0.672 * key.size / 80
        + 0.428 * min(shading.lopsided, 0.8)
        + 0.200 * key.likely
        + 0.102 * min(max(-elevation, 0.0), 60.0) / 30
        + 0.087 * min(max(elevation, 0.0), 60.0) / 30
        + 0.218 * math.sin(math.radians(azimuth)) ** 2
    )


def _shading(values: Float32, visible: Bools, key: _Key, lopsided: float) -> _Shading:
    """Hold the skin that is shown, (q,), against the picture of the lamp nearest to a key."""
    lamps = _lamps()
    near = lamps.ways @ key.way - 1e-5 * np.abs(lamps.sizes - key.size)
    alone = lamps.pictures[int(near.argmax()), visible].astype(np.float64)
    own = values.astype(np.float64)
    own, alone = (one / max(float(one.mean()), 1e-12) - 1 for one in (own, alone))
    contrast, other = (math.sqrt(float(np.mean(one**2))) for one in (own, alone))
    fit = float(np.mean(own * alone)) / max(contrast * other, 1e-12)
    return _Shading(contrast, fit, fit * contrast / max(other, 1e-12), lopsided)


def _level(pose: HeadPose, way: Float64) -> tuple[float, float]:
    """Azimuth and elevation as the lens sees them: up is up however the chin is held."""
    level = pose.facing_rotation @ usual_pose().facing_rotation.T @ way
    azimuth = math.degrees(math.atan2(level[0], level[2]))
    return azimuth, math.degrees(math.asin(min(max(float(level[1]), -1.0), 1.0)))


def _key(likeness: Float64, apart: Float64, filled: Bools) -> _Key:
    """Weigh the key alone against the key beside a fill; both are (1 + F, n).

    `filled`: (n,) bool. Which lamps may have a fill.
    """
    score = likeness - _PAIRS * apart
    score[1:, ~filled] = -math.inf
    alone, fill = int(score[0].argmax()), 1 + int(score[1:].max(axis=1).argmax())
    likely = 0.0
    if apart[0, alone] > _ALL_ALIKE:
        better = float((score[fill].max() - score[0, alone]) / apart[0, alone])
        likely = 1 / (1 + math.exp(min(max((_FILL_GAIN - better) / _UNSURE, -50.0), 50.0)))
    one, other = _mean(likeness[0] - _PAIRS_ALONE * apart[0]), _mean(score[fill])
    way = (1 - likely) * one.way + likely * other.way
    size = (1 - likely) * one.size + likely * other.size
    spread = (1 - likely) * one.spread + likely * other.spread
    return _Key(way / np.linalg.norm(way), size, spread, fill, likely)


def _mean(score: Float64) -> _Key:
    """Direction and size of the lamps that are likest."""
    lamps, best = _lamps(), float(score.max())
    weight = np.exp((score - best) / _SOFT)
    way = weight @ lamps.ways
    way /= np.linalg.norm(way)
    near = np.clip(lamps.ways[score > best - _ALIKE] @ way, -1, 1)
    spread = float(np.degrees(np.sqrt(np.mean(np.arccos(near) ** 2))))
    return _Key(way, float(weight @ lamps.sizes / weight.sum()), spread)


def _apart(grey: Float32, visible: Bools) -> tuple[Float64, float]:
    """How differently mirrored places differ from what lamps make of them, (1 + F, n), and at all.

    All 0 where too few are seen.
    """
    lamps = _lamps()
    one, other = grey[lamps.halves]
    share = visible[lamps.halves].all(axis=0).astype(np.float32)
    share /= share.sum() if share.mean() > _LEAST_SEEN else np.inf
    own = (one - other) / np.maximum(one + other, 1e-9)
    rows = [np.square(row) @ share - 2 * row @ (share * own) for row in lamps.pairs]
    lopsided = float(share @ own**2)
    return np.asarray(np.stack(rows) + lopsided, np.float64), lopsided


@lru_cache(maxsize=1)
def usual_pose() -> HeadPose:
    """How landmarks say that the generic head is held, though it is level and straight."""
    places = face_mesh().on_head * 1000
    depth = np.zeros((len(places), 1), np.float32)
    return head_pose(Face(np.concatenate([places, depth], axis=1), 1.0), (1000, 1000), 1e4)


def _likeness(
    values: Float32,
    visible: Bools,
    pictures: Float32,
    fill: Float32 | None = None,
    ratios: tuple[float, ...] = (),
) -> Float64:
    """Correlation of what is shown with pictures, (n, Q): alone and with fill; (1 + F, n)."""
    own = np.where(visible, values - values[visible].mean(), 0).astype(np.float32)
    counts = visible.astype(np.float32)
    fill = np.zeros_like(own) if fill is None else fill
    product, total, mixed = (pictures @ np.stack([own, counts, fill * counts], axis=1)).T
    square = np.square(pictures) @ counts
    rows = []
    for share in (0.0, *(1 / (ratio - 1) for ratio in ratios)):
        sums = total + share * float(fill @ counts)
        squares = square + 2 * share * mixed + share**2 * float(fill**2 @ counts)
        size = np.sqrt(np.maximum(squares - sums**2 / counts.sum(), 0))
        rows.append((product + share * float(fill @ own)) / np.maximum(size, 1e-12))
    return np.asarray(np.stack(rows) / max(float(np.linalg.norm(own)), 1e-12), np.float64)


def _styles(values: Float32, visible: Bools, size_deg: float) -> tuple[tuple[str, float], ...]:
    """Styles by the likeness of their targets: of light, and of its root, which sees into shade."""
    names, lamps, targets = _targets()
    score = _likeness(values, visible, targets)[0]
    score += _likeness(np.sqrt(np.maximum(values, 0)), visible, np.sqrt(np.maximum(targets, 0)))[0]
    # How much of the skin is lit tells lamps apart of which it sees more and less; the softer the
    # light, or the more fill, the less so.
    hard = (_SIZES_DEG[-1] - size_deg) / (_SIZES_DEG[-1] - _SIZES_DEG[0])
    lit_difference = _lit_share(values[None, visible])[0] - _lit_share(targets[:, visible])
    # Of two that look alike on the skin, it is the one with fewer lamps.
    score = np.clip(
        score / 2 - _LIT_COST * hard * np.abs(lit_difference) - _LAMP * (lamps - 1), 0, 1
    )
    order = np.argsort(-score, kind="stable")
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


def _ratio(grey: Float32, visible: Bools) -> float | None:
    """Stops from the darker cheek to the brighter one; None where one is not seen."""
    means = [float(grey[cheek & visible].sum()) for cheek in head_map().cheeks]
    counts = [int((cheek & visible).sum()) for cheek in head_map().cheeks]
    if not (min(counts) and min(means) > 0.0):
        return None
    return abs(math.log2(means[0] / counts[0] * counts[1] / means[1]))


@lru_cache(maxsize=1)
def _lamps() -> _LampSet:
    """Light the generic head by single lamps from all around, and by a fill."""
    head = head_map()
    azimuths = np.arange(-_FARTHEST_DEG, _FARTHEST_DEG + 1, _STEP_DEG)
    elevations = np.arange(_RISE_DEG[0], _RISE_DEG[1] + 1, _STEP_DEG)
    grid = np.meshgrid(_SIZES_DEG, elevations, azimuths, indexing="ij")
    sizes, rise, across = (part.ravel().astype(np.float64) for part in grid)
    ways = _ways(across, rise)
    light = _light(np.append(ways, [[0, 0, 1]], axis=0), np.append(sizes, _FILL_DEG))
    pictures = light @ head.blurred(head.transport.luminance_basis.T)
    halves = head.halves[:, ::_EVERY]
    basis = head.blurred(head.transport.luminance_basis.T, halves.ravel())
    one, other = np.split(light @ basis, 2, axis=1)
    total = one + other
    shares = np.array([0.0, *(1 / (ratio - 1) for ratio in FILLS)], np.float32)[:, None, None]
    pairs = (one - other)[:-1] / np.maximum(total[:-1] + shares * total[-1], np.float32(1e-9))
    low, high = _ASIDE_DEG
    off = np.degrees(np.arcsin(np.minimum(np.abs(ways[:, 0]), 1)))
    return _LampSet(
        ways,
        sizes,
        pictures[:-1],
        pictures[-1],
        pairs,
        halves,
        (off >= low) & (np.abs(across) <= high),
        off >= low,
    )


def _light(ways: Float64, sizes: Float64) -> Float32:
    """Lamps in the transport's basis, (n, R), all as bright to a meter that points at them."""
    transport = head_map().transport
    texels = directions(transport.environment_shape).reshape(-1, 3)
    level = np.hypot(texels[:, 0], texels[:, 2])
    values = np.empty((len(ways), len(transport.texel_basis)), np.float32)
    # In parts: all at once would take a hundred megabytes for a moment.
    for start in range(0, len(ways), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        size = sizes[part, None].astype(np.float32)
        apart = np.degrees(np.arccos(np.clip(ways[part].astype(np.float32) @ texels.T, -1, 1)))
        beyond = (apart - np.maximum(size, _LEAST_SIZE_DEG) / 2) / _EDGE_DEG
        light = 1 / (1 + np.exp(np.minimum(beyond, 80)))
        cap_share = 0.5 * (1 + np.cos(np.radians(size) / 2))
        light /= cap_share * (light @ level)[:, None]
        values[part] = light @ transport.texel_basis.T
    return values


def _ways(azimuth_deg: Float64, elevation_deg: Float64) -> Float64:
    """Unit vectors of the head frame, (n, 3)."""
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    return np.stack([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)], axis=1)
