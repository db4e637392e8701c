"""Estimate of the key light and the style from a face in a photo.

The face is compared with the targets of the styles and with the generic head, which is lit by
single lamps from every direction, with and without a frontal fill. The criteria are the correlation
over the skin and the difference between each point and its mirror image, which has the same skin.
Only the reported error is fitted to real people.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.base.colour import luminance
from app.core.faces.face_on_head import head_map, on_head
from app.core.faces.finder import Face, face_mesh
from app.core.faces.lamp_likeness import FILLS, SIZES_DEG, likeness_of, single_lamps
from app.core.faces.pose import HeadPose, head_pose
from app.core.styles.style_pack_file import load_named_pack

Key: TypeAlias = Literal["front", "behind", "flat"]

FRONTAL_DEG: Final = 10.0
"""Smallest yaw, in degrees, at which a face counts as turned away from the lens."""
_PAIRS: Final = 3.0  # weight, in likeness, of differences between mirrored places with a fill
_PAIRS_ALONE: Final = 1.0
_FILL_GAIN: Final = 0.6  # fraction of the difference without a fill that the fill must explain
_UNSURE: Final = 0.3  # width of the transition around that fraction
_ALL_ALIKE: Final = 1e-3  # difference without a fill that is too small to compare
_SOFT: Final = 0.003  # difference in correlation at which the weight of a lamp falls to 1/e
_ALIKE: Final = 0.01
_BEHIND_DEG: Final = 91.0
_BEHIND_RISE_DEG: Final = (-25.0, 75.0)  # for a key below or above, the direction is known
_PROFILE_DEG: Final = 50.0
_WELL_BEHIND_DEG: Final = 100.0  # azimuth beyond which a key with a fill is behind the sitter
_LOPSIDED: Final = 0.02  # mean square difference of mirrored places; with less, there is no rim
_FLASH_RISE_DEG: Final = 10.0
_LEAST_LIKE: Final = 0.55
_LEAST_SEEN: Final = 0.35
_LEAST_SHARE: Final = 0.3
_HALF_SHARE: Final = 0.5
_LEAST_SHADING: Final = 0.1  # minimum shading explained by the key, as a fraction of the mean
# contrast that make-up and shine reach in flat light, as a fraction of the mean
_FLAT_CONTRAST: Final = 0.4
# fraction of the mean; with more contrast, something covers a part of the face
_FAINT: Final = 0.35
_LIT_COST: Final = 0.2  # likeness lost per stop of difference in the lit fraction of the skin
_LAMP: Final = 0.01  # likeness that each further lamp of a style must add


class Unread(Enum):
    """The reason why no direction of light was found from a face."""

    PROFILE = "profile"
    HIDDEN = "hidden"
    FLAT = "flat"
    MIXED = "mixed"  # part of the face is hidden, or several lamps light it


@dataclass(frozen=True, slots=True)
class FaceLight:
    """The light on a face.

    Attributes:
        azimuth_deg, elevation_deg: Direction of the key light, in degrees. The azimuth is measured
            from the front of the face, positive towards the sitter's left. The elevation is
            measured from the horizontal. Both are None if the key light is behind the sitter or
            unknown.
        key: "behind" for light from beyond about 95 degrees, whose direction cannot be seen on a
            face, or "flat" for light that shades the face too little to have a direction.
        error_deg: Angle within which the true direction of the key light lies in 70% of all cases.
        softness_deg: Diameter of the key light, in degrees.
        fill_ratio: Ratio of key plus frontal fill to the fill alone, or None if no fill was
            detected.
        ratio_stops: Ratio of the brighter cheek to the darker one, in stops, or None if unknown.
        styles: Names of the possible styles with their likeness, 0 to 1, most likely first.
        reason: The reason why there is no direction, or None if there is one.
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
        """Whether the key light may be at the lens, or up to 10 degrees above it, like a flash."""
        if self.azimuth_deg is None or self.elevation_deg is None or self.error_deg is None:
            return False
        from_side = abs(self.pose.yaw_deg) >= FRONTAL_DEG
        aside = wrap(self.azimuth_deg + self.pose.yaw_deg * from_side)
        above = min(max(self.elevation_deg, 0.0), _FLASH_RISE_DEG)
        return math.hypot(aside, self.elevation_deg - above) <= self.error_deg


@dataclass(frozen=True, slots=True)
class _Shading:
    """The shading of a face, compared with its shading under the key light alone.

    Attributes:
        contrast: Standard deviation over the skin, divided by the mean.
        fit: Correlation with the head as lit by the key light.
        share: Fraction of the light that comes from the key light. This is the contrast that the
            key light explains, divided by the contrast under the key light alone.
        lopsided: Mean square of the difference between mirrored points divided by their sum.
    """

    contrast: float
    fit: float
    share: float
    lopsided: float

    @property
    def flat(self) -> bool:
        """Whether hardly any of the light comes from the key light."""
        weak = self.share < _HALF_SHARE and self.fit * self.contrast < _LEAST_SHADING
        return self.contrast < _FLAT_CONTRAST and (self.share < _LEAST_SHARE or weak)

    @property
    def unlike(self) -> bool:
        """Whether the key light explains too little, or the shading is more than faint."""
        return self.share < _LEAST_SHARE or self.contrast > _FAINT


@dataclass(frozen=True, slots=True, eq=False)
class _Key:
    """A key light: its unit vector, size and spread in degrees, fill ratio, and fill likelihood."""

    way: Float64
    size: float
    spread: float
    fill: int = 0
    likely: float = 0.0


def read_light(picture: Bytes, face: Face, focal_px: float | None = None) -> FaceLight:
    """Estimate the direction and softness of the key light, the lighting ratio and the style.

    Args:
        picture: (H, W, 3) uint8. Upright sRGB picture, not mirrored.
        focal_px: Focal length, in pixels, or None if unknown.
    """
    pose = head_pose(face, (picture.shape[0], picture.shape[1]), focal_px)
    return light_on_head(*on_head(picture, face), pose)


def light_on_head(grey: Float32, visible: Bools, pose: HeadPose) -> FaceLight:
    """Estimate the light on a face that has been mapped onto the head (see `on_head`)."""
    reading = FaceLight(pose)
    if abs(pose.yaw_deg) > _PROFILE_DEG:
        return replace(reading, reason=Unread.PROFILE)
    values, skin_visible = grey[head_map().skin], visible[head_map().skin]
    if skin_visible.mean() < _LEAST_SEEN:
        return replace(reading, reason=Unread.HIDDEN)
    reading = replace(reading, ratio_stops=_ratio(grey, visible))
    lamps = single_lamps()
    likeness = likeness_of(values, skin_visible, lamps.pictures, lamps.fill, FILLS)
    apart, lopsided = _apart(grey, visible)
    alone, key = _mean(likeness[0]), _key(likeness, apart, lamps.aside)
    reading = replace(reading, styles=_styles(values, skin_visible, alone.size))
    shading = _shading(values[skin_visible], skin_visible, key, lopsided)
    if shading.flat:
        return replace(reading, key="flat", softness_deg=None, reason=Unread.FLAT)
    rim = _key(likeness, apart, lamps.around)
    if _is_behind(reading.pose, alone, rim, shading):
        return replace(reading, key="behind", softness_deg=alone.size)
    if likeness[0].max() < _LEAST_LIKE and shading.unlike:
        return replace(reading, reason=Unread.MIXED)
    return _with_key(reading, key, shading)


def _is_behind(pose: HeadPose, alone: _Key, rim: _Key, shading: _Shading) -> bool:
    """Return whether the key light is behind the sitter, alone or as a rim with a frontal fill."""
    low, high = _BEHIND_RISE_DEG
    azimuth, elevation = _level(pose, alone.way)
    if abs(azimuth) > _BEHIND_DEG and low < elevation < high:
        return True
    azimuth, elevation = _level(pose, rim.way)
    beside = rim.likely > 0.5 and shading.lopsided > _LOPSIDED
    return beside and abs(azimuth) > _WELL_BEHIND_DEG and low < elevation < high


def _with_key(reading: FaceLight, key: _Key, shading: _Shading) -> FaceLight:
    """Add the direction of the key light to an estimate."""
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
    """Return the angle, in degrees, within which 70% of the true key lights lie.

    The logarithm of this angle is a linear function of properties of the fit. The function was
    found by quantile regression over 19 people under single lamps and with fills of 8:1 to 1.5:1
    (`benchmarks/faces/photos.py`, leaving one person out at a time).
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
    """Compare the visible skin, (q,), with the head as lit by the lamp nearest to a key light."""
    lamps = single_lamps()
    near = lamps.ways @ key.way - 1e-5 * np.abs(lamps.sizes - key.size)
    alone = lamps.pictures[int(near.argmax()), visible].astype(np.float64)
    own = values.astype(np.float64)
    own, alone = (one / max(float(one.mean()), 1e-12) - 1 for one in (own, alone))
    contrast, other = (math.sqrt(float(np.mean(one**2))) for one in (own, alone))
    fit = float(np.mean(own * alone)) / max(contrast * other, 1e-12)
    return _Shading(contrast, fit, fit * contrast / max(other, 1e-12), lopsided)


def _level(pose: HeadPose, way: Float64) -> tuple[float, float]:
    """Return the azimuth and the elevation in the lens's frame, disregarding the head's pitch."""
    level = pose.facing_rotation @ usual_pose().facing_rotation.T @ way
    azimuth = math.degrees(math.atan2(level[0], level[2]))
    return azimuth, math.degrees(math.asin(min(max(float(level[1]), -1.0), 1.0)))


def _key(likeness: Float64, apart: Float64, filled: Bools) -> _Key:
    """Find the key light from the likeness of lamps alone and of lamps with a fill.

    Args:
        likeness, apart: (1 + F, n). Values without a fill, followed by those with each fill ratio.
        filled: (n,) bool. Lamps that may have a fill.
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
    """Return the mean direction and size of the most similar lamps."""
    lamps, best = single_lamps(), float(score.max())
    weight = np.exp((score - best) / _SOFT)
    way = weight @ lamps.ways
    way /= np.linalg.norm(way)
    near = np.clip(lamps.ways[score > best - _ALIKE] @ way, -1, 1)
    spread = float(np.degrees(np.sqrt(np.mean(np.arccos(near) ** 2))))
    return _Key(way, float(weight @ lamps.sizes / weight.sum()), spread)


def _apart(grey: Float32, visible: Bools) -> tuple[Float64, float]:
    """Compare the differences between mirrored points with those under each lamp.

    Returns:
        The mean square error, (1 + F, n), and the mean square difference. All values are 0 if too
        few points are visible.
    """
    lamps = single_lamps()
    one, other = grey[lamps.halves]
    share = visible[lamps.halves].all(axis=0).astype(np.float32)
    share /= share.sum() if share.mean() > _LEAST_SEEN else np.inf
    own = (one - other) / np.maximum(one + other, 1e-9)
    rows = [np.square(row) @ share - 2 * row @ (share * own) for row in lamps.pairs]
    lopsided = float(share @ own**2)
    return np.asarray(np.stack(rows) + lopsided, np.float64), lopsided


@lru_cache(maxsize=1)
def usual_pose() -> HeadPose:
    """Return the pose that landmarks give for the generic head when it is level and straight."""
    places = face_mesh().on_head * 1000
    depth = np.zeros((len(places), 1), np.float32)
    return head_pose(Face(np.concatenate([places, depth], axis=1), 1.0), (1000, 1000), 1e4)


def _styles(values: Float32, visible: Bools, size_deg: float) -> tuple[tuple[str, float], ...]:
    """Rank the styles by the likeness of a face to their targets.

    The likeness is the mean of two values: one computed from the light, and one computed from its
    square root, which gives more weight to the shadows.
    """
    names, lamps, targets = _targets()
    score = likeness_of(values, visible, targets)[0]
    score += likeness_of(np.sqrt(np.maximum(values, 0)), visible, np.sqrt(np.maximum(targets, 0)))[
        0
    ]
    # The lit fraction of the skin separates frontal lamps from side lamps, unless they are soft.
    hard = (SIZES_DEG[-1] - size_deg) / (SIZES_DEG[-1] - SIZES_DEG[0])
    lit_difference = _lit_share(values[None, visible])[0] - _lit_share(targets[:, visible])
    # Of two similar styles, prefer the one with fewer lamps.
    score = np.clip(
        score / 2 - _LIT_COST * hard * np.abs(lit_difference) - _LAMP * (lamps - 1), 0, 1
    )
    order = np.argsort(-score, kind="stable")
    return tuple((names[row], float(score[row])) for row in order)


def _lit_share(pictures: Float32) -> Float64:
    """Return the ratio of the skin's mean to its brightest part, in stops, (n,)."""
    share = pictures.mean(axis=1) / np.maximum(np.percentile(pictures, 97, axis=1), 1e-9)
    return np.asarray(np.log2(np.maximum(share, 1e-3)), np.float64)


@lru_cache(maxsize=1)
def _targets() -> tuple[tuple[str, ...], Float64, Float32]:
    """Return the names of the styles, their numbers of lamps and their targets, (S, Q)."""
    pack, head = load_named_pack("generic"), head_map()
    pictures = luminance(pack.targets.astype(np.float32)).reshape(len(pack.styles), -1)
    lamps = np.array([len(style.lamps) for style in pack.styles], np.float64)
    targets = head.blurred(pictures[:, head.transport.pixels])
    return tuple(style.name for style in pack.styles), lamps, targets


def _ratio(grey: Float32, visible: Bools) -> float | None:
    """Return the ratio of the brighter to the darker cheek in stops, or None if one is hidden."""
    means = [float(grey[cheek & visible].sum()) for cheek in head_map().cheeks]
    counts = [int((cheek & visible).sum()) for cheek in head_map().cheeks]
    if not (min(counts) and min(means) > 0.0):
        return None
    return abs(math.log2(means[0] / counts[0] * counts[1] / means[1]))
