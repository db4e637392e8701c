"""The points of a panorama that a camera can be found by.

Once for a place, `build_index` cuts views out of the panorama, 70 deg wide, every 40 deg and at two
elevations, and describes their points; each point is kept from the view that shows it most
squarely.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token, silent
from app.core.localization.features import Features, describe
from app.core.localization.views import Lens, bearings, look

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_LEAST_POINTS: Final = 48  # of a panorama
_EVERY_DEG: Final = 40
_VIEW_DEG: Final = 70.0
_PITCHES_DEG: Final = (17.0, -17.0)
_VIEW_SHAPE: Final = (60.0, 70.0)  # degrees, tall and wide: each view reaches over the horizon
_PER_DEG: Final = 10.0  # pixels of a view, at most
_VIEW_POINTS: Final = 900


@dataclass(frozen=True, slots=True, eq=False)
class HeadingIndex:
    """The points of a panorama, described.

    Attributes:
        descriptors: (N, 128) float32. RootSIFT.
        bearings: (N, 3) float32. Unit vectors in the panorama's axes.
        azimuths: (N,) float32. Deg, ascending.
    """

    descriptors: Float32 = field(repr=False)
    bearings: Float32 = field(repr=False)
    azimuths: Float32 = field(repr=False)

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self.azimuths)

    def near(self, azimuth_deg: float, reach_deg: float) -> NDArray[np.int64]:
        """Return the indices of the points around an azimuth.

        Args:
            azimuth_deg, reach_deg: The middle, and how far to both sides, deg.
        """
        away = np.abs((self.azimuths - azimuth_deg + 180.0) % 360.0 - 180.0)
        return np.flatnonzero(away <= reach_deg)


def build_index(
    panorama: Bytes, token: Token | None = None, report: Report = silent
) -> HeadingIndex:
    """Describe a panorama's points.

    Args:
        panorama: (H, W, 3) uint8. Equirectangular, 2:1, sRGB as shown
            (`app.core.hdr.display.display_panorama`); 2,048 to 4,096 columns are best.

    Raises:
        CoreError: When it has next to none: a blank wall all around.
        Cancelled
    """
    per_degree = min(_PER_DEG, panorama.shape[1] / 360.0 * 1.3)
    focal = per_degree * 180.0 / math.pi
    tall, wide = (round(2 * focal * math.tan(math.radians(a) / 2)) for a in _VIEW_SHAPE)
    lens = Lens(_VIEW_DEG, (wide, tall))
    parts: list[tuple[Features, Float64]] = []
    views = [(a, p) for a in range(-180, 180, _EVERY_DEG) for p in _PITCHES_DEG]
    for done, (azimuth, pitch) in enumerate(views):
        if token is not None:
            token.check()
        report(done / len(views), "Learning the background")
        found = describe(look(panorama, float(azimuth), lens, pitch), _VIEW_POINTS)
        parts.append(_squarely_seen(found, lens, float(azimuth), pitch))
    report(1.0, "Learning the background")
    descriptors = np.concatenate([features.descriptors for features, _ in parts])
    vectors = np.concatenate([vectors for _, vectors in parts])
    if len(vectors) < _LEAST_POINTS:
        raise CoreError(
            "There is nothing in this panorama that a camera could be found by.",
            "Turn by the number of degrees, or capture it again with more light.",
        )
    azimuths = np.degrees(np.arctan2(-vectors[:, 0], vectors[:, 2]))
    order = np.argsort(azimuths)
    arrays = (descriptors[order], vectors[order], azimuths[order])
    return HeadingIndex(*(np.ascontiguousarray(a, np.float32) for a in arrays))


def _squarely_seen(
    found: Features, lens: Lens, azimuth_deg: float, pitch_deg: float
) -> tuple[Features, Float64]:
    """Keep the points that no other view shows more squarely."""
    vectors = bearings(lens, azimuth_deg, pitch_deg, found.places.astype(np.float64))
    azimuth = np.degrees(np.arctan2(-vectors[:, 0], vectors[:, 2]))
    away = np.abs((azimuth - azimuth_deg + 180.0) % 360.0 - 180.0)
    keep = (away <= _EVERY_DEG / 2) & ((vectors[:, 1] >= 0.0) == (pitch_deg > 0.0))
    return Features(found.places[keep], found.descriptors[keep]), vectors[keep]
