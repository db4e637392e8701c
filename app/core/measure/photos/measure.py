"""Measure the light from photos taken in all directions from one spot.

    files -> pictures -> matches -> directions -> curve, exposures -> merged
          -> gaps filled -> lamps, sun, corrections -> audit

The exposures of one bracket face nearly the same direction, so only the best one is compared with
other photos. The exposures in EXIF are only a starting point. The overlaps decide, since phones
process their photos unpredictably.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any, Final, Literal

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.base.colour import largest_channel, smallest_channel, srgb_light
from app.core.base.errors import ProbeError
from app.core.base.phrases import listed, percent
from app.core.base.progress import Progress, Report, Task, Token, silent, span
from app.core.base.remarks import Remark
from app.core.base.sphere import angles_of, directions
from app.core.environment.environment import solid_angles
from app.core.environment.holes import GOES_ON
from app.core.localization.features import Features, shrunk
from app.core.localization.picture_file import read_picture, shows_circles
from app.core.measure.bracket.curve.response import ResponseChoice, choose_response, srgb_choice
from app.core.measure.bracket.merge import SIZE
from app.core.measure.bracket.weighting import CLIPPED_CODE
from app.core.measure.finish.corrections import finish
from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.inpainting import fill
from app.core.measure.fisheye import measure as fisheye
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions, WayOptions
from app.core.measure.photos.mosaic import OrientedPicture, light_around
from app.core.measure.photos.remarks import CameraMoved, GapsFilled, OneExposure, PhotosLeftOut
from app.core.measure.photos.rotations import (
    LONGEST,
    find_links,
    groups,
    points_of,
    turn,
    upright,
)
from app.core.measure.read.frame import Bracket, Frame, MergedLight
from app.core.measure.read.metadata import pictures_in, read_header
from app.core.text import tr

_MERGE_SIDE, _SMALL = 1600, 120  # longer side in pixels: to merge, and to compare brightness
_PANORAMA, _WIDE, _ENDS = 6144, 2.2, 1.5  # pixels; width over height; steps between columns
_COUNTS: Final = (3, 120)
_OTHER_PLACE, _LEAST_SEEN = 0.2, 0.1  # minimum fractions: connected photos; the sphere
_STEP_STOPS, _SAME_STOPS = 0.6, 0.25  # between the exposures of a bracket; between brackets
_OPEN, _MIDDLE_CODE = (16, 236), 118
_EDGE, _FEW = 0.06, 12  # excluded part of half a side; too few positions
_TRUST_EXIF, _TRUST_STEP, _TRUST_OVERLAP = 0.3, 0.07, 0.05  # stops
_MOVED_PX = 2.5
_OVER: Final = tr("Turn on one spot and let each photo overlap the last by a third.")
_AXES: Final = np.diag([-1.0, -1.0, 1.0])  # from a camera's axes to a panorama's


@dataclass(frozen=True, slots=True)
class Photograph:
    """A photo and its direction.

    Attributes:
        pixels: (h, w, 3) uint8. The photo.
        small: A tiny copy of the photo.
        points: Feature points of a copy whose longer side is at most `LONGEST` pixels.
        stated_focal_px: Focal length from EXIF, in pixels of that copy.
        rotation: (3, 3) float64. Rotation from camera to panorama axes, or None if it could not be
            determined.
        focal_px: Focal length, in pixels of `pixels`.
        bracket: Number of the bracket to which the photo belongs. All photos in a bracket have the
            same direction.
        wide_deg: Horizontal angle of a panorama, in degrees.
    """

    frame: Frame
    pixels: Bytes = field(repr=False)
    small: Bytes = field(repr=False)
    points: Features = field(repr=False)
    stated_focal_px: float | None = None
    rotation: Float64 | None = field(default=None, repr=False)
    focal_px: float = 1.0
    bracket: int = 0
    wide_deg: float = 0.0

    @property
    def stops(self) -> float | None:
        """The exposure from EXIF in stops, or None if it is not recorded."""
        return None if self.frame.exposure is None else self.frame.exposure.ev

    @property
    def fov_deg(self) -> float:
        """The horizontal field of view, in degrees."""
        return self.wide_deg or math.degrees(
            2.0 * math.atan(self.pixels.shape[1] / 2.0 / self.focal_px)
        )

    @property
    def angles_deg(self) -> tuple[float, float, float] | None:
        """The azimuth, elevation and clockwise roll in degrees, or None if there is no rotation."""
        return None if self.rotation is None else angles_of(self.rotation @ _AXES)


@dataclass(frozen=True, slots=True)
class PhotosOptions(WayOptions):
    """Options for photos taken in all directions.

    Attributes:
        fov_deg: Horizontal angle of a single wide panorama, or None to estimate it.
        unstitched: Whether to measure pictures with two fisheye circles as unstitched pictures.
    """

    fov_deg: float | None = None
    unstitched: bool = True


@dataclass(frozen=True, slots=True)
class PhotosFacts:
    """Facts about the photos, such as their directions."""

    photographs: tuple[Photograph, ...]

    def facts(self) -> dict[str, Any]:
        """Return the facts as a dictionary for JSON."""
        return {"photographs": [_described(each) for each in self.photographs]}


def _described(each: Photograph) -> dict[str, Any]:
    names = ("azimuth_deg", "elevation_deg", "roll_deg", "fov_deg")
    facts: dict[str, Any] = {"file": str(each.frame.path), "placed": False} | dict.fromkeys(names)
    if each.angles_deg is not None:
        values = (*each.angles_deg, each.fov_deg)
        facts |= {"placed": True} | {n: round(v, 2) for n, v in zip(names, values, strict=True)}
    return facts


def measure(
    files: Sequence[Path],
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> Measurement:
    """Measure the light from photos taken in all directions, or from one folder of them.

    Azimuth 0 is the direction of the first photo that could be placed. A single file is treated as
    a panorama that a phone has stitched. Pictures with two fisheye circles are measured as
    unstitched pictures. The errors are those of `measurement.Entry`, plus a `ProbeError` if the
    photos do not belong together or show too little.
    """
    options, token = options or MeasureOptions(), token or Token()
    own = options.of(PhotosOptions)
    fov_deg, single = own.fov_deg, len(files) == 1 and not files[0].is_dir()
    if len(files) == 1 and files[0].is_dir():
        files = pictures_in(files[0])
    if own.unstitched and fov_deg is None and _circled(files, token):
        return fisheye.measure(files, replace(options, sort_out=False), token, report)
    if single:
        return _finish(_panorama(files[0], fov_deg, token), options, report)
    photographs = _read(files, token, span(report, 0.0, 0.3))
    photographs, remarks = _place(photographs, token, span(report, 0.3, 0.55))
    report(0.55, Progress(Task.CHECKING_EXPOSURES))
    oriented = [photograph for photograph in photographs if photograph.rotation is not None]
    codes, visible = _look_up(oriented)
    choice = _curve(oriented, codes, visible)
    table = choice.response.table
    layers = _layers(oriented, codes, visible, table)
    merging = span(report, 0.55, 0.9)
    planes = light_around(layers, table=table, token=token, report=merging)
    stops = tuple(_middle(oriented) + layer.stops for layer in layers)
    light = _PhotoLight(photographs, stops, choice, planes, remarks)
    return _finish(light, options, report)


@dataclass(frozen=True, slots=True)
class _PhotoLight:
    """Light before its gaps are filled: radiance, a mask of known texels and clipped fractions."""

    photographs: list[Photograph]
    stops: tuple[float, ...]
    choice: ResponseChoice
    planes: tuple[Float32, Bools, Float32]
    remarks: list[Remark]


def _finish(light: _PhotoLight, options: MeasureOptions, report: Report) -> Measurement:
    """Fill the gaps and finish the light as in all measurements."""
    (radiance, coverage, clipped), stops, remarks = light.planes, light.stops, light.remarks
    oriented = [photograph for photograph in light.photographs if photograph.rotation is not None]
    exposures_known = all(p.frame.exposure is not None and p.frame.exposure.known for p in oriented)
    if max(stops) - min(stops) < 1.0 and clipped.any():
        remarks.append(OneExposure())
    reference = _middle(oriented)
    merged = MergedLight(
        radiance,
        clipped,
        np.zeros_like(clipped),
        reference_ev=reference,
        clip_level=2.0 ** (reference - min(stops)),
        cd_m2=1.2 / 2.0**reference if exposures_known else None,  # ISO 12232
        clipped_fractions=tuple(
            (largest_channel(p.pixels) >= CLIPPED_CODE).mean() for p in oriented
        ),
    )
    merged, blind = _filled(merged, coverage, remarks)
    report(0.9, Progress(Task.FINDING_LAMPS))
    finished = finish(merged, options.styles, options, blind=(~coverage).astype(np.float32))
    warnings = (*light.choice.remarks, *remarks)
    report(1.0, Progress(Task.DONE))
    return Measurement(
        way="photos",
        bracket=Bracket(tuple(p.frame for p in oriented), stops, warnings, unstitched=True),
        finished=finished,
        warnings=warnings,
        notes=finished.notes,
        display=display_panorama(merged.radiance),
        blind=blind,
        response=light.choice,
        own=PhotosFacts(tuple(light.photographs)),
    )


def _panorama(file: Path, fov_deg: float | None, token: Token) -> _PhotoLight:
    """Map a phone's stitched panorama onto the sphere, according to GPano or as a cylinder."""
    photograph = replace(_read_one(token, file, _PANORAMA), rotation=_AXES)
    pixels, area = photograph.pixels, photograph.frame.area_deg
    height, width = pixels.shape[:2]
    elevation = np.radians(90.0 - (np.arange(SIZE[0]) + 0.5) * 180.0 / SIZE[0])
    azimuth = (np.arange(SIZE[1]) + 0.5) * 360.0 / SIZE[1] - 180.0
    if area is None and width != 2 * height:
        wide = _width_deg(pixels, file.name) if fov_deg is None else fov_deg
        if not 1.0 <= wide <= 360.0:
            raise ProbeError(tr("A panorama covers 1 to 360 degrees."))
        columns = azimuth / wide + 0.5
        rows = 0.5 - np.tan(elevation) * width / math.radians(wide) / height
    else:
        left, right, top, bottom = area or (-180.0, 180.0, 90.0, -90.0)
        wide, columns = right - left, (azimuth - left) / (right - left)
        rows = (top - np.degrees(elevation)) / (top - bottom)
    inside = np.logical_and.outer((rows > 0.0) & (rows < 1.0), (columns > 0.0) & (columns < 1.0))
    x, y = np.meshgrid(columns * width - 0.5, rows.clip(-1.0, 2.0) * height - 0.5)
    x, y, border = x.astype(np.float32), y.astype(np.float32), cv2.BORDER_REPLICATE
    codes = np.asarray(cv2.remap(pixels, x, y, cv2.INTER_LINEAR, borderMode=border), np.uint8)
    radiance = srgb_light(codes) * inside[..., None]
    clipped = ((largest_channel(codes) >= CLIPPED_CODE) & inside).astype(np.float32)
    choice = srgb_choice()
    photograph = replace(photograph, wide_deg=wide)
    return _PhotoLight(
        [photograph], (photograph.stops or 0.0,), choice, (radiance, inside, clipped), []
    )


def _width_deg(pixels: Bytes, name: str) -> float:
    """Return 360 degrees for a wide picture whose ends match, or raise an error for any other."""
    if pixels.shape[1] < _WIDE * pixels.shape[0]:
        few = tr("One photo cannot show a full panorama.")
        raise ProbeError(few, _OVER)
    columns = cv2.resize(pixels, (256, 64), interpolation=cv2.INTER_AREA).astype(np.float32)
    # The two ends come first.
    apart = np.abs(columns - np.roll(columns, 1, axis=1)).mean(axis=(0, 2))
    if apart[0] > _ENDS * np.quantile(apart[1:], 0.9):
        unknown = tr("The angle that {name} covers is unknown.", name=name)
        raise ProbeError(unknown, tr("Set it in degrees with --fov."))
    return 360.0


def _circled(files: Sequence[Path], token: Token) -> bool:
    """Return whether the pictures show two fisheye circles each, judging by three of them."""
    some = {files[k] for k in (0, len(files) // 2, len(files) - 1)} if files else set()
    return any(shows_circles(file, token) for file in sorted(some))


def _read(files: Sequence[Path], token: Token, report: Report) -> list[Photograph]:
    """Decode the photos and detect their feature points."""
    if not _COUNTS[0] <= len(files) <= _COUNTS[1]:
        few = tr("A full panorama needs 12–40 photos (you chose {count}).", count=len(files))
        raise ProbeError(few, _OVER)
    photographs = []
    with ThreadPoolExecutor(2) as pool:
        for photograph in pool.map(partial(_read_one, token), files):
            photographs.append(photograph)
            report(len(photographs) / len(files), Progress(Task.READING_PHOTOS))
    return _bracketed(photographs)


def _read_one(token: Token, file: Path, most: int = _MERGE_SIDE) -> Photograph:
    token.check()
    source, frame = read_picture(file, most, token), read_header(file).frame
    longest = max(source.picture.shape)
    points = points_of(shrunk(source.picture, LONGEST / longest)[0])
    focal = source.focal_px and source.focal_px * min(LONGEST / longest, 1.0)
    clip = np.where(source.picture >= CLIPPED_CODE, np.uint8(255), np.uint8(0))
    small, clip = (shrunk(picture, _SMALL / longest)[0] for picture in (source.picture, clip))
    small[clip > 0] = 255  # partly clipped pixels do not reveal their brightness
    return Photograph(frame, source.picture, small, points, focal)


def _bracketed(photographs: Sequence[Photograph]) -> list[Photograph]:
    """Divide the photos into brackets if all brackets have the same exposure steps.

    Otherwise, each photo is a bracket of its own.
    """
    count, bracket_size = len(photographs), 1
    stops = np.array([math.nan if p.stops is None else p.stops for p in photographs])
    for size in range(count // _COUNTS[0], 1, -1):
        if count % size == 0:
            steps = stops.reshape(-1, size) - stops.reshape(-1, size)[:, :1]
            apart = np.diff(np.sort(steps[0])).min()
            if apart >= _STEP_STOPS and np.ptp(steps, axis=0).max() <= _SAME_STOPS:
                bracket_size = size
    return [replace(each, bracket=k // bracket_size) for k, each in enumerate(photographs)]


def _place(
    photographs: Sequence[Photograph], token: Token, report: Report
) -> tuple[list[Photograph], list[Remark]]:
    """Determine the directions of the photos, with remarks on those that have none."""
    size = len(photographs) // (photographs[-1].bracket + 1)
    dull = [abs(float(np.median(photograph.small)) - _MIDDLE_CODE) for photograph in photographs]
    # Index of the best exposure in every bracket.
    best = int(np.reshape(dull, (-1, size)).mean(axis=0).argmin())
    leader = [k - k % size + best for k in range(len(photographs))]
    pairs = [*combinations(sorted(set(leader)), 2)]
    pairs += [(one, k) for k, one in enumerate(leader) if one != k]
    links = find_links([p.points for p in photographs], pairs, token, report)
    names = [photograph.frame.path.name for photograph in photographs]
    rotations, focals, off = turn([p.stated_focal_px for p in photographs], links)
    rest = groups(len(names), [n for n in links if not rotations.keys() & set(n.numbers)])[0]
    if len(rest) >= max(_COUNTS[0], _OTHER_PLACE * len(names)):
        first, second = (listed([names[k] for k in sorted(some)]) for some in (rotations, rest))
        apart = tr("{first} and {second} do not overlap.", first=first, second=second)
        hint = tr("Stitch each place separately, or add photos in between.")
        raise ProbeError(apart, hint)
    for k, one in enumerate(leader):
        # A photo too dark to match is placed like its bracket.
        if one in rotations and k not in rotations:
            rotations[k], focals[k] = rotations[one], focals[one]
    if len(rotations) < _COUNTS[0]:
        few = tr("Only {few} of {all} photos overlap.", few=len(rotations), all=len(names))
        raise ProbeError(few, _OVER)
    others = tuple(name for k, name in enumerate(names) if k not in rotations)
    remarks: list[Remark] = [PhotosLeftOut(others)] if others else []
    if off > _MOVED_PX:
        remarks.append(CameraMoved())
    level = upright(rotations, min(rotations))
    scales = [max(max(p.pixels.shape) / LONGEST, 1.0) for p in photographs]
    return [
        replace(p, rotation=level[k], focal_px=focals[k] * scales[k]) if k in level else p
        for k, p in enumerate(photographs)
    ], remarks


def _middle(oriented: Sequence[Photograph]) -> float:
    """Return the middle of the exposures recorded in EXIF."""
    return float(np.median([p.stops for p in oriented if p.stops is not None] or [0.0]))


def _look_up(oriented: Sequence[Photograph]) -> tuple[Bytes, Bools]:
    """Sample the same directions in small copies of all photos.

    Returns:
        The codes, (K, N, 3) uint8, and a mask of the codes that are visible, (K, N) bool.
    """
    scales = [max(p.small.shape) / max(p.pixels.shape) for p in oriented]
    looks = [
        OrientedPicture(p.small, p.rotation, p.focal_px * scale).look(directions((96, 192)))
        for p, scale in zip(oriented, scales, strict=True)
        if p.rotation is not None
    ]
    codes = np.array([pixels.reshape(-1, 3) for pixels, _ in looks])
    return codes, np.array([inside.ravel() > _EDGE for _, inside in looks])


def _curve(oriented: Sequence[Photograph], codes: Bytes, visible: Bools) -> ResponseChoice:
    """Choose the camera's response curve from the brackets, or assume sRGB if there are none."""
    sets = [
        [k for k, p in enumerate(oriented) if p.bracket == n] for n in {p.bracket for p in oriented}
    ]
    size = max(map(len, sets))
    if size == 1:
        return srgb_choice()
    stops = np.array([p.stops for p in oriented], np.float64)
    whole = [sorted(group, key=lambda k: -stops[k]) for group in sets if len(group) == size]
    samples = [codes[group][:, visible[group].all(axis=0)] for group in whole]
    return choose_response(np.concatenate(samples, axis=1), stops[whole[0]].tolist())


def _layers(
    oriented: Sequence[Photograph], codes: Bytes, visible: Bools, table: Float64
) -> list[OrientedPicture]:
    """Determine the light that the codes in each photo stand for.

    Exposures are fitted by least squares of logarithms. The fit makes overlaps that are unclipped
    in both photos equal, and it keeps the exposures close to those in EXIF, and very close within a
    bracket.
    """
    middle = _middle(oriented)
    start = np.array([0.0 if p.stops is None else middle - p.stops for p in oriented])
    sure = np.array([1e-4 if p.stops is None else _TRUST_EXIF**-2 for p in oriented])
    normal, right = np.diag(sure), np.repeat((start * sure)[:, None], 3, axis=1)
    logs = np.log2(np.maximum(table[np.arange(3), codes], 1e-6))
    usable = visible & (smallest_channel(codes) >= _OPEN[0]) & (largest_channel(codes) < _OPEN[1])
    for one, other in combinations(range(len(oriented)), 2):
        both = usable[one] & usable[other]
        weight, target = 0.0, np.zeros(3)
        if both.sum() >= _FEW:
            weight = min(both.sum() / 100.0, 1.0) * _TRUST_OVERLAP**-2
            target = weight * np.median(logs[other, both] - logs[one, both], axis=0)
        if oriented[one].bracket == oriented[other].bracket:
            weight += _TRUST_STEP**-2
            target += _TRUST_STEP**-2 * (start[one] - start[other])
        normal[[one, other], [one, other]] += weight
        normal[[one, other], [other, one]] -= weight
        right[[one, other]] += target, -target
    gains = (2.0 ** np.linalg.solve(normal, right)).tolist()
    return [
        OrientedPicture(p.pixels, p.rotation, p.focal_px, tuple(gain))
        for p, gain in zip(oriented, gains, strict=True)
        if p.rotation is not None
    ]


def _filled(
    merged: MergedLight, coverage: Bools, remarks: list[Remark]
) -> tuple[MergedLight, float]:
    """Fill the areas that no photo shows, and report where they are and how much they cover."""
    gaps = (
        (~coverage).mean(axis=1) * solid_angles(coverage.shape) * coverage.shape[1] / (4.0 * np.pi)
    )
    blind, quarter = float(gaps.sum()), len(gaps) // 4
    if blind > 1.0 - _LEAST_SEEN:
        little = tr("These photos cover only {share} of the panorama.", share=percent(1.0 - blind))
        raise ProbeError(little, _OVER)
    if blind:
        up, down = float(gaps[:quarter].sum()), float(gaps[-quarter:].sum())
        where: Literal["overhead", "below", "sides"] = "overhead"
        if max(down, blind - up - down) > up:
            where = "below" if down > blind - up - down else "sides"
        remarks.append(GapsFilled(blind, where))
    return fill(merged, (~coverage).astype(np.float32), GOES_ON), blind
