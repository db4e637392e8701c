"""Stitch the pictures of two back-to-back fisheye lenses into a panorama.

The frames of an unstitched bracket are merged as they are, circle on circle, so clipping and noise
are those of the sensor. Only the merged light is resampled, and only once, so all frames stay
aligned as they were shot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.base.colour import luminance, srgb_encode
from app.core.base.progress import Token
from app.core.base.remarks import Remark
from app.core.base.sphere import directions
from app.core.environment.environment import solid_angles
from app.core.measure.bracket.alignment.registration import edges
from app.core.measure.fisheye.blending import BLEND_DEG
from app.core.measure.fisheye.calibration import calibrate
from app.core.measure.fisheye.circles import Circles, FisheyeModel, model_of
from app.core.measure.fisheye.lens_pair import (
    Pair,
    about_seam,
    around_seam,
    looked_up,
    upright,
)
from app.core.measure.fisheye.remarks import CirclesStitched, SeamUnsure
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.resampling import light_in_bands

_SUPERSAMPLED: Final = 2
_COARSE: Final = 4  # texels
_LONGEST: Final = 8192  # maximum side of merged circles in pixels, to save memory
_LOOKED_AT: Final = (256, 512)
_LEAN_DEG: Final = 4.0
_STEEP: Final = 0.9  # nearer to the zenith, every edge is nearly upright
_SECTORS: Final = 16
_CLEARLY: Final = 3.0


@dataclass(frozen=True, slots=True)
class Stitching:
    """How the lenses were calibrated and their pictures stitched.

    Attributes:
        up_deg: Upward direction in degrees, clockwise from the top of the front lens's circle.
        up_from: Source of `up_deg`, which is "model", "edges" or "file".
    """

    front: str
    field_deg: float
    pair: Pair
    up_deg: float
    up_from: str

    def facts(self) -> dict[str, Any]:
        """Return the facts as a dictionary for JSON."""
        first, second = self.pair.gains.mean(axis=1)
        facts = {
            "front": self.front,
            "field_of_view_deg": round(self.field_deg, 2),
            "overlap_matches": self.pair.blocks,
            "parallax_deg": round(self.pair.parallax_deg, 3),
            "level_stops": round(float(np.log2(second / first)), 3),
            "falloff_stops": round(self.pair.falloff / math.log(2.0), 3),
            "up_deg": self.up_deg,
            "up_from": self.up_from,
        }
        return {"stitching": facts}

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """Remarks on the circles used and on a failed calibration of the lenses."""
        stitched = CirclesStitched(self.front, self.up_deg)
        return (stitched,) if self.pair.measured else (stitched, SeamUnsure())


def circle_size(
    shape: tuple[int, int], circles: Circles, size: tuple[int, int] | None
) -> tuple[int, int]:
    """Return the size, in rows and columns, at which to merge frames for a panorama of `size`."""
    share = _LONGEST / max(shape)
    if size is not None:
        # Twice as fine as the panorama, for circles that are about 200 degrees wide.
        fine = _SUPERSAMPLED * size[1] / 360.0 / (2.0 * circles.radius * min(shape) / 200.0)
        share = min(share, fine if fine < 0.75 else 1.0)
    return shape if share >= 1.0 else (round(shape[0] * share), round(shape[1] * share))


def panorama_size(shape: tuple[int, int], circles: Circles, field_deg: float) -> tuple[int, int]:
    """Return the size, in rows and columns, of a panorama with the circles' resolution."""
    columns = 2.0 * circles.radius * min(shape) * 360.0 / field_deg
    rows = max(round(columns / 16.0), 1) * 8
    return rows, 2 * rows


def to_panorama(
    merged: MergedLight,
    circles: Circles,
    camera: str,
    size: tuple[int, int] | None,
    token: Token | None = None,
) -> tuple[MergedLight, Stitching]:
    """Stitch the merged light of an unstitched bracket, at the circles' resolution by default."""
    model = model_of(camera)
    pair = calibrate(merged, circles, model)
    up_deg, source = _up(merged, pair, model)
    pair = upright(pair, up_deg)
    shape = merged.radiance.shape[:2]
    finest = panorama_size((shape[0], shape[1]), circles, pair.field_deg)
    stitched = stitch(merged, pair, finest if size is None else min(size, finest), token)
    share = 2.0 * math.pi * circles.radius**2 * min(shape) / max(shape)
    fractions = tuple(min(each / share, 1.0) for each in merged.clipped_fractions)
    return (
        replace(stitched, clipped_fractions=fractions),
        Stitching(circles.names[model.front], pair.field_deg, pair, up_deg, source),
    )


def _up(merged: MergedLight, pair: Pair, model: FisheyeModel) -> tuple[float, str]:
    """Return the upward direction, clockwise from the top of the front circle, and its source.

    Cameras store their circles upright or rotated by a quarter turn, and the overlap does not
    reveal which. A known model decides. Otherwise, the rotation of the two circles relative to each
    other decides, unless upright edges all around clearly contradict it. The light shows which end
    is up: in each of twenty panoramas, more light came from above than from below.
    """
    if model.turns_deg is not None:
        return model.turns_deg[model.front], "model"
    up_view = stitch(merged, pair, _LOOKED_AT).radiance
    right = pair.lenses[1].axes[0]
    # Either both are a quarter turn to the same side, or both are upright. Then the top of the
    # front circle is up.
    sideways = right[0] < -math.sqrt(0.5)
    upright_scores, lying_scores = _upright_edges(up_view, 1), _upright_edges(up_view, 0)
    ratio = (lying_scores + 1e-9) / (upright_scores + 1e-9)
    if not 1.0 / _CLEARLY < ratio < _CLEARLY and sideways != (ratio > 1.0):
        return _lit(up_view, 0.0 if sideways else 90.0), "edges"
    return (_lit(up_view, 90.0), "file") if sideways else (0.0, "file")


def _lit(radiance: Float32, up_deg: float) -> float:
    """Return the direction from which more light comes: the given one or its opposite."""
    angle = math.radians(up_deg)
    toward = directions(_LOOKED_AT) @ np.array([-math.sin(angle), math.cos(angle), 0.0], np.float32)
    light = luminance(radiance) * solid_angles(_LOOKED_AT)[:, None]
    return (up_deg if float((light * toward).sum()) >= 0.0 else up_deg + 180.0) % 360.0


def _upright_edges(radiance: Float32, axis: int) -> float:
    """Sum the edges along an axis, limiting the weight of each sector around it."""
    level = luminance(radiance)
    level *= np.float32(0.25 / max(float(np.median(level)), 1e-9))
    picture = np.rint(255.0 * srgb_encode(np.clip(level, 0.0, 1.0))).astype(np.uint8)
    vectors, normals, strengths = edges(np.repeat(picture[..., None], 3, axis=2))
    off = normals[:, axis] / math.sin(math.radians(_LEAN_DEG))
    along = np.clip(1.0 - off**2, 0.0, 1.0) * (np.abs(vectors[:, axis]) < _STEEP) * strengths
    around = np.arctan2(vectors[:, 2], vectors[:, 1 - axis]) / (2.0 * math.pi) + 0.5
    sums = np.bincount((around * _SECTORS).astype(int) % _SECTORS, along, _SECTORS)
    # The horizon is one long edge, whereas trees and the corners of rooms are all around.
    return float(np.minimum(sums, 2.0 * np.median(sums)).sum())


def stitch(
    merged: MergedLight, pair: Pair, size: tuple[int, int], token: Token | None = None
) -> MergedLight:
    """Resample merged light to a panorama with the given even numbers of rows and columns.

    Fractions of an area are preserved, and clipped light stays clipped.
    """
    shape, shares = (size[0] * _SUPERSAMPLED, size[1] * _SUPERSAMPLED), merged.shares

    def band(start: int, stop: int) -> tuple[Float32, Float32]:
        # Compute source positions for every fourth texel and interpolate, since they vary smoothly.
        vectors = _coarse(shape, (start, stop))
        toward, around = about_seam(vectors)
        front = np.clip(0.5 + (toward - around_seam(pair.seam, around)) / BLEND_DEG, 0.0, 1.0)
        total = np.zeros((stop - start, shape[1], 3), np.float32)
        loss = np.zeros((*total.shape[:2], 2), np.float32)
        for index, share in ((0, front), (1, 1.0 - front)):
            x, y, gain = looked_up(pair, index, vectors, toward, around)
            x, y, share, gain = (_refine(each) for each in (x, y, share, share * gain))
            light, loss_part = (
                cv2.remap(plane, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
                for plane in (merged.radiance, shares)
            )
            total += light * pair.gains[index].astype(np.float32) * gain[..., None]
            loss += loss_part * share[..., None]
        return total, loss

    return merged.moved(*light_in_bands(size, _SUPERSAMPLED, _COARSE, band, token or Token()))


def _coarse(shape: tuple[int, int], rows: tuple[int, int]) -> Float32:
    """Return the directions to the centres of blocks of texels, plus one block on each side."""
    row = np.arange(rows[0] // _COARSE - 1, rows[1] // _COARSE + 1) + 0.5
    column = np.arange(-1, shape[1] // _COARSE + 1) + 0.5
    elevation = np.pi * (0.5 - row * _COARSE / shape[0])[:, None]
    azimuth = 2.0 * np.pi * (column * _COARSE / shape[1] - 0.5)[None]
    level = np.cos(elevation)
    parts = (-level * np.sin(azimuth), np.sin(elevation) + 0.0 * azimuth, level * np.cos(azimuth))
    return np.stack(parts, axis=-1).astype(np.float32)


def _refine(coarse: Float32) -> Float32:
    """Interpolate the values of blocks at their texels and drop the extra blocks."""
    size = (coarse.shape[1] * _COARSE, coarse.shape[0] * _COARSE)
    fine = cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(fine[_COARSE:-_COARSE, _COARSE:-_COARSE], np.float32)
