"""Detect motion between the frames of a bracket and choose which frames to trust there.

People walk and clouds drift while a bracket is shot. Averaging such frames leaves ghosts with
coloured edges, so every frame gets a mask of its usable area. Frames contradict one another
(`measure.bracket.contradiction`) in connected regions. In each region, the frames that most others
contradict are left out. Without a majority, one frame is the reference for the whole region, which
avoids cutting a person in half. All other frames stay in use wherever they agree, which preserves
the dynamic range of the bracket.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.base.remarks import Remark
from app.core.environment.environment import solid_angles
from app.core.measure.bracket.contradiction import (
    CLIPPED,
    CLOSE,
    EDGE,
    LOOSE,
    Predictions,
    Tolerance,
    contradiction,
    fill_hidden,
    hopeless,
    misfit,
    worst,
)
from app.core.measure.bracket.curve.response import Response
from app.core.measure.bracket.remarks import Motion, MovedPart, MuchMotion

_BLACK: Final = 8  # a code below this is an upper limit rather than a value
_SEED: Final = 7  # codes by which a contradiction must exceed its tolerance to start a region
_SEEDS: Final = 4  # minimum number of such proxy pixels in a region, in pixels at the horizon
_GROWTH: Final = 6  # proxy pixels by which a region may grow under the stricter test
_CLOSING: Final = 0.008  # largest gap in a region that is closed, as a fraction of the width
_MAJORITY: Final = 0.5  # fraction of a region's contradictions that a vote must settle
# Weight, in votes, of an agreement by inequality, a good exposure and a clipped pixel.
_WEAK_VOTE: Final = 0.25
_EXPOSED: Final = 0.3
_LOSS_COST: Final = 4.0
_MUCH: Final = 0.15  # fraction of the sphere above which the frames hardly belong together
# A wide region with a smaller fraction of contradictions is grain and edges, joined across gaps.
_WIDE: Final = 0.05
_DENSE: Final = 0.25
_UNUSUAL: Final = 0.05  # fraction of the pixels above which the response is in doubt
_HOPELESS: Final = 0.35  # fraction above which the cause is not motion
_NAMED: Final = 3  # maximum number of regions named in the remark


@dataclass(frozen=True, slots=True)
class GhostRegion:
    """A region in which frames contradict one another.

    Attributes:
        column, row, width, height: Centre and size of the region, as fractions of the picture's
            width and height, from 0 to 1.
        share: Fraction that the region covers: of the sphere's solid angle for panoramas, otherwise
            of the picture's area.
        frames: Indices, within the bracket, of the frames that are left out in at least part of the
            region.
    """

    column: float
    row: float
    width: float
    height: float
    share: float
    frames: tuple[int, ...]

    @property
    def azimuth_deg(self) -> float:
        """Azimuth of the centre in a panorama, in degrees, positive to the right of the middle."""
        return 360.0 * (self.column - 0.5)

    @property
    def elevation_deg(self) -> float:
        """Elevation of the centre in a panorama, in degrees."""
        return 90.0 - 180.0 * self.row


@dataclass(frozen=True, slots=True)
class FrameTrust:
    """The areas in which each frame is trusted.

    Attributes:
        masks: Mask of each frame, (h, w) float32 at the size of the proxies, which is 1 where the
            frame can be used and 0 elsewhere, or None for a frame that can be used everywhere. No
            pixel is 0 in every mask.
        share: Fraction of the sphere or of the picture's area in which frames are left out or
            differ too widely to be left out.
        where: The regions, largest first.
    """

    masks: tuple[Float32 | None, ...] = field(repr=False)
    share: float = 0.0
    where: tuple[GhostRegion, ...] = ()
    remarks: tuple[Remark, ...] = ()


def trust(
    proxies: Sequence[Bytes],
    stops: Sequence[float],
    response: Response,
    *,
    visibility: Sequence[Float32 | None] = (),
    exposures_known: bool = True,
    sphere: bool = True,
) -> FrameTrust:
    """Detect motion and return the usable area of each frame.

    If frames differ almost everywhere, the curves or the exposures are wrong, and no frame is left
    out anywhere.

    Args:
        proxies: Thumbnails of the encoded frames, (h, w, 3) uint8 each: area means at about an
            eighth of the size, all aligned, in any order. A picture twice as wide as it is high is
            a panorama, whose left and right edges meet.
        stops: Exposures of the frames, in stops.
        response: The response curve, with a table of (3, 256) or (K, 3, 256).
        visibility: Mask of each frame, (h, w) float32, which is 0 where the frame has no pixels, or
            None for a frame that fills the picture.
        exposures_known: Whether the exposures are certain. They are not with a recovered curve.
            Such a curve may itself cause large differences, which are then no reason to shoot
            again.
        sphere: Whether 2:1 pictures are panoramas.

    Raises:
        ValueError: If the sizes of the proxies differ.
    """
    if len(proxies) != len(stops) or len({proxy.shape for proxy in proxies}) > 1:
        raise ValueError("every frame needs a proxy of the same shape and an exposure")
    order = sorted(range(len(stops)), key=lambda index: -stops[index])
    frames = [np.ascontiguousarray(proxies[index]) for index in order]
    hidden = [visibility[index] if visibility else None for index in order]
    outside = tuple(visibility) or (None,) * len(frames)
    table = response.table if response.table.ndim == 2 else response.table[order]
    predictions = Predictions(table, [stops[index] for index in order])
    fill_hidden(frames, hidden, predictions)
    evidence = _evidence(frames, predictions)
    if evidence is None:
        return FrameTrust(outside)
    unlike = float(np.count_nonzero(evidence)) / evidence.size
    if unlike > _UNUSUAL or response.table.ndim > 2:
        slack = misfit(frames, predictions)
        predictions = Predictions(table, predictions.stops, slack)
        evidence = _evidence(frames, predictions)
        if evidence is None:
            return FrameTrust(outside)
        unlike = float(np.count_nonzero(evidence)) / evidence.size
        if unlike > _HOPELESS:
            return FrameTrust(outside, unlike, remarks=(hopeless(frames, unlike),))
    return _usable_areas(frames, evidence, predictions, order, outside, sphere, exposures_known)


def _usable_areas(
    frames: list[Bytes],
    evidence: Bytes,
    predictions: Predictions,
    order: Sequence[int],
    outside: tuple[Float32 | None, ...],
    sphere: bool,
    exposures_known: bool,
) -> FrameTrust:
    """Return the usable area of each frame, given the evidence of motion.

    Args:
        frames: Thumbnails of the frames, brightest first.
        order: Index of each of these frames in the bracket.
        outside: Mask of each frame of the bracket, or None for a frame that fills the picture.
    """
    height, width = evidence.shape
    panorama = sphere and width == 2 * height
    turn = _quiet_column(evidence) if panorama else 0
    if turn:
        frames = [np.roll(frame, -turn, axis=1) for frame in frames]
        evidence = np.roll(evidence, -turn, axis=1)
    area = _area((height, width), panorama)
    places = _places(evidence, frames, predictions, area)
    masks = [np.ones(evidence.shape, np.uint8) for _ in frames]
    areas = [_handle(place, frames, predictions, masks, area) for place in places]
    regions = [_in_picture(region, order, turn / width) for region in areas if region.frames]
    by_frame: list[Float32 | None] = list(outside)
    for index, mask in zip(order, masks, strict=True):
        if not mask.all():
            there = np.roll(mask, turn, axis=1).astype(np.float32)
            edge = by_frame[index]
            by_frame[index] = there if edge is None else there * edge
    is_masked = np.minimum.reduce(masks) == 0
    share = float(area @ np.count_nonzero(is_masked, axis=1))
    where = tuple(sorted(regions, key=lambda region: -region.share))
    return FrameTrust(
        tuple(by_frame), share, where, _remarks(where, share, panorama, exposures_known)
    )


def _adjacent(frames: Sequence[Bytes], predictions: Predictions, tolerance: Tolerance) -> Bytes:
    """Return the largest contradiction between neighbours in exposure, which reveals all motion."""
    parts = [
        contradiction(frames[k], frames[k + 1], predictions.between(k, k + 1, tolerance))
        for k in range(len(frames) - 1)
    ]
    return np.asarray(np.maximum.reduce(parts), np.uint8)


def _evidence(frames: Sequence[Bytes], predictions: Predictions) -> Bytes | None:
    """Return the contradictions under the loose test, or None if none deserves a closer look."""
    if len(frames) < 2:
        return None
    evidence = _adjacent(frames, predictions, LOOSE)
    return evidence if int(np.count_nonzero(evidence >= _SEED)) >= _SEEDS else None


def _quiet_column(evidence: Bytes) -> int:
    """Return the column at which a cut through a panorama meets the fewest contradictions."""
    near = _box(evidence > 0, cv2.MORPH_DILATE, 4 * _closing(evidence.shape[1]) + 1)
    return int(np.argmin(np.count_nonzero(near, axis=0)))


def _box(mask: NDArray[Any], operation: int, size: int) -> Bytes:
    """Apply a morphological operation with a square kernel."""
    box = np.ones((size, size), np.uint8)
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), operation, box), np.uint8)


def _closing(width: int) -> int:
    """Return the side, in an odd number of pixels, of the square that closes gaps in a proxy."""
    return 2 * max(round(0.5 * _CLOSING * width), 1) + 1


@dataclass(frozen=True, slots=True)
class _Place:
    """A connected region of contradictions, as a rectangle and a mask of its pixels."""

    rows: slice
    columns: slice
    inside: Bools


def _places(
    evidence: Bytes, frames: Sequence[Bytes], predictions: Predictions, area: Float64
) -> list[_Place]:
    """Find connected regions that contain more than a stray contradiction, by solid angle."""
    closing = _box(evidence > 0, cv2.MORPH_CLOSE, 3)
    count, labels = cv2.connectedComponents(closing, connectivity=8)
    row, column = np.nonzero(evidence >= _SEED)
    sizes = np.bincount(labels[row, column], area[row] / area.max(), minlength=count)
    strong = sizes >= _SEEDS
    strong[0] = False
    if not strong.any():
        return []
    region = strong[labels].astype(np.uint8)
    closer = (_adjacent(frames, predictions, CLOSE) > 0).astype(np.uint8)
    for _ in range(_GROWTH):
        region |= _box(region, cv2.MORPH_DILATE, 3) & closer
    region = _box(region, cv2.MORPH_CLOSE, _closing(region.shape[1]))
    # Add two pixels for residue at an edge, and one for the slope of the enlarged masks.
    region = _box(region, cv2.MORPH_DILATE, 7)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(region, connectivity=8)
    places = []
    for label in range(1, count):
        left, top, width, height = (int(value) for value in boxes[label, :4])
        rows, columns = slice(top, top + height), slice(left, left + width)
        inside = np.asarray(labels[rows, columns] == label)
        size = np.count_nonzero(inside)
        dense = np.count_nonzero(inside & (evidence[rows, columns] > 0)) >= _DENSE * size
        if dense or size < _WIDE * evidence.size:
            places.append(_Place(rows, columns, inside))
    return places


def _handle(
    place: _Place,
    frames: Sequence[Bytes],
    predictions: Predictions,
    masks: Sequence[Bytes],
    area: Float64,
) -> GhostRegion:
    """Decide on one region, update the masks and describe the region in the masks' coordinates."""
    crops = [frame[place.rows, place.columns] for frame in frames]
    height, width = masks[0].shape
    usable = _settle(crops, place.inside, predictions, _closing(width))
    for mask, use in zip(masks, usable, strict=True):
        mask[place.rows, place.columns] &= use
    return GhostRegion(
        column=0.5 * (place.columns.start + place.columns.stop) / width,
        row=0.5 * (place.rows.start + place.rows.stop) / height,
        width=place.inside.shape[1] / width,
        height=place.inside.shape[0] / height,
        share=float(area[place.rows] @ np.count_nonzero(place.inside, axis=1)),
        frames=tuple(index for index, use in enumerate(usable) if not use.all()),
    )


def _settle(
    crops: Sequence[Bytes], inside: Bools, predictions: Predictions, closing: int
) -> list[Bytes]:
    """Return the usable area of each frame in one region.

    If most frames agree, the others are left out. The remaining contradictions, or all of them if
    there is no majority (as with two frames), are resolved by an order of trust. The first frame is
    used everywhere, and each subsequent frame is used where it contradicts none of the previous
    ones. Either way, the frames in use agree with one another at every pixel.
    """
    # The outermost pixels are for the masks' soft edge, not for evidence.
    core = _box(inside, cv2.MORPH_ERODE, 3).astype(bool)
    against = _clashes(crops, core, predictions)
    codes = np.stack([worst(crop) for crop in crops])
    belief = _belief(codes, core, against)
    order = sorted(range(len(crops)), key=lambda k: -belief[k])
    outliers, explanation = _outvoted(against)
    unclipped = _only_unclipped(codes, outliers)
    usable = [np.ones(inside.shape, np.uint8) for _ in crops]
    if unclipped is not None:
        order.remove(unclipped)
        order.insert(0, unclipped)
    elif explanation >= _MAJORITY:
        usable = [1 - _closed(outlier, closing, inside) for outlier in outliers]
        # If a vote is tied, the frame that is left out most often is trusted least.
        order.sort(key=lambda k: int(np.count_nonzero(outliers[k])))
    for place, frame in enumerate(order[1:], start=1):
        clash = np.zeros(inside.shape, bool)
        for believed in order[:place]:
            clash |= against[frame, believed] & (usable[believed] & usable[frame] > 0)
        if clash.any():
            usable[frame] &= 1 - _closed(clash, closing, inside)
    nowhere = np.maximum.reduce(usable) == 0
    usable[order[0]] |= nowhere.astype(np.uint8)
    return _widened(usable, order[0], inside)


def _closed(pixels: Bools, closing: int, inside: Bools) -> Bytes:
    """Close the gaps between a frame's outliers."""
    return _box(pixels, cv2.MORPH_CLOSE, closing) & inside.astype(np.uint8)


def _widened(usable: Sequence[Bytes], first: int, inside: Bools) -> list[Bytes]:
    """Widen the left-out areas by a pixel, for the masks' slope and for edges within a pixel."""
    limits = inside.astype(np.uint8)
    wide = [1 - (_box(1 - use, cv2.MORPH_DILATE, 3) & limits) for use in usable]
    nowhere = np.maximum.reduce(wide) == 0
    wide[first] |= nowhere.astype(np.uint8)
    return wide


def _clashes(crops: Sequence[Bytes], core: Bools, predictions: Predictions) -> Bools:
    """Return masks, (K, K, h, w), of contradictions between frames under the strict test."""
    number = len(crops)
    against = np.zeros((number, number, *core.shape), bool)
    for bright in range(number):
        for dark in range(bright + 1, number):
            prediction = predictions.between(bright, dark, CLOSE)
            clash = (contradiction(crops[bright], crops[dark], prediction) > 0) & core
            if clash.any():
                prediction = predictions.between(bright, dark, EDGE)
                rest = contradiction(crops[bright], crops[dark], prediction) > 0
                clash |= rest & core & (_box(clash, cv2.MORPH_DILATE, 3) > 0)
            against[bright, dark] = against[dark, bright] = clash
    return against


def _outvoted(against: Bools) -> tuple[Bools, float]:
    """Repeatedly leave out, pixel by pixel, the frame that contradicts the most others.

    Returns:
        A mask of the frames left out, (K, h, w) bool, and the fraction of the contradicting pixels
        that a vote settles, which is 1 if there are none. Where two frames contradict the same
        number of others, neither is left out.
    """
    number = against.shape[0]
    counts = against.sum(axis=1, dtype=np.uint8)
    clash = counts.any(axis=0)
    votes, counts = against[:, :, clash], counts[:, clash]
    out = np.zeros(counts.shape, bool)
    tied = np.zeros(counts.shape[1], bool)
    while counts.any():
        most = counts.max(axis=0)
        candidates = (counts == most) & (most > 0)
        tied |= np.count_nonzero(candidates, axis=0) > 1
        leave = candidates & ~tied
        out |= leave
        for frame in range(number):
            counts -= votes[frame] & leave[frame] & ~out
        counts[out | tied] = 0
    outliers = np.zeros((number, *clash.shape), bool)
    outliers[:, clash] = out & ~tied
    return outliers, 1.0 - float(tied.mean()) if tied.size else 1.0


def _only_unclipped(codes: Bytes, outliers: Bools) -> int | None:
    """Return a frame that a vote must not leave out because all others are brighter and clipped.

    Usually there is none, and the result is None. An example is a person in front of a window in
    the only frame that does not clip the window. The majority records only that the window is
    bright, and its vote would lose the window's detail around that person.
    """
    clipped = codes > CLIPPED
    gap = (clipped | outliers).all(axis=0) & outliers.any(axis=0)
    place = np.arange(len(codes))[:, None, None]
    after_all_kept = place > np.where(outliers, -1, place).max(axis=0)
    telling = gap & outliers & after_all_kept & (codes > _BLACK) & ~clipped
    counts = np.count_nonzero(telling, axis=(1, 2))
    if counts.max() < _SEEDS:
        return None
    # Choose the brightest of the frames that show nearly all of the region.
    return int(np.argmax(counts >= 0.9 * counts.max()))


def _belief(codes: Bytes, core: Bools, against: Bools) -> list[float]:
    """Return each frame's score, based on its exposure and the other frames' agreement with it."""
    number, size = len(codes), max(int(np.count_nonzero(core)), 1)
    level = codes[:, core]
    clash = against[:, :, core]
    clipped = level > CLIPPED
    telling = ~clipped & (level > _BLACK)
    # Clipping counts only where a darker frame has more information.
    darker = np.logical_or.accumulate(telling[::-1], axis=0)[::-1]
    scores = []
    for frame in range(number):
        good = float(np.sqrt(level[frame][~clipped[frame]] / 255.0).sum())
        clipped_count = float(np.count_nonzero(clipped[frame] & darker[frame]))
        votes = 0.0
        for other in range(number):
            agree = ~clash[frame, other]
            sure = np.count_nonzero(agree & telling[frame] & telling[other])
            votes += sure + _WEAK_VOTE * (np.count_nonzero(agree) - sure)
        scores.append(
            (_EXPOSED * good - _LOSS_COST * clipped_count + votes / max(number - 1, 1)) / size
        )
    return scores


def _area(shape: tuple[int, int], panorama: bool) -> Float64:
    """Return the fraction of the whole, (h,), that a pixel in each row covers."""
    if panorama:
        return solid_angles(shape) / (4.0 * math.pi)
    return np.full(shape[0], 1.0 / (shape[0] * shape[1]))


def _in_picture(region: GhostRegion, order: Sequence[int], turn: float) -> GhostRegion:
    """Undo the picture's shift by a fraction of its width and the reordering of the frames."""
    frames = tuple(sorted(order[frame] for frame in region.frames))
    return replace(region, column=(region.column + turn) % 1.0, frames=frames)


def _remarks(
    where: tuple[GhostRegion, ...], share: float, panorama: bool, exposures_known: bool
) -> tuple[Remark, ...]:
    """Report the motion and warn if there is too much of it."""
    if not where:
        return ()
    places = tuple(
        MovedPart(region.azimuth_deg, region.elevation_deg)
        if panorama
        else MovedPart(region.column, region.row)
        for region in where[:_NAMED]
    )
    motion = Motion(places, max(len(where) - _NAMED, 0), panorama)
    return (motion, MuchMotion(share)) if share > _MUCH and exposures_known else (motion,)
