"""Lenses that see more than a half-space: where a direction falls in the picture, and back.

A fisheye maps the angle t from its axis to a distance from its centre, r = f (t + b3 t^3 + b5 t^5
...); without the bends it is equidistant. Centre, focal length, bends and axes are all there is, so
that the same lens serves a camera of two fisheyes back to back and any other one.

`MODELS` knows cameras of which makers or users published something. What is not known of a model is
assumed to be equidistant, 200 degrees wide, upright in the file, and calibrated from the frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from app.core.base.arrays import Float32, Float64


_WIDEST: Final = math.radians(130.0)


@dataclass(frozen=True, slots=True)
class Lens:
    """One fisheye.

    `centre` is (x, y) in pixels, whole numbers at the middles of pixels. `focal` is pixels per
    radian on the axis. `axes`, (3, 3) float64, has the directions right, up and ahead of the
    lens's picture as rows, in the panorama's axes (`app.core.base.sphere`).
    """

    centre: tuple[float, float]
    focal: float
    axes: Float64 = field(repr=False)
    bends: tuple[float, ...] = ()

    def radius(self, angles: Float64) -> Float64:
        """Return the distance from the centre in pixels of angles from the axis in radians."""
        return self.focal * bent(angles, self.bends)

    def project(self, vectors: Float32) -> tuple[Float32, Float32, Float32]:
        """Return the columns and rows of directions, (..., 3), and their angles in radians."""
        seen = vectors @ self.axes.T.astype(vectors.dtype)
        across = np.hypot(seen[..., 0], seen[..., 1])
        angle = np.arctan2(across, seen[..., 2])
        scale = self.radius(angle) / np.maximum(across, 1e-12)
        x, y = self.centre[0] + scale * seen[..., 0], self.centre[1] - scale * seen[..., 1]
        return np.asarray(x, np.float32), np.asarray(y, np.float32), angle

    def unproject(self, columns: Float64, rows: Float64) -> Float64:
        """Return the unit vectors, (..., 3), to places in the picture."""
        right, up = columns - self.centre[0], self.centre[1] - rows
        across = np.hypot(right, up)
        table = np.linspace(0.0, _WIDEST, 4001)
        radii = np.maximum.accumulate(self.radius(table))
        angle = np.interp(across, radii, table)
        level = np.sin(angle) / np.maximum(across, 1e-12)
        seen = np.stack([right * level, up * level, np.cos(angle)], axis=-1)
        return np.asarray(seen @ self.axes)


def bent(angles: Float64, bends: tuple[float, ...]) -> Float64:
    """Return t + b3 t^3 + b5 t^5 ... of angles t in radians."""
    square, factor = angles * angles, np.zeros_like(angles)
    for bend in reversed(bends):
        factor = (factor + bend) * square
    return angles * (1.0 + factor)


def turned(axes: Float64, clockwise_deg: float) -> Float64:
    """Return the axes of a lens whose picture is stored turned clockwise."""
    angle = math.radians(clockwise_deg)
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ axes)


@dataclass(frozen=True, slots=True)
class Model:
    """What is known of a camera's lenses before its picture is looked at.

    `field_deg` is the angle that the image circle spans; where `focal` is known, the focal length
    as a share of the side of one circle's half of the picture, it counts instead. `turns_deg` is by
    how much each of the two circles is stored turned clockwise; None where that is not known.
    `front` is which of them looks ahead: the left or upper one, unless something else is known.
    """

    names: tuple[str, ...]
    field_deg: float = 200.0
    focal: float | None = None
    bends: tuple[float, ...] = ()
    turns_deg: tuple[float, float] | None = None
    front: int = 0


# Theta: Ricoh's design tables (theta-api-specs, "THETA Lens Spec"), fitted to 0.16 degrees or
# better; the size of an unstitched picture of the X is assumed. Insta360: curve of an X3's lenses
# that a user calibrated (hilti-trimble-slam-challenge-2026, issue 29), fitted to 0.03 degrees;
# circles turned by 90 degrees to either side, front lens on the right, as streams of X2, X3 and X5
# have them (ai4ce/insta360_ros_driver) and users say of files of the X2 (rekliner/insta360x2toMP4);
# that X4 and the ONE series are alike is assumed. Samsung: 195 degrees by its data sheet. All other
# fields are assumed.
MODELS: Final = (
    Model(("THETA X", "THETA A1"), focal=0.3132, bends=(0.05478, -0.03131, 0.00153)),
    Model(("THETA Z1",), focal=0.3000, bends=(0.17716, -0.16902, 0.05716, -0.00735)),
    Model(
        ("THETA V", "THETA S", "THETA SC", "THETA SC2"),
        focal=0.2925,
        bends=(-0.01312, 0.00638, -0.00379),
    ),
    Model(
        ("INSTA360",),
        bends=(0.08037, -0.00465, -0.00617, 0.00054),
        turns_deg=(270.0, 90.0),
        front=1,
    ),
    Model(("OSMO 360",)),
    Model(("SM-C200", "SM-R210", "GEAR 360"), field_deg=195.0),
)

_UNKNOWN: Final = Model(())


def model_of(camera: str) -> Model:
    """Return what is known of a camera by the model that its files state."""
    name = camera.upper()
    known = (model for model in MODELS if any(part in name for part in model.names))
    return next(known, _UNKNOWN)
