"""Light as the search sees it: what an environment's colours do to the luminance of a face.

Skin reflects red light more than blue, and its gloss reflects all alike, so the luminance of a
picture is not T's luminance times the luminance of the light. With y the luminance weights it is

    sum_c y_c T_c L_c  =  T_Y (m . L)  +  S (v . L)  +  a rest,

where T_Y is the transport of luminance, m sums to 1 and v to 0: grey light has a first part only.
The best such m, v and S leave a rest of some thousandth of a picture. Of the second part's rows,
which are much alike, a few mixtures hold all that matters. Both parts turn alike; to the search
they are one environment with a few more rows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import luminance
from app.core.solver.environment import solid_angles

if TYPE_CHECKING:
    from app.core.solver.transport import Transport

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
Floats: TypeAlias = NDArray[np.floating[Any]]

MIXTURES: Final = 10
"""Rows that the second part adds, at most: more would not make the search more exact."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchColours:
    """The two parts of a head's luminance.

    Attributes:
        mixing: (2, 3) float64. m and v: what linear Rec. 709 light counts in each part.
        mixtures: (K, H) float64. What each row of the environment counts in the rows of the second
            part.
        bases: (2, P, R) float32. Pixel bases of T_Y and of S.
        texels: (R, H, W) float32. The transport's texel basis.
        mixed: (R, K, W) float32. The same for the rows of the second part.
    """

    mixing: Float64
    mixtures: Float64 = field(repr=False)
    bases: Float32 = field(repr=False)
    texels: Float32 = field(repr=False)
    mixed: Float32 = field(repr=False)

    @property
    def rows(self) -> int:
        """Rows of light as the search sees it: Q = H + K."""
        return len(self.mixtures) + int(self.mixtures.shape[1])

    def integrate(self, weights: Floats) -> Float32:
        """Pre-integrate weights against both parts (eq. 3).

        Args:
            weights: (P,) float. On the head's pixels, zero outside the face.

        Returns:
            (Q, W) float32. Panorama coordinates at turn 0; times what `seen_light` gives it sums to
            C.
        """
        first, second = (weights.astype(np.float32) @ basis for basis in self.bases)
        rows = np.tensordot(first, self.texels, 1), np.tensordot(second, self.mixed, 1)
        return np.concatenate(rows).astype(np.float32)


def find_colours(transport: Transport) -> SearchColours:
    """Split a head's luminance into two parts.

    Returns:
        With the m that leaves least to the second part, and the v that leaves least over.
    """
    weights = np.asarray(transport.header.luminance_weights, np.float64)
    channels = transport.pixel_basis.astype(np.float64) * weights[:, None, None]
    face = channels[:, transport.face]
    texels = transport.texel_basis.astype(np.float64)
    # Products of T's channels, summed over all pixels and texels, without ever making T.
    products = np.einsum("apr,bpr->ab", face @ (texels @ texels.T), face)
    first = products.sum(axis=1) / products.sum()
    rest = products - np.outer(first, first) * products.sum()
    # Of what grey light does not have; a head without colours has nothing of it, and any v will do.
    second = np.linalg.eigh(rest - products.sum())[1][:, -1]
    second -= second.mean()
    parts = np.stack([np.ones(3), second - second @ first])
    bases = np.tensordot(parts, channels, axes=1)
    grid = texels.reshape(-1, *transport.environment_shape)
    mixtures, mixed = _mixtures(bases[1, transport.face], grid)
    return SearchColours(
        mixing=np.stack([first, second]),
        mixtures=mixtures,
        bases=np.ascontiguousarray(bases, np.float32),
        texels=np.ascontiguousarray(grid, np.float32),
        mixed=np.ascontiguousarray(mixed, np.float32),
    )


def _mixtures(pixels: Float64, texels: Float64) -> tuple[Float64, Float64]:
    """Principal mixtures of the rows of S: what they take of the light, and their texel basis."""
    root = np.sqrt(solid_angles(texels.shape[1:]))[:, None]
    even = texels / root
    pictures = np.tensordot(np.linalg.qr(pixels, mode="r"), even, axes=1)
    alike = np.einsum("ahw,agw->hg", pictures, pictures, optimize=True)
    principal = np.linalg.eigh(alike)[1][:, : -MIXTURES - 1 : -1].T
    return principal * root.T, np.einsum("kh,rhw->rkw", principal, even, optimize=True)


def seen_light(light: Floats, mixing: Float64, mixtures: Float64) -> Float64:
    """Make of an environment what the search looks through.

    Args:
        light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance, or luminance of light that
            counts as grey.
        mixing: (2, 3) float64.
        mixtures: (K, H) float64. Of the head, see `SearchColours`.

    Returns:
        (Q, W) float64, Q = H + K. In the unit of `light`.
    """
    if light.ndim == 2:
        return np.concatenate([light, np.zeros((len(mixtures), light.shape[1]))])
    red, green, blue = (light[:, :, channel].astype(np.float64) for channel in range(3))
    # Texel by texel, so that a mirrored environment gives exactly the mirrored light.
    first, second = (r * red + g * green + b * blue for r, g, b in mixing)
    return np.concatenate([first, (mixtures[:, :, None] * second).sum(axis=1)])


def luminance_of(light: Floats) -> Float64:
    """Luminance of an environment, whether it has colours or not.

    Args:
        light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance, or luminance.

    Returns:
        (H, W) float64. In the unit of `light`.
    """
    return np.asarray(light if light.ndim == 2 else luminance(light), np.float64)
