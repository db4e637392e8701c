"""Quality, match and strength of many targets at every turn, in the azimuth frequency domain.

Turning the environment shifts it along the azimuth, so the value of a target at every turn is a
circular correlation: one product per azimuth frequency and elevation row (eq. 5 for all turns at
once). Everything is split into parts that are even and odd under left-right mirroring. This halves
the work and ensures that a mirrored panorama gives mirrored curves, up to rounding.

Conventions: Texel column j is at theta_j = 2 pi (j + 1/2) / W radians. At turn index k, the head
sees column j + k in place of column j. Curves have `TURNS` values, with index k at 5.625 k degrees.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from app.core.base.angles import TURNS
from app.core.base.arrays import Float32, Float64, Floats
from app.core.base.colour import luminance
from app.core.environment.environment import solid_angles
from app.core.solver.face import brightness_around
from app.core.solver.transport import Transport

MIXTURES: Final = 10
"""Maximum number of rows added by the second part. More would not make the search more accurate."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchColours:
    """The two parts into which a head's luminance is split for coloured light.

    Attributes:
        mixing: (2, 3) float64. The vectors m and v, which weight the channels of linear Rec. 709
            light in each part.
        mixtures: (K, H) float64. Weights of the environment's rows in each row of the second part.
        bases: (2, P, R) float32. Pixel bases of T_Y and S.
        texels: (R, H, W) float32. The texel basis of the transport.
        mixed: (R, K, W) float32. The texel basis for the rows of the second part.
    """

    mixing: Float64
    mixtures: Float64 = field(repr=False)
    bases: Float32 = field(repr=False)
    texels: Float32 = field(repr=False)
    mixed: Float32 = field(repr=False)

    @property
    def rows(self) -> int:
        """Number of rows of light in the search, Q = H + K."""
        return len(self.mixtures) + int(self.mixtures.shape[1])

    def integrate(self, weights: Floats) -> Float32:
        """Pre-integrate weights with both parts (eq. 3).

        Args:
            weights: (..., P) float. Weights on the head's pixels, zero outside the face.

        Returns:
            (..., Q, W) float32. The target in panorama coordinates at turn 0. The sum of its
            product with the result of `seen_light` is C.
        """
        first, second = (weights.astype(np.float32) @ basis for basis in self.bases)
        rows = np.tensordot(first, self.texels, 1), np.tensordot(second, self.mixed, 1)
        return np.concatenate(rows, axis=-2).astype(np.float32)


def find_colours(transport: Transport) -> SearchColours:
    """Split a head's luminance into two parts.

    Returns:
        The split for which m leaves as little as possible to the second part and v leaves the
        smallest remainder.
    """
    weights = np.asarray(transport.header.luminance_weights, np.float64)
    texels = transport.texel_basis.astype(np.float64)
    products = np.outer(weights, weights) * _channel_products(transport, texels @ texels.T)
    first = products.sum(axis=1) / products.sum()
    rest = products - np.outer(first, first) * products.sum()
    # The component that grey light lacks; a head without colours has none, and any v will do.
    second = np.linalg.eigh(rest - products.sum())[1][:, -1]
    second -= second.mean()
    mixing, grid = np.stack([first, second]), texels.reshape(-1, *transport.environment_shape)
    bases = _bases(transport, mixing)
    mixtures, mixed = _mixtures(bases[1, transport.face], grid)
    return _colours(mixing, mixtures, bases, grid, mixed)


def colours_as(transport: Transport, mixing: Float64, mixtures: Float64) -> SearchColours:
    """Split the luminance of a view, using the mixtures from the head's front picture.

    Args:
        mixing, mixtures: The values from the head's `SearchColours`, so that the head's search
            light can also be used for the view.
    """
    grid = transport.texel_basis.astype(np.float64).reshape(-1, *transport.environment_shape)
    solid = solid_angles(grid.shape[1:])
    mixed = np.einsum("kh,rhw->rkw", mixtures / solid, grid, optimize=True)
    return _colours(mixing, mixtures, _bases(transport, mixing), grid, mixed)


def _bases(transport: Transport, mixing: Float64) -> Float64:
    """Return the pixel bases of T_Y and S, (2, P, R)."""
    weights = np.asarray(transport.header.luminance_weights, np.float64)
    parts = np.stack([np.ones(3), mixing[1] - mixing[1] @ mixing[0]])
    return np.asarray(np.einsum("ka,apr->kpr", parts * weights, transport.pixel_basis))


def _colours(
    mixing: Float64, mixtures: Float64, bases: Float64, texels: Float64, mixed: Float64
) -> SearchColours:
    return SearchColours(
        mixing=mixing,
        mixtures=mixtures,
        bases=np.ascontiguousarray(bases, np.float32),
        texels=np.ascontiguousarray(texels, np.float32),
        mixed=np.ascontiguousarray(mixed, np.float32),
    )


def _channel_products(transport: Transport, texels: Float64) -> Float64:
    """Return the products of T's channels, summed over all pixels and texels, without forming T."""
    out = np.empty((3, 3))
    for one in range(3):
        first = transport.pixel_basis[one, transport.face].astype(np.float64)
        for two in range(one + 1):
            second = transport.pixel_basis[two, transport.face].astype(np.float64)
            out[one, two] = out[two, one] = np.vdot(first.T @ second, texels)
    return out


def _mixtures(pixels: Float64, texels: Float64) -> tuple[Float64, Float64]:
    """Return the principal mixtures of the rows of S, as their light weights and texel basis."""
    root = np.sqrt(solid_angles(texels.shape[1:]))[:, None]
    even = texels / root
    pictures = np.tensordot(np.linalg.qr(pixels, mode="r"), even, axes=1)
    alike = np.einsum("ahw,agw->hg", pictures, pictures, optimize=True)
    principal = np.linalg.eigh(alike)[1][:, : -MIXTURES - 1 : -1].T
    return principal * root.T, np.einsum("kh,rhw->rkw", principal, even, optimize=True)


def seen_light(light: Floats, mixing: Float64, mixtures: Float64) -> Float64:
    """Convert an environment to the rows used in the search.

    Args:
        light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance, or luminance of grey light.
        mixing: (2, 3) float64. The value from the head's `SearchColours`.
        mixtures: (K, H) float64. The value from the head's `SearchColours`.

    Returns:
        (Q, W) float64, where Q = H + K. The rows, in the same unit as `light`.
    """
    if light.ndim == 2:
        return np.concatenate([light, np.zeros((len(mixtures), light.shape[1]))])
    red, green, blue = (light[:, :, channel].astype(np.float64) for channel in range(3))
    # Texel by texel, so that a mirrored environment gives exactly the mirrored light.
    first, second = (r * red + g * green + b * blue for r, g, b in mixing)
    return np.concatenate([first, (mixtures[:, :, None] * second).sum(axis=1)])


def luminance_of(light: Floats) -> Float64:
    """Return the luminance of a colour or greyscale environment.

    Args:
        light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance, or luminance.

    Returns:
        (H, W) float64. The luminance, in the same unit as `light`.
    """
    return np.asarray(light if light.ndim == 2 else luminance(light), np.float64)


_HALF = TURNS // 2 + 1  # turns 0..180 degrees; the others follow by mirroring


@dataclass(frozen=True, slots=True)
class SearchTables:
    """Targets and the search basis in the azimuth frequency domain.

    Attributes:
        shape: (H, W) of the light in the search. Its rows are those of an environment and those
            added by `app.core.solver.search`, all of which turn in the same way.
        targets: (M, H, 2 S) float64. Cosine parts, followed by sine parts, of the S targets, for
            each azimuth frequency and elevation row.
        basis: (M, H, 2 + 2 K + E + O) float64. The same for the face-mean target and K other maps
            (cosines, then sines), the E even basis rows (cosine) and the O odd ones (sine).
        paired: Whether even row r and odd row r are the two parts of one basis picture, as for an
            asymmetrical head. Otherwise, each row is a separate basis picture.
        cosine, sine: (W / 2, M) float64. The forward transform.
        back_cosine, back_sine: (33, M) float64. The inverse transform to turns 0 to 180 degrees.
        around: Index of the first of two other maps whose values are replaced by the brightness
            around the head (see `app.core.solver.face`), or None.
    """

    shape: tuple[int, int]
    targets: Float64
    basis: Float64
    others: int
    even: int
    odd: int
    paired: bool
    cosine: Float64
    sine: Float64
    back_cosine: Float64
    back_sine: Float64
    around: int | None = None

    @property
    def count(self) -> int:
        """Number of targets, S."""
        return int(self.targets.shape[2]) // 2


@dataclass(frozen=True, slots=True)
class Curves:
    """Values at every turn. Index k is the turn of 5.625 k degrees.

    For several lights, the arrays have an additional leading axis.

    Attributes:
        quality: (S, 64) float64. C of eq. 5, in the same unit as the environment.
        mean: (64,) float64. Mean luminance of the face.
        contrast: (64,) float64. Norm over the face of the picture minus its mean.
        others: (K, 64) float64. Values of the other maps.
    """

    quality: Float64
    mean: Float64
    contrast: Float64
    others: Float64


def build_tables(
    targets: Floats,
    mean: Floats,
    even: Floats,
    odd: Floats,
    *,
    paired: bool = False,
    others: Floats | None = None,
    around: int | None = None,
) -> SearchTables:
    """Transform pre-integrated targets and a search basis along the azimuth.

    Args:
        targets: (S, H, W) float. Pre-integrated targets F (eq. 3) in panorama coordinates at turn
            0.
        mean: (H, W) float. Pre-integrated mean over the face.
        even, odd: (E, H, W / 2), (O, H, W / 2) float. Left halves of the basis rows that are even
            and odd under mirroring. The squared products of all rows with an environment add up to
            the squared norm of the environment's picture minus its mean.
        paired: As in `SearchTables`.
        others: (K, H, W) float. Other maps to evaluate: areas of the face, and targets over the
            face region.
        around: As in `SearchTables`.
    """
    height, width = targets.shape[1:]
    half, frequencies = width // 2, width // 2 + 1
    theta = 2 * np.pi * (np.arange(half) + 0.5) / width
    order = np.arange(frequencies)
    cosine, sine = np.cos(np.outer(theta, order)), np.sin(np.outer(theta, order))
    # Parseval: ends of the spectrum count once, the rest twice.
    share = np.full(frequencies, 2.0 / width)
    share[0] = share[-1] = 1.0 / width
    phase = 2 * np.pi * np.outer(np.arange(_HALF), order) / TURNS
    back_sine = np.sin(phase) * share
    back_sine[-1] = 0.0  # sin(pi m), which rounding would leave slightly off zero and asymmetric
    count, extra = len(targets), mean[None] if others is None else np.stack([mean, *others])
    both = np.concatenate([targets, extra]).astype(np.float64)
    a_both = _frequency_first(_even(both) @ cosine)
    b_both = _frequency_first(_odd(both) @ sine)
    a_even = _frequency_first(2 * even.astype(np.float64) @ cosine)
    b_odd = _frequency_first(2 * odd.astype(np.float64) @ sine)
    return SearchTables(
        shape=(height, width),
        targets=_join(a_both[..., :count], b_both[..., :count]),
        basis=_join(a_both[..., count:], b_both[..., count:], a_even, b_odd),
        others=len(extra) - 1,
        even=len(even),
        odd=len(odd),
        paired=paired,
        cosine=cosine,
        sine=sine,
        back_cosine=np.cos(phase) * share,
        back_sine=back_sine,
        around=around,
    )


def quality_curves(tables: SearchTables, light: Floats) -> Float64:
    """Return the quality C of every target at every turn (eq. 5).

    Args:
        light: (H, W) float. Search light at turn 0 (see `app.core.solver.search`).

    Returns:
        (S, 64) float64. The quality, in the same unit as the environment.
    """
    return np.asarray(_quality(tables, _spectra(tables, light[None]))[0])


def curves(tables: SearchTables, light: Floats) -> Curves:
    """Return the quality of every target, the face mean and the face contrast at every turn.

    Args:
        light: (H, W) float. Search light at turn 0 (see `app.core.solver.search`).
    """
    result = curves_of(tables, light[None])
    return Curves(result.quality[0], result.mean[0], result.contrast[0], result.others[0])


def curves_of(tables: SearchTables, lights: Floats) -> Curves:
    """Return the curves for several lights at once, which is faster than one light at a time.

    Args:
        lights: (N, H, W) float. Search lights, each as in `curves`.

    Returns:
        The curves, with an additional leading axis for the N lights.
    """
    spectra = _spectra(tables, lights)
    first, second = _products_of(spectra, tables.basis)
    cosine, sine = tables.back_cosine, tables.back_sine
    extra = 1 + tables.others
    sums = _unfold(
        _back(cosine, first[..., :extra] + second[..., extra : 2 * extra]),
        _back(sine, second[..., :extra] - first[..., extra : 2 * extra]),
    )
    start, stop = 2 * extra, 2 * extra + tables.even
    even_p, even_q = _back(cosine, first[..., start:stop]), _back(sine, second[..., start:stop])
    odd_p, odd_q = _back(cosine, second[..., stop:]), -_back(sine, first[..., stop:])
    same = _products(even_p, even_p) + _products(even_q, even_q)
    same += _products(odd_p, odd_p) + _products(odd_q, odd_q)
    cross = 2 * (_products(even_p, even_q) + _products(odd_p, odd_q))
    if tables.paired:
        same += 2 * (_products(even_p, odd_p) + _products(even_q, odd_q))
        cross += 2 * (_products(even_p, odd_q) + _products(even_q, odd_p))
    squared = _unfold(same[..., None], cross[..., None])[:, 0]
    contrast = np.sqrt(np.maximum(squared, 0.0))
    others = sums[:, 1:]
    if tables.around is not None:
        # The rows of an environment come first, and have half as many as columns.
        light = np.asarray(lights[:, : tables.shape[1] // 2], np.float64)
        others[:, tables.around : tables.around + 2] = brightness_around(light)
    return Curves(_quality(tables, spectra), sums[:, 0], contrast, others)


def _spectra(tables: SearchTables, lights: Floats) -> Float64:
    """Return the cosine and then the sine coefficients of the lights' rows, (M, 2 N, H)."""
    if lights.shape[1:] != tables.shape:
        raise ValueError(f"light {lights.shape[1:]} does not fit {tables.shape}")
    height, width = tables.shape
    left, right = lights[..., : width // 2], lights[..., : width // 2 - 1 : -1]
    spectra = np.empty((width // 2 + 1, 2, len(lights) * height))
    np.matmul(tables.cosine.T, (left + right).reshape(-1, width // 2).T, out=spectra[:, 0])
    np.matmul(tables.sine.T, (left - right).reshape(-1, width // 2).T, out=spectra[:, 1])
    return np.asarray(spectra.reshape(-1, 2 * len(lights), height))


def _products_of(spectra: Float64, table: Float64) -> tuple[Float64, Float64]:
    """Return the cosine and sine parts of the lights times the table's columns, (M, N, n) each."""
    product = spectra.astype(table.dtype, copy=False) @ table
    lights = spectra.shape[1] // 2
    return product[:, :lights], product[:, lights:]


def _back(waves: Float64, coefficients: Float64) -> Float64:
    """Return the values at turns 0 to 180 degrees, (33, N, n), for coefficients (M, N, n)."""
    order, lights, count = coefficients.shape
    return (waves @ coefficients.reshape(order, -1)).reshape(-1, lights, count)


def _quality(tables: SearchTables, spectra: Float64) -> Float64:
    first, second = _products_of(spectra, tables.targets)
    count = tables.count
    return _unfold(
        _back(tables.back_cosine, first[..., :count] + second[..., count:]),
        _back(tables.back_sine, second[..., :count] - first[..., count:]),
    )


def _unfold(even: Float64, odd: Float64) -> Float64:
    """Combine even and odd parts at 0 to 180 degrees, (33, N, n), into all turns, (N, n, 64)."""
    full = np.empty((TURNS, *even.shape[1:]))
    np.add(even, odd, out=full[:_HALF])
    np.subtract(even[TURNS // 2 - 1 : 0 : -1], odd[TURNS // 2 - 1 : 0 : -1], out=full[_HALF:])
    return full.transpose(1, 2, 0)


def _even(rows: Float64) -> Float64:
    half = rows.shape[-1] // 2
    return np.asarray(rows[..., :half] + rows[..., : half - 1 : -1])


def _odd(rows: Float64) -> Float64:
    half = rows.shape[-1] // 2
    return np.asarray(rows[..., :half] - rows[..., : half - 1 : -1])


def _frequency_first(rows: Float64) -> Float64:
    """Transpose (n, H, M) to (M, H, n)."""
    return np.transpose(rows, (2, 1, 0))


def _join(*parts: Float64) -> Float64:
    return np.ascontiguousarray(np.concatenate(parts, axis=2))


def _products(a: Float64, b: Float64) -> Float64:
    """Return the products of two arrays, (33, N, n), summed along their last axis, (33, N)."""
    size = a.shape[-1]
    result: Float64 = np.einsum("kr,kr->k", a.reshape(-1, size), b.reshape(-1, size))
    return result.reshape(a.shape[:-1])
