"""Unwrap a mirror ball to a panorama.

Each direction is looked up at the point where the ball reflects it. The normal at that point
bisects the angle between the direction and the camera. Because the camera is at a finite distance,
the point is found by iteration. The light is assumed to come from far away. All pixels cover the
same solid angle, but they become very narrow towards the rim, so the outermost ones count as gaps.
So does the photographer. Beyond the ball's edge, the picture shows the scene behind the ball. Where
the rim reflects the same scene, comparing the two reveals the colour of a tinted mirror.

Dirt is matt: everywhere on the ball, it shows its own colour times the light from half the sphere.
Details of the place do not, so the most common colour among the specks is that of the dirt. The
specks also reveal how far the sun exceeds the clipping level.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bools, Float32, Float64
from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.base.progress import Token
from app.core.base.remarks import Remark
from app.core.base.sphere import direction, directions, rotation
from app.core.environment.environment import reduce_radiance, solid_angles
from app.core.measure.ball.ball_finder import Ball
from app.core.measure.ball.remarks import BallBlind, BallColoured, BallDirty, BallSize, BallSmall
from app.core.measure.finish.masks import box_mask
from app.core.measure.options import WayOptions
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.resampling import light_in_bands, likeness, log_light
from app.core.text import tr

REFLECTANCE: Final = 0.66
"""Fraction of the light that chromium reflects at normal incidence (Palik)."""

BALL_M: Final = 0.12
"""Assumed diameter of a ball in metres, which determines the photographer's distance and width."""

_RIM_PX: Final = 1.5  # width of the excluded rim
_FINEST: Final = 1024  # maximum rows of a panorama
_SUPERSAMPLED: Final = 2
# Half the width and the range of heights relative to the lens, of head and body, in metres.
_PERSON_M: Final = ((0.18, -0.1, 0.2), (0.33, -1.7, -0.05))
# distances of the background in radii, the most usual first
_BEHIND: Final = (60.0, 1e6, 150.0, 100.0, 80.0, 48.0, 38.0, 30.0, 24.0)
_LEAST_BOTH: Final = 16  # minimum texels of a coarse panorama in both picture and rim
_LENSES: Final = (28.0, 35.0, 50.0, 70.0, 85.0, 105.0, 135.0)  # mm on 24 x 36
_NEARLY: Final = 0.9  # fraction of the best similarity
_COARSE: Final = 128  # rows, for the search for the background's distance
_PAST: Final = 0.03  # weight of the scene past the ball, as low as that of the rim
# Stops between the quartiles of the mirror's colour, divided by the root of their share.
_UNSURE: Final = 10.0
_LEAST_SHARE: Final = 3e-4  # minimum fraction of the panorama for estimating a colour
_COLOURED: Final = 0.25  # difference between channels that chrome never reaches, even at the rim
_MATT: Final = (32, 64)  # rows and columns of a matt ball's picture
# In natural logarithms: evenness of a speck, similarity of dirt to one colour, and difference of
# dirt from its surroundings.
_FLAT: Final = 0.15
_SAME: Final = 0.15
_COOL: Final = 0.1  # dirt is hardly bluer than white
_WARM: Final = 1.1
_COLOURS: Final = (math.log(0.05), 0.0)  # the mirror's own share is 0
_SUNS: Final = tuple(2.0 ** (k / 4) for k in range(40))  # brightness relative to the clipping level
_LEAST_SPECKS: Final = 6
_LEAST_SAME: Final = 0.2  # minimum fraction of all specks
_LEAST_PERSON_DEG: Final = 5.0
_MOST_PERSON_DEG: Final = 25.0


@dataclass(frozen=True, slots=True)
class BallOptions(WayOptions):
    """Options for a mirror ball.

    Attributes:
        second: Exposures taken from another side, or an empty tuple if there are none.
        from_deg: Approximate azimuth of the camera in those exposures, or None to estimate it.
        reflectance: Reflectance of the mirror at normal incidence.
        pitch_deg: Elevation of the camera's axis, in degrees.
    """

    second: tuple[Path, ...] = ()
    from_deg: float | None = None
    reflectance: float = REFLECTANCE
    pitch_deg: float = 0.0

    @property
    def more_files(self) -> tuple[Path, ...]:
        """The exposures taken from another side."""
        return self.second


@dataclass(frozen=True, slots=True)
class Side:
    """The panorama in a ball, as seen from one side, with the photographer at azimuth 0.

    Attributes:
        texels: (H, W, 5) float32. Radiance, and the clipped and dark fractions.
        weight: (H, W) float32. Relative resolution from 0 to 1, and 0 in gaps.
        notes: Remarks about the ball and the lens.
    """

    texels: Float32 = field(repr=False)
    weight: Float32 = field(repr=False)
    notes: tuple[Remark, ...] = ()

    @property
    def blind(self) -> Float32:
        """A mask of the gaps, (H, W) float32, which is 1 in a gap."""
        return (self.weight <= 0.0).astype(np.float32)


def panorama_rows(radius_px: float) -> int:
    """Return a panorama's row count, a multiple of 8 slightly finer than the ball's middle."""
    return min(max(8 * round(radius_px * 0.625 * math.pi / 8.0), 64), _FINEST)


def unwrap(
    merged: MergedLight, ball: Ball, rows: int, options: BallOptions, token: Token | None = None
) -> Side:
    """Resample merged light, (H, W, 3), to the panorama reflected in a ball, (rows, 2 rows).

    Fractions of an area are preserved, and clipped light stays clipped. The scene behind the ball
    is taken from the picture around the ball.
    """
    axes = _upright_axes(ball, options.pitch_deg)
    side = _reflection(merged, ball, rows, options, token or Token())
    side = _without_dirt(side, _camera(ball, axes))
    picture, ball, far, _ = _behind(side, merged, ball, axes)
    background, visible = _past(picture, ball, axes, side.weight.shape, far)
    return _mixed(_without_tint(side, background, visible), Side(background, _PAST * visible))


def find_lens(merged: MergedLight, ball: Ball, options: BallOptions, token: Token) -> Ball:
    """Estimate a missing focal length from the background.

    Several focal lengths may make the picture beyond the ball nearly as similar as possible to the
    reflection at the rim. The shortest of these is chosen, since a longer one leaves too little to
    compare.
    """
    trials = []
    for mm in _LENSES:
        trial = ball.seen_by(mm)
        side = _reflection(merged, trial, _COARSE, options, token)
        axes = _upright_axes(trial, options.pitch_deg)
        trials.append((trial, _behind(side, merged, trial, axes, _LEAST_BOTH)[-1]))
    most = max(alike for _, alike in trials)
    return next((trial for trial, alike in trials if 0.0 < alike >= _NEARLY * most), ball)


def _reflection(
    merged: MergedLight, ball: Ball, rows: int, options: BallOptions, token: Token
) -> Side:
    """Return the panorama of the reflection alone."""
    axes = _upright_axes(ball, options.pitch_deg)
    size, planes = (rows, 2 * rows), (merged.radiance, merged.shares)
    every = directions((_SUPERSAMPLED * rows, 2 * _SUPERSAMPLED * rows))

    def band(start: int, stop: int) -> tuple[Float32, Float32]:
        x, y, cosine, _ = _reflected(ball, axes, every[start:stop])
        light, clipping = (
            cv2.remap(plane, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            for plane in planes
        )
        return light / metal(cosine, options.reflectance)[..., None], np.asarray(
            clipping, np.float32
        )

    bands = light_in_bands(size, _SUPERSAMPLED, _SUPERSAMPLED, band, token)
    _, _, cosine, share = _reflected(ball, axes, directions(size))
    weight = cosine**2 * (share <= 1.0 - _RIM_PX / ball.radius_px)
    weight *= 1.0 - _photographer(ball, axes, size)
    return Side(np.dstack(bands), weight.astype(np.float32))


def _without_dirt(side: Side, camera: Float32) -> Side:
    """Fill specks of dirt from their surroundings and reduce their weight to almost zero.

    Nothing is filled if there are too few specks to distinguish from small objects in the place.

    Args:
        camera: (3,) float32. Position of the lens, as returned by `_camera`.
    """
    light, rows = side.texels[..., :3], side.weight.shape[0]
    tones, square = np.log(np.maximum(light, np.float32(1e-6) * light.mean())), np.ones((3, 3))
    flat = (cv2.dilate(tones, square) - cv2.erode(tones, square)).max(axis=-1) < _FLAT
    grey = np.clip(20.0 * (tones.mean(axis=-1) - tones.max()) + 255.0, 0.0, 255.0).astype(np.uint8)
    apart = cv2.absdiff(grey, cv2.medianBlur(grey, rows // 20 | 1)) > 20.0 * _SAME
    specks = flat & apart & (side.weight > 0.1)
    specks[: rows // 7] = specks[-(rows // 7) :] = False  # stretched at the poles
    clipped = side.texels[..., 3:4]
    matt, burnt = (_matt(light * share, camera) for share in (1.0 - clipped, clipped))
    fits = [
        _commonest(tones[specks] - np.log(matt[specks] + sun * burnt[specks]))
        for sun in (_SUNS if burnt.any() else _SUNS[:1])
    ]
    best = int(np.argmax([same.sum() for _, same in fits]))
    colour, specks[specks] = fits[best]
    count, _ = cv2.connectedComponents(cv2.dilate(specks.astype(np.uint8), square))
    if count <= _LEAST_SPECKS:
        return side
    colours = tones - np.log(matt + _SUNS[best] * burnt)
    dirty = (np.abs(colours - colour).max(axis=-1) < _SAME).astype(np.uint8)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (rows // 32 | 1, rows // 32 | 1))
    large = cv2.dilate(cv2.morphologyEx(dirty, cv2.MORPH_OPEN, disc), np.ones((5, 5), np.uint8))
    dirty = cv2.dilate(np.where(large > 0, 0, dirty).astype(np.uint8), square)
    filled = [cv2.inpaint(plane, dirty, 3, cv2.INPAINT_NS) for plane in cv2.split(tones)]
    texels = side.texels.copy()
    texels[dirty > 0, :3] = np.exp(np.dstack(filled)[dirty > 0])
    areas = solid_angles((rows, 2 * rows))[:, None] * (side.weight > 0.0)
    dirt = BallDirty(float((areas * dirty).sum() / areas.sum()))
    return Side(texels, side.weight * (1.0 - np.float32(0.95) * dirty), (dirt,))


def _matt(light: Float32, camera: Float32) -> Float32:
    """Return the light, (H, W, 3), of a matt white ball at the points that reflect each texel."""
    ways = directions(_MATT).reshape(-1, 3)
    normals = ways + camera / np.linalg.norm(camera)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
    areas = np.repeat(solid_angles(_MATT), _MATT[1])[:, None].astype(np.float32)
    small = areas * reduce_radiance(np.ascontiguousarray(light), _MATT).reshape(-1, 3)
    irradiance = (np.maximum(normals @ ways.T, 0.0) @ small / np.float32(math.pi)).reshape(
        *_MATT, 3
    )
    return np.asarray(cv2.resize(irradiance, light.shape[1::-1]), np.float32)


def _commonest(colours: Float32) -> tuple[Float64, Bools]:
    """Return the most common of the given colours, (N, 3), and a mask of the colours that match it.

    The mask is empty if too few colours match.
    """
    warmth = -np.diff(colours)
    fit = (warmth > -_COOL).all(axis=-1) & (warmth.sum(axis=-1) < _WARM)
    counts, edges = np.histogramdd(colours[fit], bins=30, range=[_COLOURS] * 3)
    place = np.unravel_index(int(counts.argmax()), counts.shape)
    colour = np.array([bins[k : k + 2].mean() for bins, k in zip(edges, place, strict=True)])
    same = fit
    for _ in range(4):
        same = fit & (np.abs(colours - colour).max(axis=-1) < _SAME)
        if same.sum() < max(_LEAST_SAME * fit.sum(), 1):
            return colour, np.zeros_like(fit)
        colour = np.median(colours[same], axis=0)
    return colour, same


def _behind(
    side: Side, merged: MergedLight, ball: Ball, axes: Float64, least: int = 0
) -> tuple[Float32, Ball, float, float]:
    """Estimate the distance of the background behind a ball from its similarity to the rim.

    Returns:
        The picture, (h, w, 5), at the panorama's resolution; the ball in that picture; the distance
        in ball radii; and the similarity, which is a correlation, or -1 if the two share fewer than
        `least` texels.
    """
    share = min(side.weight.shape[0] / (math.pi * ball.focal), 1.0)
    resize = partial(cv2.resize, dsize=None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
    picture = np.dstack([resize(merged.radiance), resize(merged.shares)]).astype(np.float32)
    ball, coarse = ball.resized((picture.shape[0], picture.shape[1])), (_COARSE, 2 * _COARSE)
    tones, weight = _small(side, coarse)

    def alike(far: float) -> float:
        background, visible = _past(picture, ball, axes, coarse, far)
        few = float(np.count_nonzero(weight * visible) < least)
        return (
            likeness((tones, log_light(luminance(background[..., :3]))), (weight, visible), 0) - few
        )

    far = max(_BEHIND, key=alike)
    return picture, ball, far, alike(far)


def _without_tint(side: Side, background: Float32, visible: Float32) -> Side:
    """Remove the tint of a ball that is not chrome by comparing its rim with the background.

    Coloured glass has almost the same tint from the middle to the rim. Chrome does not, so it is
    left unchanged.
    """
    both = (np.minimum(side.weight, visible) > 0.0) & (background[..., :3].min(axis=-1) > 0.0)
    both &= (side.texels[..., 3] + background[..., 3]) == 0.0
    if both.mean() < _LEAST_SHARE:
        return side
    stops = np.log2(np.maximum(side.texels[both, :3], np.float32(1e-9)) / background[both, :3])
    stops -= stops.mean(axis=-1, keepdims=True)
    low, middle, high = np.percentile(stops, (25, 50, 75), axis=0)
    tint = np.exp2(middle).astype(np.float32)
    tint /= luminance(tint)
    if (high - low).max() > _UNSURE * math.sqrt(both.mean()) or np.ptp(tint) < _COLOURED:
        return side
    texels = side.texels.copy()
    texels[..., :3] /= tint
    red, green, blue = (float(each) for each in tint)
    return replace(side, texels=texels, notes=(*side.notes, BallColoured(red, green, blue)))


def _past(
    picture: Float32, ball: Ball, axes: Float64, shape: tuple[int, int], far: float
) -> tuple[Float32, Float32]:
    """Return the scene `far` radii from the ball as a panorama, and a mask of the visible part."""
    rays = np.float32(far) * directions(shape) - _camera(ball, axes)
    rays = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)) @ axes.T.astype(np.float32)
    x, y = ball.project(rays)
    rows, columns = picture.shape[:2]
    visible = (np.minimum(x, y) >= 0.0) & (x < columns - 1) & (y < rows - 1) & (rays[..., 2] > 0.0)
    visible &= rays @ ball.axis.astype(np.float32) < math.cos(1.1 * ball.angle)
    background = cv2.remap(picture, x, y, cv2.INTER_LINEAR)
    return np.asarray(background, np.float32), visible.astype(np.float32)


def _camera(ball: Ball, axes: Float64) -> Float32:
    """Return the lens position in panorama coordinates, in ball radii from the ball's centre."""
    return np.asarray(-(ball.axis @ axes) / math.sin(ball.angle), np.float32)


def metal(cosine: Float32, reflectance: float) -> Float32:
    """Return the reflectance of a metal for the given cosine of the angle of incidence.

    The result follows from Fresnel's equations for a conductor (Pharr, Jakob and Humphreys,
    Physically Based Rendering, 9.3) in unpolarised light, with n = k. This nearly holds for chrome,
    so one number is enough.
    """
    rest = 1.0 - reflectance
    n = (2.0 - rest + math.sqrt((2.0 - rest) ** 2 - 2.0 * rest**2)) / (2.0 * rest)
    both, twice = np.float32(2.0 * n * n), np.float32(2.0 * n) * cosine
    square = cosine * cosine
    across = (both - twice + square) / (both + twice + square)
    along = (both * square - twice + 1.0) / (both * square + twice + 1.0)
    return np.asarray(0.5 * (across + along), np.float32)


def _upright_axes(ball: Ball, pitch_deg: float) -> Float64:
    """Return the camera's right, up and forward vectors as rows, with the ball at -Z.

    The vectors are given in panorama coordinates.
    """
    right, ahead = np.array([1.0, 0.0, 0.0]), direction(180.0, pitch_deg)
    level = np.stack([right, np.cross(right, ahead), ahead])
    toward = ball.axis @ level
    return level @ rotation(math.degrees(math.atan2(-toward[0], -toward[2]))).T


def _reflected(
    ball: Ball, axes: Float64, vectors: Float32
) -> tuple[Float32, Float32, Float32, Float32]:
    """Find the points on a ball that reflect light from the given directions, (..., 3).

    The unit of length is the ball's radius, and the origin is the ball's centre. Three rounds leave
    an error of less than 0.001 degrees, except for hidden directions.

    Returns:
        The columns, the rows, the cosines of the angle of incidence and the fractions of the
        radius, (...) float32 each.
    """
    camera = _camera(ball, axes)
    view = np.broadcast_to(camera / np.linalg.norm(camera), vectors.shape)
    for _ in range(4):
        normal = vectors + view
        normal = normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
        view = camera - normal
        view = view / np.linalg.norm(view, axis=-1, keepdims=True)
    cosine = np.clip((normal * view).sum(axis=-1), 0.0, 1.0).astype(np.float32)
    rays = -(view @ axes.T.astype(np.float32))
    x, y = ball.project(rays)
    ahead = np.minimum(rays @ ball.axis.astype(np.float32), 1.0)
    share = np.sqrt(np.maximum(1.0 / ahead**2 - 1.0, 0.0)) / math.tan(ball.angle)
    return x, y, cosine, np.asarray(share, np.float32)


def _photographer(ball: Ball, axes: Float64, shape: tuple[int, int]) -> Float32:
    """Return a mask, (H, W), of the head and body of the person holding the camera."""
    away = 0.5 * BALL_M / math.sin(ball.angle)
    lens = math.degrees(math.asin(-float(ball.axis @ axes[:, 1])))
    mask = np.zeros(shape, np.float32)
    for part in _PERSON_M:
        half, low, high = (math.degrees(math.atan(each / away)) for each in part)
        half = min(max(half, _LEAST_PERSON_DEG), _MOST_PERSON_DEG)
        low, high = max(lens + low, -90.0), min(lens + high, 90.0)
        mask = np.maximum(mask, box_mask(-half, half, low, high, shape))
    return mask


_APART_DEG: Final = 15.0  # possible error of the second photographer's azimuth
_LEAST_ALIKE: Final = (0.4, 0.8)  # with the user's azimuth, and without


def join_sides(first: Side, second: Side, from_deg: float | None = None) -> Side:
    """Merge two sides of a ball into the first side's panorama, weighted by resolution.

    Args:
        from_deg: Approximate azimuth of the second photographer, or None to estimate it from the
            panoramas.

    Raises:
        ProbeError: If the two sides have nothing in common or show the same side.
    """
    angle, most = (0.0, 180.0) if from_deg is None else (from_deg, _APART_DEG)
    # The scene past the ball has a different parallax from the other side.
    sides = [replace(side, weight=np.maximum(side.weight - _PAST, 0.0)) for side in (first, second)]
    for rows in (_COARSE, 4 * _COARSE):
        tones, weights = zip(*(_small(side, (rows, 2 * rows)) for side in sides), strict=True)
        step = 180.0 / rows
        turns = np.arange(angle - most, angle + most + step / 2, step)
        alike = [likeness(tones, weights, round(turn / step)) for turn in turns]
        angle, most = float(turns[int(np.argmax(alike))]), 2.0 * step
    if max(alike) < _LEAST_ALIKE[from_deg is None] or abs(wrap(angle)) < _APART_DEG:
        raise ProbeError(
            tr("The second set of pictures does not show the same ball from another side."),
            tr(
                "Walk about a quarter of a circle around the ball before taking them. If the "
                "place looks much the same all around, set the angle with --from, clockwise as "
                "seen from above."
            ),
        )
    shift = round(angle / 360.0 * first.weight.shape[1])
    other, weight = (np.roll(each, shift, axis=1) for each in (second.texels, second.weight))
    both = (first.weight > 0.0) & (weight > 0.0)
    one, two = (luminance(each[both][:, :3]) + 1e-12 for each in (first.texels, other))
    other[..., :3] *= np.float32(np.exp(np.median(np.log(one / two))))
    notes = tuple(dict.fromkeys((*first.notes, *second.notes)))
    return replace(_mixed(first, Side(other, weight)), notes=notes)


def _small(side: Side, shape: tuple[int, int]) -> tuple[Float32, Float32]:
    """Return the logarithmic light and the weight of a side, resized to `shape`."""
    planes = np.dstack([luminance(side.texels[..., :3]), side.weight])
    small = cv2.resize(planes, shape[::-1], interpolation=cv2.INTER_AREA).astype(np.float32)
    return log_light(small[..., 0]), small[..., 1]


def _mixed(first: Side, second: Side) -> Side:
    share = second.weight / np.maximum(first.weight + second.weight, np.float32(1e-9))
    mixed = first.texels + share[..., None] * (second.texels - first.texels)
    return replace(first, texels=mixed, weight=np.maximum(first.weight, second.weight))


_COARSE_DEG: Final = 1.2


def ball_notes(balls: Sequence[Ball], blind: float) -> tuple[Remark, ...]:
    """Report the resolution of a ball's panorama and the fraction of it that was filled."""
    fine = max(math.degrees(2.0 / ball.radius_px) for ball in balls)
    width = min(round(2.0 * ball.radius_px) for ball in balls)
    small = [BallSmall()] if fine > _COARSE_DEG else []
    return (BallSize(width, fine), *small, BallBlind(blind, len(balls)))
