"""The face of a head: the region that is judged, and its named areas.

Positions are given in the face's own units, so that they mean the same on every head. Horizontal
positions are measured from the centre line in units of half the distance between the eyes, positive
towards the sitter's left. Vertical positions are measured downwards from the eyes, as fractions of
the distance from the eyes to the lower edge of the chin. Both are derived from three points on the
mesh: the point between the eyes, the tip of the nose and the chin.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.base.arrays import Float64
from app.core.base.errors import TransportError
from app.core.solver.head_shape import HeadShape
from app.core.solver.transport import Transport
from app.core.text import tr

# half the eye distance divided by the distance from eyes to chin; mean of several heads
_HALF_EYES: Final = 0.266
_NECK_M: Final = 0.045  # metres; skin this far behind the tip of the nose is neck
_MIDDLE_M: Final = 0.002


class _Oval(NamedTuple):
    across: float
    down: float
    wide: float
    high: float


# One side of the face; the other is its mirror image.
_SIDED: Final = {
    "cheek": _Oval(1.05, 0.36, 0.42, 0.11),
    "outer cheek": _Oval(1.55, 0.36, 0.22, 0.13),
    "lower cheek": _Oval(1.15, 0.60, 0.35, 0.09),
    "nose": _Oval(0.33, 0.27, 0.15, 0.09),
    "nose shadow": _Oval(0.62, 0.36, 0.17, 0.08),
    "patch": _Oval(1.0, 0.22, 0.32, 0.06),
    "lid": _Oval(0.9, -0.09, 0.4, 0.05),
    "temple": _Oval(0.9, -0.42, 0.4, 0.12),
    "half": _Oval(0.95, 0.35, 0.75, 0.55),
}
_MIDDLE: Final = {
    "forehead": (_Oval(0.0, -0.42, 0.7, 0.14),),
    "throat": (_Oval(0.0, 1.13, 0.7, 0.08),),
    "under the nose": (_Oval(0.0, 0.415, 0.25, 0.035),),
    "middle": (_Oval(0.0, 0.3, 0.5, 0.5),),
    "middle line": (
        _Oval(0.0, 0.15, 0.12, 0.12),
        _Oval(0.0, 0.48, 0.2, 0.05),
        _Oval(0.0, 0.85, 0.35, 0.08),
    ),
    "cheeks": (_SIDED["cheek"], _SIDED["cheek"]._replace(across=-_SIDED["cheek"].across)),
    "lids": (_SIDED["lid"], _SIDED["lid"]._replace(across=-_SIDED["lid"].across)),
}
_EYE: Final = _Oval(0.93, 0.0, 0.5, 0.085)
# Skin that faces away from the camera, by the range between two heights and by its azimuth.
_EDGES: Final = {
    "edge": (-0.6, 0.85, 50.0, 88.0),
    "upper edge": (-0.6, 0.05, 50.0, 88.0),
    "lower edge": (0.3, 0.85, 50.0, 88.0),
    "outline": (-0.6, 0.85, 75.0, 95.0),
}
_EDGE_ACROSS: Final = 2.35  # the ears are beyond this
# Skin above the brows that faces up, by its elevation.
_CROWN: Final = {"hairline": (30.0, 50.0), "crown": (50.0, 88.0)}
_CROWN_DOWN: Final = -0.5

AREAS: Final = (
    *(f"{side} {name}" for name in (*_SIDED, *_EDGES) for side in ("left", "right")),
    *(*_MIDDLE, *_CROWN, "background", "surroundings"),
)
"""Names of all areas, in the order used in packs. "Left" is the sitter's left."""

AROUND: Final = slice(-2, None)
"""The last of the areas. They belong to the place around the head, not to the head."""

_AROUND_DEG: Final = (6.0, 40.0)  # a portrait shows about 9 by 11 degrees of the background
_DARKEST: Final = 2.0**-20  # fraction of the brightest light that counts as black


@dataclass(frozen=True, slots=True, eq=False)
class FaceRegion:
    """The judged region of a head's picture, and the areas within it.

    Attributes:
        region: (P,) float64. Weight of each pixel, 0 to 1. The region reaches from the brows to the
            chin and from temple to temple, excluding the eyes, whose whites are brighter than dark
            skin in any light.
        areas: (A, P) float64. Weights of the pixels in each of `AREAS`. Each row sums to 1, so the
            product with a picture gives the mean of each area. Rows of areas around the head are 0.
    """

    region: Float64 = field(repr=False)
    areas: Float64 = field(repr=False)


def find_face(transport: Transport, shape: HeadShape) -> FaceRegion:
    """Locate the face region and its areas on a head, using the mesh.

    Raises:
        TransportError: If no face on the head points forward.
    """
    across, down = _places(shape)
    whole = transport.face.astype(np.float64)
    region = _region(across, down, whole)
    ovals = oval_areas(across, down, whole)
    areas = np.stack([ovals[name] if name in ovals else np.zeros_like(whole) for name in AREAS])
    facing, upward = _facing_deg(transport, shape)
    inner = np.abs(across) < _EDGE_ACROSS
    for name, (top, bottom, least, most) in _EDGES.items():
        for side, sign in (("left", 1.0), ("right", -1.0)):
            skin = inner & (sign * facing > least) & (sign * facing < most)
            areas[AREAS.index(f"{side} {name}")] = whole * (skin & (down > top) & (down < bottom))
    for name, (least, most) in _CROWN.items():
        skin = inner & (upward > least) & (upward < most)
        areas[AREAS.index(name)] = whole * (skin & (down < _CROWN_DOWN))
    if not region.any():
        raise _no_face()
    # An area that a head lacks, or that is too small in its picture, becomes the whole face.
    areas[~areas.any(axis=1)] = region
    areas /= areas.sum(axis=1, keepdims=True)
    areas[AROUND] = 0.0
    there = transport.mirror_pixels
    if transport.header.symmetric and there is not None:
        order = [AREAS.index(mirror_area(name)) for name in AREAS]
        region = 0.5 * (region + region[there])
        areas = 0.5 * (areas + areas[order][:, there])
    return FaceRegion(region, areas)


def region_in_view(view: Transport, places: HeadShape, front: HeadShape) -> Float64:
    """Return the weight, (P,), of each pixel of a turned head (see `FaceRegion.region`).

    Args:
        places: Skin positions behind the view's pixels.
        front: Skin positions of the same head, seen from the front.
    """
    return _region(*_places(places, front), view.face.astype(np.float64))


def _region(across: Float64, down: Float64, whole: Float64) -> Float64:
    region = whole * _between(across, -2.2, 2.2, 0.3) * _between(down, -0.35, 0.97, 0.1)
    for middle in (_EYE.across, -_EYE.across):
        away = _away(across, down, _EYE._replace(across=middle))
        region *= np.clip((away - 0.85) / 0.3, 0.0, 1.0)
    return np.asarray(region)


def brightness_around(light: Float64) -> Float64:
    """Return how bright the place looks behind the sitter and around the head, at every turn.

    This is the geometric mean of the luminance, with weights that fall off smoothly with the angle
    from the point directly behind the sitter. Like the eye, and unlike the mean, it hardly counts a
    small lamp in front of a dark wall.

    Args:
        light: (N, H, W) float64. Luminance at turn 0.

    Returns:
        (N, 2, 64) float64. Brightness of the last two of `AREAS` at the grid turns, in the unit of
        `light`.
    """
    least = np.maximum(_DARKEST * light.max(axis=(1, 2), keepdims=True), 1e-30)
    spectra = np.fft.rfft(np.log(np.maximum(light, least)))
    turned = np.einsum("nhf,ahf->naf", spectra, _maps_around(light.shape[1:]))
    return np.asarray(np.exp(np.fft.irfft(turned, TURNS) * (TURNS / light.shape[-1])))


@lru_cache(maxsize=4)
def _maps_around(shape: tuple[int, ...]) -> NDArray[np.complex128]:
    """Return the conjugate spectra, (2, H, W / 2 + 1), of maps whose weights sum to 1."""
    height, width = shape
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    cosine = -np.outer(np.cos(elevation), np.cos(azimuth))
    away = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    maps = np.stack([np.exp(-0.5 * (away / wide) ** 2) for wide in _AROUND_DEG])
    maps *= np.cos(elevation)[:, None]
    return np.asarray(np.conj(np.fft.rfft(maps / maps.sum(axis=(1, 2), keepdims=True))))


def oval_areas(across: Float64, down: Float64, whole: Float64) -> dict[str, Float64]:
    """Return the areas inside the face for pixels given in face coordinates.

    Args:
        across, down, whole: (P,) float64. Positions of the pixels, and their weights.

    Returns:
        Weights of the pixels, (P,) float64, by area name. Each array sums to 1. The areas at the
        outline are not included.
    """
    ovals = {name: (oval,) for name, oval in _SIDED.items()}
    sided = {
        f"{side} {name}": [oval._replace(across=sign * oval.across) for oval in each]
        for name, each in ovals.items()
        for side, sign in (("left", 1.0), ("right", -1.0))
    }
    result = {}
    for name, each in {**sided, **_MIDDLE}.items():
        parts = [_oval(across, down, oval, whole) for oval in each]
        result[name] = np.sum([p / max(p.sum(), 1e-30) for p in parts], axis=0) / len(parts)
    return result


def _no_face() -> TransportError:
    return TransportError(tr("No face can be found on this head."), tr("Choose another head."))


def mirror_area(name: str) -> str:
    """Return the name of the area on the opposite side of the face, or the same name if central.

    Examples:
        >>> mirror_area("left cheek"), mirror_area("throat")
        ('right cheek', 'throat')
    """
    for here, there in (("left ", "right "), ("right ", "left ")):
        if name.startswith(here):
            return there + name.removeprefix(here)
    return name


def _places(shape: HeadShape, front: HeadShape | None = None) -> tuple[Float64, Float64]:
    """Return the positions across and down, (P,) each, in face units measured from the front."""
    x, y, z = (front or shape).positions.astype(np.float64).T
    eyes = float(shape.eye_point[1])
    line = np.flatnonzero(np.abs(x) <= np.abs(x).min() + _MIDDLE_M)
    tip = line[z[line].argmax()]
    under = line[(y[line] < y[tip]) & (z[line] > z[tip] - _NECK_M)]
    long = eyes - float(y[under].min()) if len(under) else 0.0
    if not long > 0:
        raise _no_face()
    x, y = shape.positions.astype(np.float64).T[:2]
    return x / (_HALF_EYES * long), (eyes - y) / long


def _between(values: Float64, low: float, high: float, soft: float) -> Float64:
    rise = np.clip((values - low) / soft + 0.5, 0.0, 1.0)
    return np.asarray(rise * np.clip((high - values) / soft + 0.5, 0.0, 1.0))


def _oval(across: Float64, down: Float64, oval: _Oval, whole: Float64) -> Float64:
    """Return the fraction of each pixel in an oval, (P,), or the nearest pixel to a tiny oval."""
    away = _away(across, down, oval)
    inside = whole * np.clip((1.15 - away) / 0.3, 0.0, 1.0)
    return np.asarray(inside if inside.any() else away == away[whole > 0].min(), np.float64)


def _away(across: Float64, down: Float64, oval: _Oval) -> Float64:
    """Return each pixel's distance from the centre of an oval, (P,), scaled to 1 at the outline."""
    distance = np.hypot((across - oval.across) / oval.wide, (down - oval.down) / oval.high)
    return np.asarray(distance, np.float64)


def _facing_deg(transport: Transport, shape: HeadShape) -> tuple[Float64, Float64]:
    """Return the azimuth and the elevation of the skin normals, (P,) each, in degrees.

    The azimuth is positive towards the sitter's left. Both angles are NaN at the outline.
    """
    size = transport.size
    flat = np.full((size * size, 3), np.nan)
    flat[shape.pixels] = shape.positions
    grid = flat.reshape(size, size, 3)
    right, down = np.full_like(grid, np.nan), np.full_like(grid, np.nan)
    right[:, 1:-1] = grid[:, 2:] - grid[:, :-2]
    down[1:-1] = grid[2:] - grid[:-2]
    x, y, z = np.cross(down, right).reshape(-1, 3)[shape.pixels].T
    azimuth, elevation = np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))
    return np.degrees(azimuth), np.degrees(elevation)
