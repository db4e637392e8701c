"""Data types of the light probe: exposures, frames, brackets and merged light."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from app.core.base.arrays import Float32
from app.core.base.remarks import Remark


@dataclass(frozen=True, slots=True)
class Exposure:
    """The exposure of a frame, given as the time in seconds, the ISO and the f-number.

    Attributes:
        known: Whether the ISO and the f-number are recorded rather than assumed.
    """

    shutter_s: float
    iso: float = 100.0
    aperture: float = 1.0
    known: bool = True

    @property
    def factor(self) -> float:
        """Linear exposure, time x (ISO / 100) / f-number^2, which is larger for brighter frames."""
        return self.shutter_s * self.iso / 100.0 / self.aperture**2

    @property
    def ev(self) -> float:
        """The exposure in stops. One stop more is twice as bright."""
        return math.log2(self.factor)


@dataclass(frozen=True, slots=True)
class LensExposure:
    """The exposure of one lens (Ricoh maker notes 0x0101 and 0x0103)."""

    shutter_s: float
    iso: float


@dataclass(frozen=True, slots=True)
class XmpPose:
    """The orientation from XMP (GPano), in degrees. The compass heading is never used."""

    pitch_deg: float
    roll_deg: float
    heading_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Frame:
    """The metadata of a frame in a bracket, without its pixels.

    Attributes:
        shape: Numbers of rows and columns.
        kind: "uint8", "uint16", "half" or "float".
        exposure: Exposure from EXIF or from the user, or None if neither provides it.
        area_deg: Area of a partial panorama from XMP (GPano), given as the azimuths of its left and
            right edges and the elevations of its top and bottom edges, in degrees, or None if not
            recorded.
        zenith_corrected: Whether the camera levelled the picture, or None if this is not recorded.
        lenses: Exposures of the two lenses, or an empty tuple if these are not recorded.
        fisheye: Whether the file is marked as unstitched.
        orientation: EXIF orientation, 1 to 8.
        primaries: The x and y chromaticities of red, green, blue and white, or an empty tuple for
            those of Rec. 709.
        focal_mm: Focal length as a 35 mm equivalent, in mm.
    """

    path: Path
    shape: tuple[int, int]
    kind: str = "uint8"
    exposure: Exposure | None = None
    camera: str = ""
    pose: XmpPose | None = None
    area_deg: tuple[float, float, float, float] | None = None
    zenith_corrected: bool | None = None
    lenses: tuple[LensExposure, ...] = ()
    tone_mapped: bool = False
    fisheye: bool = False
    orientation: int = 1
    primaries: tuple[float, ...] = ()
    focal_mm: float | None = None

    @property
    def decoded_bytes(self) -> int:
        """The size of the decoded frame in memory, in bytes. Half floats are stored as floats."""
        return self.shape[0] * self.shape[1] * 3 * {"uint8": 1, "uint16": 2}.get(self.kind, 4)

    @property
    def as_stored(self) -> Frame:
        """The frame with its rows and columns as stored, before it is rotated upright."""
        rows, columns = self.shape
        shape = (columns, rows) if self.orientation >= 5 else self.shape
        return replace(self, shape=shape, orientation=1)


@dataclass(frozen=True, slots=True)
class Bracket:
    """The frames that were shot at one place and time.

    Attributes:
        frames: The frames, brightest first, without duplicates and all of the same shape. Each has
            an exposure unless it is the only frame.
        stops: Exposure of each frame (`Exposure.ev`), in descending order.
        unstitched: Whether the frames show two fisheye circles.
    """

    frames: tuple[Frame, ...]
    stops: tuple[float, ...]
    warnings: tuple[Remark, ...] = ()
    unstitched: bool = False

    @property
    def shape(self) -> tuple[int, int]:
        """The numbers of rows and columns of every frame."""
        return self.frames[0].shape

    @property
    def panorama(self) -> bool:
        """Whether the frames are full 2:1 panoramas, or will be stitched into one."""
        return self.unstitched or self.shape[1] == 2 * self.shape[0]


@dataclass(frozen=True, slots=True)
class MergedLight:
    """The linear light from a bracket, with its clipped and dark fractions.

    Attributes:
        radiance: (H, W, 3) float32. Linear Rec. 709 light, which is finite and non-negative. One
            unit saturates a frame with the exposure `reference_ev`. The value is a lower bound
            where all frames are clipped.
        clipped, dark: (H, W) float32. Fraction of each texel's area that every frame clips in its
            worst channel or shows as black, respectively.
        reference_ev: Exposure that defines the unit, in stops.
        clip_level: Radiance at which the darkest frame clips.
        cd_m2: Luminance of one unit in cd/m2, or None if the absolute exposure is unknown.
        clipped_fractions: Fraction of clipped pixels in each frame, in the order of the frames.
    """

    radiance: Float32 = field(repr=False)
    clipped: Float32 = field(repr=False)
    dark: Float32 = field(repr=False)
    reference_ev: float
    clip_level: float
    cd_m2: float | None = None
    clipped_fractions: tuple[float, ...] = ()

    @property
    def shares(self) -> Float32:
        """The clipped and dark fractions, (H, W, 2)."""
        return np.dstack([self.clipped, self.dark])

    def moved(self, radiance: Float32, shares: Float32) -> MergedLight:
        """Return resampled light with new fractions, which are limited to the range from 0 to 1."""
        clipped, dark = (np.clip(shares[..., part], 0.0, 1.0) for part in (0, 1))
        return replace(self, radiance=np.ascontiguousarray(radiance), clipped=clipped, dark=dark)
