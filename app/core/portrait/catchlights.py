"""Catchlights: reflections of lamps in the eyes, each with its eye, clock position and source."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bools, Float32, Float64
from app.core.base.colour import luminance
from app.core.measure.finish.findings import Findings, LampFinding
from app.core.measure.finish.lamp_detection import Source
from app.core.portrait.full_size_portrait import eye_shine
from app.core.portrait.light import PortraitLight
from app.core.portrait.portrait_head import PortraitHead

_IRIS, _ROWS = 14, 640
"""Radius of the iris, in pixels, and the number of picture rows for which it is given."""
_BRIGHTER: Final = 3.0
_LEAST_SHARE: Final = 0.1
"""Minimum brightness of a catchlight, relative to the head's mean brightness."""
_LEAST_PIXELS: Final = 2
_MIRRORED: Final = 0.5
EYES: Final = ("right", "left")
"""The sitter's eyes. The right eye is in the left half of the picture."""
_NEAR_DEG: Final = 5.0
"""Largest angle, in degrees, between a lamp and the direction from which a blurred spot comes."""
_ABOVE_DEG: Final = 60.0


@dataclass(frozen=True, slots=True)
class Catchlight:
    """A bright reflection on an iris.

    Attributes:
        eye: The sitter's own eye, "left" or "right".
        clock: Position in the picture, as on a clock face, in hours from 0 to 12.
        share: Area of the reflection divided by that of the iris.
        what: Kind of source, as in the list of the place's lamps.
        letter: Letter of the lamp in that list, or "" if the spot reflects none of the lamps.
    """

    eye: str
    clock: float
    share: float
    what: Source
    letter: str = ""


def catchlights(
    head: PortraitHead,
    light: PortraitLight,
    picture: Float32,
    turn_deg: float,
    findings: Findings,
) -> tuple[Catchlight, ...]:
    """Find the catchlights, which are at least three times as bright as the surrounding iris.

    Args:
        picture: (rows, columns, 3) float32. The portrait, as returned by `portrait_picture`.
        turn_deg: Azimuth in the panorama that the nose points to, in degrees.
        findings: Lamps at the place, from which the catchlights take their names.
    """
    mean = float(luminance(np.array(cv2.mean(picture)[:3])))
    least = (
        _LEAST_SHARE * mean * picture.shape[0] * picture.shape[1] / np.count_nonzero(head.coverage)
    )
    shines = dict(zip(head.halves, eye_shine(head, light, turn_deg), strict=True))
    reflections: list[Catchlight] = []
    for eye, side, some in _eyes(head):
        glass, shine = head.glass[some], shines[side][some]
        row, column = np.divmod(head.pixels[glass], head.inside.shape[1])
        ways, view = head.glass_way[some], head.visible.view[head.three[glass, 0]]
        # The middle of the pupil faces the camera that the eye looks at, or the nose's direction.
        faces = (ways + view)[:, 2] / np.linalg.norm(ways + view, axis=1)
        apex = int(np.argmax(faces if head.yaw_deg else (ways * view).sum(axis=1)))
        box = slice(row.min(), row.max() + 1), slice(column.min(), column.max() + 1)
        row, column = row - row.min(), column - column.min()
        grey = luminance(picture[:, ::side][box]).astype(np.float64)
        mirror = np.zeros((int(row.max()) + 1, int(column.max()) + 1), bool)
        mirror[row, column] = True
        rows, columns = np.ogrid[: mirror.shape[0], : mirror.shape[1]]
        radius = _IRIS * picture.shape[0] / _ROWS
        round_ = (rows - row[apex]) ** 2 + (columns - column[apex]) ** 2 <= radius**2
        iris = mirror & round_
        mirror[row, column] = luminance(shine) > _MIRRORED * grey[row, column]
        for spot in _spots(grey, iris, mirror, least):
            down, across = (float(np.mean(axis)) for axis in np.nonzero(spot))
            members = spot[row, column]
            weight = luminance(shine)[members].astype(np.float64)
            what, letter = _source(findings, ways[members] * [side, 1, 1], weight, turn_deg)
            across = (across - column[apex]) * side
            clock = math.degrees(math.atan2(across, row[apex] - down)) / 30 % 12
            share = float(spot.sum()) / (math.pi * radius**2)
            reflections.append(Catchlight(eye, clock, share, what, letter))
    return tuple(reflections)


def _eyes(head: PortraitHead) -> list[tuple[str, int, Bools]]:
    """Return each eye with its half of the head and a mask of its pixels within `glass`."""
    first = np.ones(len(head.glass), bool)
    if not head.yaw_deg:
        return [(eye, side, first) for eye, side in zip(EYES, head.halves, strict=True)]
    (side,) = head.halves
    far = head.visible.index[head.three[head.glass, 0]] >= len(head.nodes.normals)
    return [(eye, side, far == k) for k, eye in enumerate(EYES[::side]) if (far == k).any()]


def _spots(grey: Float64, iris: Bools, mirror: Bools, least: float) -> list[Bools]:
    """Return the bright areas of an eye, brightest first."""
    least = max(_BRIGHTER * float(np.median(grey[iris])), least)
    bright = iris & mirror & (grey >= least)
    joint = cv2.morphologyEx(bright.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, label = cv2.connectedComponents(joint)
    spots = [(label == number) & bright for number in range(1, count)]
    spots = [spot for spot in spots if spot.sum() >= _LEAST_PIXELS]
    return sorted(spots, key=lambda spot: -float(grey[spot].sum()))


def _source(
    findings: Findings, ways: Float64, weight: Float64, turn_deg: float
) -> tuple[Source, str]:
    """Name the source reflected in a spot, which is the lamp that contributes most of its light.

    Args:
        ways: (n, 3). Directions in the sitter's frame that are mirrored by the spot's pixels.
        weight: (n,). Light of each pixel.
    """
    elevations = np.degrees(np.arcsin(np.clip(ways[:, 1], -1, 1)))
    azimuths = np.degrees(np.arctan2(-ways[:, 0], ways[:, 2])) + turn_deg
    sums: dict[LampFinding, float] = {}
    for azimuth, elevation, light in zip(azimuths, elevations, weight, strict=True):
        lamp = findings.at(float(azimuth), float(elevation), _NEAR_DEG)
        if lamp is not None:
            sums[lamp] = sums.get(lamp, 0.0) + float(light)
    if sums:
        best = max(sums, key=lambda lamp: sums[lamp])
        return best.kind, best.letter
    up = float(elevations @ weight) / max(float(weight.sum()), 1e-30)
    return ("above" if up > _ABOVE_DEG else "area"), ""
