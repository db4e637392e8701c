"""A person who stands, or walks, in an environment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base import sphere
from app.core.base.colour import luminance
from app.core.environment.environment import energy

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.core.base.colour import FloatImage

_DARK_RED: Final = (0.25, 0.06, 0.05)
_HEAD_M: Final = 0.12
_BODY_M: Final = 0.23


def with_person(
    environment: FloatImage,
    azimuth_deg: float,
    *,
    distance_m: float = 2.0,
    height_m: float = 1.75,
    camera_m: float = 1.5,
    reflectance: tuple[float, float, float] = _DARK_RED,
) -> tuple[FloatImage, NDArray[np.bool_]]:
    """Put a person in front of an environment: an upright capsule with a ball for a head.

    Args:
        environment: NDArray[np.float32], (H, 2 H, 3). Linear radiance, any scale.
        azimuth_deg: Where the person stands, degrees to the right of the centre column.
        reflectance: Of red, green and blue; the person is as bright as this share of the
            environment's mean luminance, all over.

    Returns:
        radiance: NDArray[np.float32], (H, 2 H, 3). The environment with the person, in the same
            scale; a new array.
        mask: NDArray[np.bool_], (H, 2 H). Which texels show the person.

    Raises:
        ValueError: When the person would stand in the camera.
    """
    if distance_m < 2.0 * _BODY_M:
        raise ValueError(f"a person cannot stand {distance_m} m from the camera")
    looks = sphere.directions((environment.shape[0], environment.shape[1])).astype(np.float64)
    side = distance_m * sphere.direction(azimuth_deg, 0.0)
    up = sphere.direction(0.0, 90.0)
    head = side + (height_m - camera_m - _HEAD_M) * up
    top = head - (_HEAD_M + _BODY_M) * up
    feet = side + (_BODY_M - camera_m) * up
    mask = _meets_ball(looks, head, _HEAD_M)
    # A capsule is what a ball passes over; balls this close together leave no gaps to be seen.
    for share in np.linspace(0.0, 1.0, 2 + math.ceil((top[1] - feet[1]) / (0.1 * _BODY_M))):
        mask |= _meets_ball(looks, top + share * (feet - top), _BODY_M)
    result = np.array(environment, dtype=np.float32)
    result[mask] = mean_luminance(result) * np.asarray(reflectance, dtype=np.float32)
    return result, mask


def _meets_ball(
    looks: NDArray[np.float64], middle: NDArray[np.float64], radius: float
) -> NDArray[np.bool_]:
    """Whether rays from the camera meet a ball."""
    distance = float(np.linalg.norm(middle))
    limit = math.sqrt(max(1.0 - (radius / distance) ** 2, 0.0))
    met: NDArray[np.bool_] = (looks @ (middle / distance)) >= limit
    return met


def mean_luminance(radiance: FloatImage) -> float:
    """Mean luminance over the sphere, weighted by solid angle.

    Args:
        radiance: NDArray[np.float32], (H, W, 3). Linear Rec. 709 radiance.
    """
    return float(energy(luminance(radiance))) / (4.0 * np.pi)
