"""The part of a place that a lamp hides, and the contrast of a face in the light of both.

The contrast is the denominator of the match. The picture is linear in its three parts: the place's
light, minus the part that the lamp hides, plus the lamp's own light. In an orthonormal basis of the
head's possible pictures, each part has a hundred or so coordinates, and the squared norm of the sum
is that of the coordinates. All parts use the same basis, so that a hidden sun cancels exactly,
however bright it was.

For the first coordinates, which contain almost everything, every texel is included. For the other
coordinates, only the place's brightest texels are included, because other hidden light is too faint
to matter there.

With E the place's light, a the fraction of each texel that the lamp hides, and Phi any linear
function of light (a pre-integrated target, for example), the hidden part at turn t and azimuth k is

    sum over texels of a(texel) Phi(texel) E(texel turned by t).

A lamp hides only a few texels, and relative to the lamp they are the same at any azimuth. Relative
to the lamp, the light depends only on t - k. For each altitude, one matrix of 64 views of the place
and one product with the targets at each azimuth therefore give all 64 x 64 combinations exactly.

Light and linear functions of light have two parts here (see `app.core.solver.search`). Both parts
are on the full grid, (2, H, W), and are flattened in that order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float32, Float64, Floats, Int64
from app.core.base.errors import CoreError
from app.core.environment.environment import SHAPE
from app.core.second_light.placements import ALTITUDES_DEG, COUNT
from app.core.solver.search import find_colours
from app.core.solver.transport import Transport
from app.core.text import tr

_Float = TypeVar("_Float", bound=np.floating[Any])

_TEXELS: Final = SHAPE[0] * SHAPE[1]
_LEAST_HIDDEN: Final = 1e-6
_MOST: Final = 768  # texels that a lamp may hide around one altitude: three eighths of them all
_STEPS: Final = np.arange(TURNS)
# Index of the product for turn t and azimuth k: view t - k, azimuth k.
_ORDER: Final[Int64] = ((_STEPS[:, None] - _STEPS) % TURNS * TURNS + _STEPS).ravel()


@dataclass(frozen=True, slots=True, eq=False)
class HiddenTexels:
    """The texels that a lamp hides, M for each altitude, for both parts of light."""

    # tuple of (64, M) int64, index in the place's light of the texel behind the lamp, per turn
    # minus azimuth
    views: tuple[Int64, ...] = field(repr=False)
    # tuple of (M, 64) int64, index in the head's frame, per azimuth
    own: tuple[Int64, ...] = field(repr=False)
    # each (M, 64), hidden fraction of each texel, 0 to 1, per azimuth
    shares: tuple[Float64, ...] = field(repr=False)


def find_hidden(alpha: Floats) -> HiddenTexels:
    """Find the texels that a lamp hides.

    Args:
        alpha: (576, 32, 64) float. Fraction of each texel that the lamp hides at each placement, in
            the head's frame.

    Raises:
        CoreError: If the lamp hides too much.
    """
    views, own, shares = [], [], []
    for rows in alpha.reshape(len(ALTITUDES_DEG), TURNS, *SHAPE):
        # Towards the sitter's left is towards the left of the panorama.
        still = np.stack([np.roll(a, k, axis=1) for k, a in enumerate(rows)])
        row, column = np.nonzero((still > _LEAST_HIDDEN).any(axis=0))
        if len(row) > _MOST:
            raise CoreError(
                tr("The mask of this lamp covers almost everything around the head."),
                tr("Correct the mask: it should cover only the lamp."),
            )
        views.append(_both(row * SHAPE[1] + (column + _STEPS[:, None]) % TURNS, 1))
        own.append(_both(row[:, None] * SHAPE[1] + (column[:, None] - _STEPS) % TURNS, 0))
        share = still[:, row, column].T.astype(np.float64)
        shares.append(np.concatenate([share, share]))
    return HiddenTexels(tuple(views), tuple(own), tuple(shares))


def hidden_tables(hidden: HiddenTexels, linear: NDArray[_Float]) -> Iterator[NDArray[_Float]]:
    """Restrict linear functions of light to the hidden texels.

    Args:
        linear: (F, 4096) float. F functions. The value of a function is the sum of its products
            with two-part light.

    Returns:
        One table for each altitude, for use in `correlate`, (F, M, 64) in the type of `linear`. The
        tables are yielded one at a time, since together they are large.
    """
    for own, share in zip(hidden.own, hidden.shares, strict=True):
        table = linear[:, own]
        table *= share.astype(linear.dtype)
        yield table


def correlate(
    hidden: HiddenTexels, tables: Sequence[NDArray[_Float]], light: Float64
) -> NDArray[_Float]:
    """Return the hidden part, summed over texels, at every turn and placement.

    Args:
        tables: One table for each altitude, (F, M, 64) float, from `hidden_tables`.
        light: (2, 32, 64) float64. The place at turn 0.

    Returns:
        (F, 64, 576) in the type of the tables, by turn and placement.
    """
    flat = light.reshape(-1).astype(tables[0].dtype)
    result = np.empty_like(tables[0], shape=(len(tables[0]), len(tables), TURNS, TURNS))
    for altitude, (views, table) in enumerate(zip(hidden.views, tables, strict=True)):
        np.matmul(flat[views], table, out=result[:, altitude])
    return by_turn(result)


def by_turn(values: NDArray[_Float]) -> NDArray[_Float]:
    """Reorder values given by turn minus azimuth into values given by turn.

    Args:
        values: (F, 9, 64, 64) float. Values by altitude, turn minus azimuth, and azimuth.

    Returns:
        (F, 64, 576) of the same type, by turn and placement.
    """
    count = len(values)
    sorted_ = np.empty((count, TURNS, len(ALTITUDES_DEG), TURNS), values.dtype)
    for altitude in range(len(ALTITUDES_DEG)):
        flat = values[:, altitude].reshape(count, -1)
        sorted_[:, :, altitude] = flat[:, _ORDER].reshape(count, TURNS, TURNS)
    return sorted_.reshape(count, TURNS, COUNT)


def correlate_at(
    hidden: HiddenTexels, tables: Sequence[NDArray[_Float]], light: Float64, turn: int
) -> Float64:
    """Return the hidden part, summed over texels, at one turn, (F, 576) float64."""
    flat = light.reshape(-1)
    index = (turn - _STEPS) % TURNS
    rows = [
        np.einsum("km,fmk->fk", flat[views[index]], table)
        for views, table in zip(hidden.views, tables, strict=True)
    ]
    return np.concatenate(rows, axis=1)


def two_parts(light: Floats, mixing: Float64) -> Float64:
    """Split light into the two parts of `app.core.solver.search`, on the full grid.

    Args:
        light: (..., H, W, 3) float. Linear Rec. 709 radiance.
        mixing: (2, 3) float64. The split of light into two parts for the head.

    Returns:
        (..., 2, H, W) float64. The two parts, in the same unit as `light`.
    """
    red, green, blue = (light[..., channel].astype(np.float64) for channel in range(3))
    # Texel by texel, so that mirrored light gives exactly the mirrored parts.
    return np.stack([r * red + g * green + b * blue for r, g, b in mixing], axis=-3)


def _both(texels: Int64, axis: int) -> Int64:
    return np.concatenate([texels, texels + _TEXELS], axis=axis).astype(np.int64)


_MAIN: Final = (48, 96)  # coordinates that the search uses, at least and at most
_SIZE: Final = 2e7  # numbers in the tables of hidden parts; large lamps get fewer coordinates
_LEAST: Final = 0.02  # texels with less than this fraction of the strongest contrast count less
_BRIGHT: Final = 16  # texels of the place that count as brightest
_BATCH: Final = 48  # coordinates at a time: their data stay in the cache
_PURE: Final = 1e-4
_SUMS: Final = (_STEPS[:, None] + _STEPS) % TURNS


@dataclass(frozen=True, slots=True, eq=False)
class FaceBasis:
    """An orthonormal basis of the pictures of a face, each minus its mean over the face."""

    # (P,), square root of the weight of each pixel of the head
    root: Float64 = field(repr=False)
    # (P, K), basis pictures times `root`, most important first
    pixels: Float32 = field(repr=False)
    # (K, 4096), products with two-part light sum to the coordinates of the picture
    rows: Float64 = field(repr=False)
    # (33, K, 64) complex64, `rows` transformed along azimuth and conjugated
    spectra: NDArray[np.complex64] = field(repr=False)
    mixing: Float64  # (2, 3), split of light into two parts (see `app.core.solver.search`)


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """The pictures of a lamp's light, and of the light that the lamp hides, in a face's basis."""

    face: FaceBasis = field(repr=False)
    lamp: Float64 = field(repr=False)  # (K, 576), coordinates of the lamp's pictures
    # (576,), squared norm of their part outside the basis
    beside: Float64 = field(repr=False)
    # each (M, D, 64), per altitude: contribution of each hidden texel to the first D coordinates
    hidden: tuple[Float32, ...] = field(repr=False)
    # each (1, M, 64), per altitude: contribution of each hidden texel along the lamp's own picture
    shadows: tuple[Float64, ...] = field(repr=False)
    # (4096, K - D), contribution of each texel to the other coordinates
    further: Float32 = field(repr=False)
    # (2048, 576), fraction of each texel that the lamp hides, per placement
    shades: Float32 = field(repr=False)


def prepare_face(transport: Transport, region: Float64) -> FaceBasis:
    """Find a basis for the pictures of a head's face. This takes one second.

    Args:
        region: (P,). Weight of each pixel (see `app.core.solver.face`).

    Raises:
        CoreError: If the transport was baked for environments of a different size.
    """
    if transport.environment_shape != SHAPE:
        raise CoreError(
            tr("A second light needs a head baked for 64 x 32 texels."), tr("Choose another head.")
        )
    colours = find_colours(transport)
    root = np.sqrt(region)
    grey, tint = (less_mean(basis.T, root).T for basis in colours.bases)
    texels = colours.texels.reshape(len(colours.texels), -1).astype(np.float64)
    tinted = np.einsum("rkw,kh->rhw", colours.mixed, colours.mixtures).reshape(texels.shape)
    pictures, rows, merits = [], [], []
    for kind in _kinds(transport):
        values, vectors = np.linalg.eigh(grey[:, kind].T @ grey[:, kind])
        keep = values > 1e-10 * values[-1]
        basis = grey[:, kind] @ (vectors[:, keep] / np.sqrt(values[keep]))
        first = (basis.T @ grey[:, kind]) @ texels[kind]
        second = (basis.T @ tint[:, kind]) @ tinted[kind]
        # The sun may be in any texel, so each is weighted by the shape of its picture.
        size = np.linalg.norm(first, axis=0)
        even = first / np.maximum(size, _LEAST * size.max())
        values, axes = np.linalg.eigh(even @ even.T)
        pictures.append(basis @ axes)
        rows.append(axes.T @ np.concatenate([first, second], axis=1))
        merits.append(values)
    order = np.argsort(-np.concatenate(merits), kind="stable")
    sorted_rows = np.concatenate(rows)[order]
    spectra = np.fft.rfft(sorted_rows.reshape(len(order), -1, SHAPE[1]), axis=2)
    return FaceBasis(
        root=root,
        pixels=np.concatenate(pictures, axis=1)[:, order].astype(np.float32),
        rows=sorted_rows,
        spectra=spectra.conj().transpose(2, 0, 1).astype(np.complex64, "C"),
        mixing=colours.mixing,
    )


def find_contrast(
    face: FaceBasis, hidden: HiddenTexels, lamp: Float64, beside: Float64
) -> Contrast:
    """Express a lamp in a face's basis.

    Args:
        lamp: (K, 576) float64. Coordinates of the lamp's pictures.
        beside: (576,) float64. Squared norms of the pictures' parts outside the basis.
    """
    texels = sum(len(own) for own in hidden.own)
    main = int(np.clip(_SIZE / (TURNS * max(texels, 1)), *_MAIN))
    tables = hidden_tables(hidden, face.rows[:main].astype(np.float32))
    return Contrast(
        face=face,
        lamp=lamp,
        beside=beside,
        hidden=tuple(np.ascontiguousarray(table.transpose(1, 0, 2)) for table in tables),
        shadows=_shadows(face, hidden, lamp),
        further=np.ascontiguousarray(face.rows[main:].T.astype(np.float32)),
        shades=_shades(hidden),
    )


def _shadows(face: FaceBasis, hidden: HiddenTexels, lamp: Float64) -> tuple[Float64, ...]:
    """Return each hidden texel's contribution along the lamp's picture, (1, M, 64) by altitude."""
    sums = [np.zeros((1, *own.shape)) for own in hidden.own]
    for start in range(0, len(face.rows), _BATCH):
        part = slice(start, start + _BATCH)
        tables = hidden_tables(hidden, face.rows[part])
        pictures = lamp[part].reshape(-1, len(sums), TURNS)
        for altitude, table in enumerate(tables):
            sums[altitude][0] += np.einsum("dmk,dk->mk", table, pictures[:, altitude])
    return tuple(sums)


def _shades(hidden: HiddenTexels) -> Float32:
    """Return the fraction of each texel that the lamp hides, (2048, 576)."""
    texels = SHAPE[0] * SHAPE[1]
    shades = np.zeros((texels, len(hidden.own), TURNS), np.float32)
    for altitude, (own, shares) in enumerate(zip(hidden.own, hidden.shares, strict=True)):
        half = len(own) // 2
        shades[own[:half], altitude, _STEPS] = shares[:half]
    return shades.reshape(texels, -1)


@dataclass(frozen=True, slots=True, eq=False)
class Norms:
    """The squared contrast of the face, for any power of the lamp."""

    # place, both: (64, 576) float64, or (1, 576) at one turn, of the place's light minus the hidden
    # part; twice its product with the lamp's picture
    place: Float64 = field(repr=False)
    both: Float64 = field(repr=False)
    lamp: Float64 = field(repr=False)  # (576,), of the lamp's picture

    def at(self, power: float) -> Float64:
        """Return the norm over the face of the picture's luminance minus its mean."""
        squared = self.place + power * self.both
        squared += power * power * self.lamp
        return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


def norms(
    contrast: Contrast, hidden: HiddenTexels, light: Floats, scale: float, turn: int | None = None
) -> Norms:
    """Find the contrast of the face at every turn and placement.

    Args:
        light: (32, 64, 3) float. The place at turn 0, as linear Rec. 709 radiance.
        scale: Mean luminance by which the result is normalised.
        turn: Index of the only turn to evaluate, or None for all turns.
    """
    parts = two_parts(light, contrast.face.mixing)
    place = _at_all_turns(contrast, parts)
    place = place if turn is None else place[:, [turn]]
    own = np.square(contrast.lamp).sum(axis=0) + contrast.beside
    both = place.T @ contrast.lamp
    if turn is None:
        both -= correlate(hidden, contrast.shadows, parts)[0]
    else:
        both -= correlate_at(hidden, contrast.shadows, parts, turn)
    main = contrast.hidden[0].shape[1]
    remainder = _remainder(contrast, hidden, place[:main].astype(np.float32), parts, turn)
    remainder += _further(contrast, place[main:], parts, turn)
    return Norms(remainder, both * (2.0 / scale), own / scale**2)


def _remainder(
    contrast: Contrast, hidden: HiddenTexels, place: Float32, parts: Float64, turn: int | None
) -> Float64:
    """Return the squared norm of the place's pictures without the hidden part, (64 or 1, 576)."""
    flat = parts.reshape(-1).astype(np.float32)
    # Relative to the lamp, light depends only on turn minus azimuth, the first axis here.
    rolled = np.ascontiguousarray(place[:, _SUMS].transpose(1, 0, 2)) if turn is None else place
    results = []
    for views, table in zip(hidden.views, contrast.hidden, strict=True):
        if turn is not None:
            view = flat[views[(turn - _STEPS) % TURNS]]
            rest = rolled - np.einsum("km,mdk->dk", view, table)
            results.append(np.square(rest).sum(axis=0))
            continue
        squared = np.zeros((TURNS, TURNS), np.float32)
        for start in range(0, table.shape[1], _BATCH):
            part = slice(start, start + _BATCH)
            columns = table[:, part]
            size = columns.shape[1]
            loss = flat[views] @ columns.reshape(len(table), size * TURNS)
            loss = loss.reshape(TURNS, size, TURNS)
            np.subtract(rolled[:, part], loss, out=loss)
            squared += np.einsum("tdk,tdk->tk", loss, loss)
        results.append(squared)
    stacked: Float64 = np.stack(results).astype(np.float64)
    return by_turn(stacked[None])[0] if turn is None else stacked.reshape(1, -1)


def _further(contrast: Contrast, place: Float64, parts: Float64, turn: int | None) -> Float64:
    """Return `_remainder` in the other coordinates, minus the brightest texels, (64 or 1, 576).

    If r is the place's picture, d_b texel b's contribution to it and s_b the hidden fraction of
    b, then |r - sum of s_b d_b|^2 = |r|^2 - 2 sum of s_b (d_b . r) + sum of s_a s_b (d_a . d_b).
    """
    texels = len(contrast.shades)
    counts = np.square(contrast.further[:texels]).sum(axis=1).reshape(SHAPE).mean(axis=1)
    merit = np.square(parts[0]) * counts[:, None]
    row, column = np.divmod(np.argpartition(merit.ravel(), -_BRIGHT)[-_BRIGHT:], SHAPE[1])
    turns = _STEPS if turn is None else np.array([turn])
    where = row * SHAPE[1] + (column - turns[:, None]) % SHAPE[1]
    single = contrast.further[where] * parts[0, row, column][:, None]
    single += contrast.further[texels + where] * parts[1, row, column][:, None]
    shares = contrast.shades[where].astype(np.float64)
    along = np.einsum("tbr,rt->tb", single, place)
    between = single @ single.transpose(0, 2, 1)
    loss = ((between @ shares - 2.0 * along[:, :, None]) * shares).sum(axis=1)
    result: Float64 = np.square(place).sum(axis=0)[:, None] + loss
    return np.maximum(result, 0.0)


def norm_at(
    contrast: Contrast,
    hidden: HiddenTexels,
    light: Floats,
    scale: float,
    turn: int,
    number: int,
    power: float = 1.0,
) -> float:
    """Return the contrast at one turn and placement, in all coordinates.

    Args:
        light: (32, 64, 3) float. The place at turn 0, divided by `scale`.
        turn, number: Indices of the turn and of the placement.
        power: Fraction of the lamp's full power.
    """
    face = contrast.face
    parts = two_parts(np.roll(light, -turn, axis=1), face.mixing).reshape(-1)
    altitude, azimuth = divmod(number, TURNS)
    own, share = hidden.own[altitude][:, azimuth], hidden.shares[altitude][:, azimuth]
    parts[own] -= share * parts[own]
    strength = power / scale
    picture = face.rows @ parts + contrast.lamp[:, number] * strength
    squared = float(picture @ picture) + float(contrast.beside[number]) * strength**2
    return float(np.sqrt(max(squared, 0.0)))


def _at_all_turns(contrast: Contrast, parts: Float64) -> Float64:
    """Return the coordinates of the place's pictures at every turn, (K, 64)."""
    spectrum = np.fft.rfft(parts.reshape(-1, SHAPE[1]), axis=1).T.astype(np.complex64)
    product = (contrast.face.spectra @ spectrum[:, :, None])[:, :, 0]
    return np.asarray(np.fft.irfft(product.T, n=SHAPE[1], axis=1))


def less_mean(pictures: Floats, root: Float64) -> Float64:
    """Subtract the mean over the face from pictures, (..., P), and weight the pixels by `root`."""
    centred = pictures.astype(np.float64)
    centred -= (centred @ root**2)[..., None] / (root @ root)
    return centred * root


def _kinds(transport: Transport) -> list[Bools]:
    """Return masks of T's even and odd rows, or one mask of all rows for an asymmetrical head."""
    rows = transport.texel_basis.reshape(-1, *transport.environment_shape).astype(np.float64)
    flipped = np.einsum("rhw,rhw->r", rows, rows[:, :, ::-1])
    ratio = flipped / (np.einsum("rhw,rhw->r", rows, rows) + 1e-30)
    pure = bool((np.abs(np.abs(ratio) - 1.0) < _PURE).all())
    if not (pure and transport.header.symmetric):
        return [np.ones(len(rows), bool)]
    return [ratio > 0, ratio < 0]
