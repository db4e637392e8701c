"""Build style packs from target pictures, whose weights are pre-integrated and exactly mirrored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.errors import StyleError
from app.core.solver.face import AREAS, FaceRegion, find_face, mirror_area
from app.core.solver.head_shape import HeadShape
from app.core.solver.search import SearchColours, find_colours
from app.core.solver.style_signature import NO, YES, Signatures, better, grades, stops_of
from app.core.solver.transport import Transport, parity_of, to_image
from app.core.solver.weights import region_weights, target_weights
from app.core.styles.lamps import AS_PUBLISHED, Studio, mirror_index, studio_lamps, studio_light
from app.core.styles.style import Style
from app.core.styles.style_pack import Float16, PackHeader, StylePack, judged_region, rounded
from app.core.text import tr

_MAX_RANK: Final = 256
# maximum missing fraction of the contrast under any single relevant texel
_TOLERANCE: Final = 0.003
# texels with less than this fraction of the strongest contrast are irrelevant
_RELEVANT: Final = 0.003
_BASIS_DIGITS: Final = 12  # binary digits; changes match by less than 0.02 points


@dataclass(frozen=True, slots=True)
class SearchBasis:
    """Rows whose squared products with an environment sum to the squared contrast of the face.

    Attributes:
        even, odd: (E, Q, W / 2), (O, Q, W / 2) float32. Left halves of the rows that are even and
            odd under mirroring.
        paired: Whether even row r and odd row r are parts of one row, as for an asymmetric head.
        error: Largest fraction missing from the contrast of a relevant texel.
    """

    even: Float32
    odd: Float32
    paired: bool
    error: float


def build_basis(
    transport: Transport, colours: SearchColours, weights: Float64, region: Float64
) -> SearchBasis:
    """Build the search basis of a head.

    The weights of the targets lie in the span of the basis, so the match never exceeds 100. The
    basis is chosen for grey light, and coloured light uses the same basis pictures.

    Args:
        weights: (S, P) float64. Target weights over the region, and 0 elsewhere.
        region: (P,) float64. Weight of each pixel.
    """
    face = region > 0
    root_region = np.sqrt(region[face])
    weights = weights[:, face] / root_region
    grey, tint = (_centred(basis[face], root_region) for basis in colours.bases)
    texels = transport.texel_basis.astype(np.float64)
    mixed = colours.mixed.reshape(len(texels), -1).astype(np.float64)
    parity = parity_of(transport) if transport.header.symmetric else None
    # Even and odd pictures of a symmetric head are orthogonal. Treat them separately, so that
    # rounding and nearly equal eigenvalues cannot mix them.
    parts = [np.ones(len(texels), bool)] if parity is None else [parity > 0, parity < 0]
    pictures, tinted, wishes = [], [], []
    for part in parts:
        values, vectors = np.linalg.eigh(grey[:, part].T @ grey[:, part])
        keep = values > 1e-12 * values[-1]
        root, vectors = np.sqrt(values[keep]), vectors[:, keep]
        # The part's pictures, as coordinates in an orthonormal basis of the face.
        face_basis = grey[:, part] @ vectors / root
        pictures.append((vectors.T @ texels[part]) * root[:, None])
        tinted.append((face_basis.T @ tint[:, part]) @ mixed[part])
        wishes.append((weights @ face_basis).T)
    rows, error = _compress(pictures, tinted, wishes)
    shape = colours.rows, transport.environment_shape[1]
    return _halves(rows, shape, parity is not None, error)


def _centred(pixels: Float32, root: Float64) -> Float64:
    centred = pixels.astype(np.float64)
    centred -= (root**2 @ centred) / (root @ root)
    return centred * root[:, None]


def _compress(
    pictures: list[Float64], tinted: list[Float64], wishes: list[Float64]
) -> tuple[Float64, float]:
    """Keep the directions in picture space that contain the contrast of every single texel.

    Args:
        pictures: One array for each parity, (K, T), with one column per texel.
        tinted: One array for each parity, (K, U), with the same for the second part of coloured
            light.
        wishes: One array for each parity, (K, S), with the targets.

    Returns:
        The kept rows, (rank, T + U), and the largest fraction of a relevant texel's contrast that
        these rows miss.
    """
    exact = np.sqrt(sum((part**2).sum(axis=0) for part in pictures))
    relevant = exact > _RELEVANT * exact.max()
    rows: list[Float64] = []
    merits: list[Float64] = []
    for part, tint, wish in zip(pictures, tinted, wishes, strict=True):
        # When split into parity parts, a left and a right style have the same directions.
        first = _orthonormal(wish)
        scaled = part[:, relevant] / exact[relevant]
        u, s, _ = np.linalg.svd(scaled - first @ (first.T @ scaled), full_matrices=False)
        both = np.concatenate([part, tint], axis=1)
        rows += [first.T @ both, u.T @ both]
        merits += [np.full(first.shape[1], np.inf), s]
    merit = np.concatenate(merits)
    basis = np.concatenate(rows)[np.argsort(-merit, kind="stable")[:_MAX_RANK]]
    grey = basis[:, : len(exact)][:, relevant]
    energy = np.sqrt(np.cumsum((grey / exact[relevant]) ** 2, axis=0))
    missing = 1 - energy.min(axis=1)
    enough = np.flatnonzero(missing <= _TOLERANCE)
    rank = int(enough[0]) + 1 if enough.size else len(basis)
    rank = min(max(rank, int(np.isinf(merit).sum())), len(basis))
    return basis[:rank], float(max(missing[rank - 1], 0.0))


def _orthonormal(columns: Float64) -> Float64:
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(u[:, s > 1e-6 * max(float(s[0]), 1e-30)])


def _halves(rows: Float64, shape: tuple[int, int], symmetric: bool, error: float) -> SearchBasis:
    grid = rows.reshape(-1, *shape)
    half = shape[1] // 2
    left, right = grid[:, :, :half], grid[:, :, : half - 1 : -1]
    even, odd = 0.5 * (left + right), 0.5 * (left - right)
    if symmetric:
        is_even = (even**2).sum(axis=(1, 2)) >= (odd**2).sum(axis=(1, 2))
        even, odd = even[is_even], odd[~is_even]
    return SearchBasis(
        even=np.ascontiguousarray(even, np.float32),
        odd=np.ascontiguousarray(odd, np.float32),
        paired=not symmetric,
        error=error,
    )


def build_pack(
    transport: Transport, styles: Sequence[Style], targets: Floats, shape: HeadShape
) -> StylePack:
    """Pre-integrate styles against a transport (eqs. 6 and 3).

    The quality C is computed over the whole head, as in the paper. Match, strength and signatures
    are computed over the face. On a symmetric head, a style and its mirror image are made exact
    mirror images of each other, and a style that is its own mirror image is made exactly even.

    Args:
        targets: (S, P, 3) float. Target pictures of the styles at the head's pixels, linear Rec.
            709. The scale may differ between styles.
        shape: Shape of the same head.

    Raises:
        StyleError: If a target picture is uniform or does not fit the head.
        TransportError: If the head has no face.
    """
    if targets.shape != (len(styles), len(transport.pixels), 3) or not len(styles):
        raise StyleError(tr("The target pictures do not fit this head and these styles."))
    face = find_face(transport, shape)
    share = face.region / face.region.sum()
    colours = find_colours(transport)
    parts = _make_parts(transport, colours, face, styles, targets)
    area_rows = colours.integrate(face.areas)
    mean = colours.integrate(share)
    if transport.header.symmetric:
        area_rows = _mirror_exact(area_rows, [AREAS.index(mirror_area(name)) for name in AREAS])
        mean = 0.5 * (mean + mean[:, ::-1])
    of_faces = np.array([not style.signature.areas for style in styles])
    basis = build_basis(transport, colours, parts.weights[of_faces], face.region)
    header = PackHeader(
        head=transport.header.head,
        skin=transport.header.skin,
        environment=transport.environment_shape,
        picture=transport.size,
        transport_sha256=transport.digest,
        basis_error=basis.error,
        paired=basis.paired,
    )
    return StylePack(
        header=header,
        styles=tuple(styles),
        targets=parts.targets,
        coverage=to_image(transport, transport.coverage).astype(np.float16),
        region=to_image(transport, face.region).astype(np.float16),
        areas=np.stack([to_image(transport, area) for area in face.areas]).astype(np.float16),
        mixing=colours.mixing,
        mixtures=colours.mixtures,
        target_rows=parts.target_rows,
        face_rows=parts.face_rows,
        area_rows=rounded(area_rows),
        weight_norm=parts.weight_norm,
        mean_rows=np.ascontiguousarray(mean),
        basis_even=rounded(basis.even, _BASIS_DIGITS),
        basis_odd=rounded(basis.odd, _BASIS_DIGITS),
        studio_ratio=parts.studio_ratio,
    )


class _PackParts(NamedTuple):
    """Data derived from target pictures, with arrays as in `StylePack`."""

    pictures: Floats  # (S, P, 3), exact mirrors of each other
    weights: Float64  # (S, P), over the face region
    targets: Float16
    target_rows: Float32
    face_rows: Float32
    weight_norm: Float64
    studio_ratio: Float64


def _make_parts(
    transport: Transport,
    colours: SearchColours,
    face: FaceRegion,
    styles: Sequence[Style],
    targets: Floats,
) -> _PackParts:
    if transport.header.symmetric:
        targets = _mirror_pictures(transport, styles, targets)
    luminance = _luminance(transport, targets)
    whole = np.stack([target_weights(picture, transport.face) for picture in luminance])
    regions = np.stack([judged_region(style, transport, face.region) for style in styles])
    part = np.stack([region_weights(*each) for each in zip(luminance, regions, strict=True)])
    share = regions / regions.sum(axis=1, keepdims=True)
    rows = [colours.integrate(each) for each in (whole, part)]
    if transport.header.symmetric:
        twins = [mirror_index(styles, style) for style in styles]
        rows = [_mirror_exact(each, twins) for each in rows]
    scaled = [picture / max(float(picture.max()), 1e-30) for picture in targets]
    return _PackParts(
        pictures=targets,
        weights=part,
        targets=np.stack([to_image(transport, p) for p in scaled]).astype(np.float16),
        target_rows=rounded(rows[0]),
        face_rows=rounded(rows[1]),
        weight_norm=np.sqrt((part**2 / np.maximum(regions, 1e-30)).sum(axis=1)),
        studio_ratio=(part * luminance).sum(axis=1) / (luminance * share).sum(axis=1),
    )


@dataclass(frozen=True, eq=False)
class StudioPacks:
    """Packs for a head under other studio lamps.

    Preparing this object is slow, but each pack is then built quickly.
    """

    pack: StylePack = field(repr=False)
    transport: Transport = field(repr=False)
    shape: HeadShape = field(repr=False)

    @cached_property
    def _face(self) -> FaceRegion:
        return find_face(self.transport, self.shape)

    @cached_property
    def _colours(self) -> SearchColours:
        return find_colours(self.transport)

    @cached_property
    def _own(self) -> Float64:
        """Relations of all styles in their own targets, (R,), in stops."""
        flat = self.pack.targets.reshape(len(self.pack.styles), -1, 3)[:, self.transport.pixels]
        return self._relations(_luminance(self.transport, flat))

    def pack_for(self, studio: Studio, others: Mapping[str, Studio] | None = None) -> StylePack:
        """Return the pack with its targets lit by other lamps.

        Signatures are adapted: the target is the style's own picture under these lamps, with limits
        in the same proportion as with the style's own lamps. A style keeps its own lamps if its
        target would no longer show the style or would be mistaken for another one.

        Args:
            others: Choices for individual styles, by name.
        """
        pack, transport = self.pack, self.transport
        studios = [(others or {}).get(style.name, studio).fit_for(style) for style in pack.styles]
        if all(each == AS_PUBLISHED for each in studios):
            return pack
        parts = _make_parts(
            transport, self._colours, self._face, pack.styles, self._studio_pictures(studios)
        )
        relations = self._relations(_luminance(transport, parts.pictures))
        styles, start = [], 0
        for style, each in zip(pack.styles, studios, strict=True):
            stop = start + len(style.signature.relations)
            signature = style.signature.scaled(self._own[start:stop], relations[start:stop])
            lamps = studio_lamps(style, replace(each, ratio=None))
            styles.append(replace(style, lamps=lamps, signature=signature))
            start = stop
        shows = self._show_themselves(parts, styles).tolist()
        new = [each != AS_PUBLISHED and own for each, own in zip(studios, shows, strict=True)]

        def pick(name: str) -> NDArray[Any]:
            theirs, ours = getattr(pack, name), getattr(parts, name)
            return np.stack([o if use else t for o, t, use in zip(ours, theirs, new, strict=True)])

        every = zip(styles, pack.styles, studios, new, strict=True)
        pairs = [(s, each) if use else (own, AS_PUBLISHED) for s, own, each, use in every]
        return replace(
            pack,
            styles=tuple(style for style, _ in pairs),
            studios=tuple(each for _, each in pairs),
            targets=pick("targets"),
            target_rows=pick("target_rows"),
            face_rows=pick("face_rows"),
            weight_norm=pick("weight_norm"),
            studio_ratio=pick("studio_ratio"),
        )

    def _studio_pictures(self, studios: Sequence[Studio]) -> Floats:
        """Return the pictures of the head in the given studios, (S, P, 3)."""
        shape = self.transport.environment_shape
        lights = [
            studio_light(style, studio, shape)
            for style, studio in zip(self.pack.styles, studios, strict=True)
        ]
        flat = np.reshape(lights, (len(lights), -1)).T.astype(np.float32)
        pictures = self.transport.pixel_basis @ (self.transport.texel_basis @ flat)
        return np.ascontiguousarray(pictures.transpose(2, 1, 0))

    def _relations(self, luminance: Float64) -> Float64:
        """Compute the relations of each style in its own picture, (R,), from luminance, (S, P)."""
        stops = stops_of(self._face.areas @ luminance.T)
        return np.concatenate(
            [
                Signatures((style.signature,)).values(stops[:, row : row + 1])[:, 0]
                for row, style in enumerate(self.pack.styles)
            ]
        )

    def _show_themselves(self, parts: _PackParts, styles: Sequence[Style]) -> Bools:
        """Return a mask, (S,), of targets that have their full signature and fit no other style."""
        face, luminance = self._face, _luminance(self.transport, parts.pictures)
        centred = luminance - (luminance @ face.region / face.region.sum())[:, None]
        norms = np.outer(parts.weight_norm, np.sqrt(centred**2 @ face.region))
        match = 100.0 * (parts.weights @ luminance.T) / norms
        signatures = Signatures(tuple(style.signature for style in styles))
        grade = grades(*signatures.slack(stops_of(face.areas @ luminance.T), match))
        shows = []
        for row in range(len(styles)):
            rivals = [n for n in range(len(styles)) if n != row and not styles[n].signature.areas]
            other = better(row, grade[:, row].tolist(), match[:, row].tolist(), rivals)
            ambiguous = other is not None and grade[other, row] > NO
            shows.append(grade[row, row] == YES and not ambiguous)
        twins = [mirror_index(styles, style) for style in styles]
        both = [shows[row if twin is None else twin] for row, twin in enumerate(twins)]
        return np.logical_and(shows, both)


def _luminance(transport: Transport, pictures: Floats) -> Float64:
    """Return the luminance, (S, P), of linear Rec. 709 pictures, (S, P, 3)."""
    weights = np.asarray(transport.header.luminance_weights)
    return np.asarray(pictures.astype(np.float64) @ weights)


def _mirror_pictures(transport: Transport, styles: Sequence[Style], targets: Floats) -> Floats:
    """Average each target picture with the mirror image of the target of its mirrored style."""
    flipped = transport.mirror_pixels
    if flipped is None:
        return targets
    exact = np.array(targets)
    for here, style in enumerate(styles):
        there = mirror_index(styles, style)
        if there is not None:
            exact[here] = 0.5 * (targets[here] + targets[there][flipped])
    return exact


def _mirror_exact(rows: Float32, twins: Sequence[int | None]) -> Float32:
    """Make the mirror symmetry exact by removing rounding errors."""
    exact = rows.copy()
    for here, there in enumerate(twins):
        if there is not None:
            exact[here] = 0.5 * (rows[here] + rows[there][:, ::-1])
    return exact
