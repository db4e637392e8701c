"""Effect of a probe that is a foot or two from the later position of the head.

The environments are renders of the demo location, whose every light is known: at its three spots
and 1 and 2 feet away from them in four directions. Values come from
``benchmarks/answers/evaluation/build_offsets.py``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import read_sealed, write_sealed
from app.core.base.errors import TransportError

if TYPE_CHECKING:
    from pathlib import Path

Float32: TypeAlias = NDArray[np.float32]

OFFSETS_VERSION: Final = 1
_AGAIN: Final = "Restore it with git, or run python -m benchmarks.answers.evaluation.build_offsets."
_MOST_BYTES: Final = 1 << 24


@dataclass(frozen=True, slots=True, eq=False)
class Offsets:
    """Environments at some spots and beside them.

    Attributes:
        spot: (K,) int32. Spot of each environment.
        feet: (K,) float32. Distance from the spot, ft; 0 at the spot itself.
        bearing_deg: (K,) float32. Direction, deg of panorama azimuth.
        light: (K, H, W, 3) float32. Linear Rec. 709 radiance; one scale for each spot.
    """

    spots: tuple[str, ...]
    spot: NDArray[np.int32]
    feet: Float32
    bearing_deg: Float32
    light: Float32 = field(repr=False)


def save_offsets(path: Path, offsets: Offsets) -> str:
    """Store environments, atomically, and return their SHA-256."""
    arrays = {name: np.ascontiguousarray(getattr(offsets, name), kind) for name, kind in _KINDS}
    return write_sealed(path, arrays, {"format_version": OFFSETS_VERSION, "spots": offsets.spots})


def load_offsets(path: Path) -> Offsets:
    """Load environments.

    Raises:
        TransportError: If the file is missing, damaged, made by a newer version, or something else.
    """
    names = [name for name, _ in _KINDS]
    header, known = read_sealed(
        path, "table of places", _AGAIN, OFFSETS_VERSION, names=names, most=_MOST_BYTES
    )
    try:
        offsets = Offsets(spots=tuple(str(name) for name in header["spots"]), **known)
        fits = _fits(offsets)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise TransportError(f"{path.name} is not a table of places.", _AGAIN) from error
    if not fits:
        raise TransportError(f"{path.name} contradicts itself.", _AGAIN)
    return offsets


_KINDS: Final = (
    ("spot", np.int32),
    ("feet", np.float32),
    ("bearing_deg", np.float32),
    ("light", np.float32),
)


def _fits(offsets: Offsets) -> bool:
    count = len(offsets.spot)
    light = offsets.light
    fits = count > 0 and light.ndim == 4 and light.shape[0] == count and light.shape[3] == 3
    fits = fits and light.shape[2] == 2 * light.shape[1] and bool(np.isfinite(light).all())
    fits = fits and offsets.feet.shape == offsets.bearing_deg.shape == (count,)
    inside = (offsets.spot >= 0) & (offsets.spot < len(offsets.spots))
    centres = {int(k) for k in offsets.spot[offsets.feet == 0]}
    return fits and bool(inside.all()) and centres == set(range(len(offsets.spots)))
