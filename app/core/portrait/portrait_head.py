"""The data of a head's large portrait, stored in a file beside its transport.

Heads are symmetrical, so all data are for the left half of the picture. *Nodes* are points on the
skin and eyes where light is computed. *Samples* are points in the picture that are shaded from the
three nodes around them. In the head's frame, +Y points up, +Z points out of the face, and +X points
to the sitter's left.

From the side, the head is the same but its picture is not symmetrical, so its nodes are those of
both halves.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64, Indices
from app.core.portrait.light import ROWS, Lamp, grid

SKY: Final = (32, 64)
ROOM: Final = 1.06
"""Height of the portrait relative to the transport's picture. Hair rises above the crown."""
CLOSE_ROWS, CLOSE_COLUMNS = 0.85, 0.72
"""Part of a picture, from the top and around its centre line, that contains the head alone."""
SPREAD: Final = 12.0
"""Value of the width of a texel (5.6 degrees) in `SkinNodes.horizon`."""


@dataclass(frozen=True, eq=False)
class Hair:
    """Hair, brows, lashes and a collar, with their light towards the camera for each pixel.

    Attributes:
        pixel: (Q,) intp. Flat positions in the left half.
        cover: (Q,) float32. Fraction of each pixel that the hair covers.
        colour: (Q, 3) float32. Linear Rec. 709 with a luminance of 1.
        basis: (Q, R) float32. Light from each pixel for each basis function, in units of its
            colour.
        cells: (R, G, 3) float32. Weight in each function of each cell of `grid`, with a radiance of
            1. The weights have colours because hair is yellow in transmission and white on top.
        shade: (32, 64, N) int8. Reduction of the sky seen by the nodes, as in `SkinNodes.horizon`.
        gain, glass_gain: (M,), (G,) float32. As in the head, but with the hair in the way. They are
            not needed from the side.
    """

    pixel: Indices = field(repr=False)
    cover: Float32 = field(repr=False)
    colour: Float32 = field(repr=False)
    basis: Float32 = field(repr=False)
    cells: Float32 = field(repr=False)
    shade: NDArray[np.int8] = field(repr=False)
    gain: Float32 = field(default_factory=lambda: np.zeros(0, np.float32), repr=False)
    glass_gain: Float32 = field(default_factory=lambda: np.zeros(0, np.float32), repr=False)

    def halved(self, half: int) -> Hair:
        """Average blocks of two by two pixels. `half` is the number of columns in the left half."""
        row, column = np.divmod(self.pixel, half)
        pixel, place = np.unique(row // 2 * (half // 2) + column // 2, return_inverse=True)

        def mean(values: Float32) -> Float32:
            columns = [np.bincount(place, part, len(pixel)) for part in np.atleast_2d(values.T)]
            return np.asarray(np.stack(columns, axis=-1) / 4, np.float32)

        weight = np.abs(self.basis[:, :1]) + np.float32(1e-6)
        colour = mean(self.colour * weight) / mean(weight)
        cover = mean(self.cover)[:, 0]
        return replace(self, pixel=pixel, cover=cover, colour=colour, basis=mean(self.basis))

    def within(self, mask: Bools) -> Hair:
        """Return the part of the hair that lies within the given pixels of the left half."""
        some = mask.flat[self.pixel]
        parts = {name: getattr(self, name)[some] for name in ("pixel", "cover", "colour", "basis")}
        return replace(self, **parts)


@dataclass(frozen=True, eq=False)
class SkinNodes:
    """Points on the skin and eyes where light is computed.

    Attributes:
        normals: (N, 3) float32. Surface normals.
        horizon: (32, 64, N) int8. Distance between a direction (a texel of a panorama at turn 0)
            and the edge of the sky that a node sees. It is negative if the head hides the
            direction. The width of a texel is `SPREAD`.
        eye: (N,) bool. True for the nodes on the eyes.
        profile: (3,) float32. The light that enters the skin is profile . (mu, mu^2, mu^3), per
            steradian.
        patches: (N, 2) intp. The small and the large patch that contain each node.
    """

    normals: Float32 = field(repr=False)
    horizon: NDArray[np.int8] = field(repr=False)
    eye: Bools = field(repr=False)
    profile: Float32
    patches: Indices = field(repr=False)

    @cached_property
    def soft(self) -> Float32:
        """The light entering each node from each cell of `grid` at radiance 1, (N, G) float32."""
        row, azimuth, _, solid = grid()
        elevation = np.arcsin(cell_ways()[:, 1])
        out = np.empty((len(self.normals), len(row)), np.float32)
        spread = np.float32(SPREAD * SKY[0] / ROWS)
        for cell in range(len(row)):
            inside = self.visibility(float(azimuth[cell]), float(elevation[cell]))
            mu = np.maximum(self.normals @ cell_ways()[cell], 0)
            out[:, cell] = np.clip(0.5 + inside / spread, 0, 1) * self.entering(mu)
        out *= solid.astype(np.float32)
        return out

    def visibility(self, azimuth: float, elevation: float) -> Float32:
        """Interpolate `horizon` in any direction, given in radians, and return (N,) float32."""
        column = (azimuth / (2 * np.pi) + 0.5) % 1.0 * SKY[1] - 0.5
        row = min(max((0.5 - elevation / np.pi) * SKY[0] - 0.5, 0.0), SKY[0] - 1.0)
        left, top = int(np.floor(column)), min(int(row), SKY[0] - 2)
        across, down = np.float32(column - left), np.float32(row - top)
        upper, lower = (
            self.horizon[r, left % SKY[1]] * (1 - across)
            + self.horizon[r, (left + 1) % SKY[1]] * across
            for r in (top, top + 1)
        )
        return np.asarray(upper * (1 - down) + lower * down, np.float32)

    def entering(self, mu: NDArray[Any]) -> Float32:
        """Return the light entering the nodes at cosines `mu`, for radiance 1 over 1 steradian."""
        a, b, c = self.profile
        return np.where(self.eye, mu / np.float32(np.pi), mu * (a + mu * (b + mu * c)))

    def open_to(self, lamp: Lamp, azimuth: float) -> Float32:
        """Return the fraction of a lamp that each node in the left half sees, (N,) float32.

        Args:
            azimuth: Azimuth of the lamp relative to the direction the sitter faces, in radians.
        """
        wide = np.float32(max(2 * lamp.radius / (np.pi / SKY[0]) * SPREAD, 1.0))
        return np.asarray(np.clip(0.5 + self.visibility(azimuth, lamp.elevation) / wide, 0, 1))

    @property
    def counts(self) -> tuple[int, ...]:
        """The numbers of nodes, small patches and large patches."""
        return len(self.normals), *(len(starts) for _, starts, _ in self.patch_shares)

    @cached_property
    def patch_shares(self) -> tuple[tuple[Indices, Indices, Float32], ...]:
        """The nodes sorted by patch, each patch's first entry, and 1 / its size, by patch size."""
        out = []
        for label in self.patches.T:
            order = np.argsort(label, kind="stable")
            starts = np.flatnonzero(np.diff(label[order], prepend=-1))
            size = np.diff(np.append(starts, len(order)))
            out.append((order, starts, (1 / size).astype(np.float32)[:, None]))
        return tuple(out)


@dataclass(frozen=True, eq=False)
class SeenNodes:
    """The nodes that samples require, as seen by the camera.

    Attributes:
        index: (M,) intp. Indices into all nodes or, from the side, into all nodes and all mirrored
            nodes.
        normals: (M, 3) float32. Surface normals.
        view: (M, 3) float32. Unit vectors towards the camera.
        gain, way: (M,), (M, 3) float32. Fraction of even light that the surface reflects towards
            the camera, and the direction from which this light comes.
        eye: (M,) bool. True for the nodes on the eyes.
        passes: (M, 3) float32. The skin's light towards this camera, divided by that towards the
            bake's camera.
    """

    index: Indices = field(repr=False)
    normals: Float32 = field(repr=False)
    view: Float32 = field(repr=False)
    gain: Float32 = field(repr=False)
    way: Float32 = field(repr=False)
    eye: Bools = field(repr=False)
    passes: Float32 = field(repr=False)

    @cached_property
    def straight(self) -> Float32:
        """The cosine between each normal and the direction to the camera, (M,) float32."""
        return np.asarray((self.normals * self.view).sum(axis=1))

    def only(self, some: Indices) -> SeenNodes:
        """Return a subset of the nodes."""
        return SeenNodes(*(getattr(self, one.name)[some] for one in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class Wide:
    """A head's samples in the layout used for shading, with six floats each for both halves.

    From the side, there are three floats and a single position.

    Attributes:
        corners, weights: (3, S), (3, S, 6). The nodes around each sample, and their weights.
        albedo, detail: (S, 6) float32. As in `PortraitHead`.
        single, four: (2, n) intp. Flat positions in the picture of the pixels with one sample and
            of those with four.
    """

    corners: Indices = field(repr=False)
    weights: Float32 = field(repr=False)
    albedo: Float32 = field(repr=False)
    detail: Float32 = field(repr=False)
    single: Indices = field(repr=False)
    four: Indices = field(repr=False)


@dataclass(frozen=True, eq=False)
class PortraitHead:
    """A head as seen by the portrait's camera.

    Attributes:
        inside, edge: (rows, half) bool. The pixels with one sample and those with four samples.
        three, weights: (S, 3). The visible nodes around each sample, and their weights.
        albedo: (S, 3) float32. Colour of each sample relative to that of the skin.
        detail: (S,) float32. Reflection of a sample relative to that of its nodes, for pores and
            lips.
        glass: (G,) intp. The samples on the eyes.
        glass_gain, glass_way: (G,), (G, 3) float32. Reflection of these samples, as in `SeenNodes`.
        hair: The hair, or None for a bald head without details.
        yaw_deg: Turn of the face towards the sitter's left, in degrees. If the yaw is not 0, "half"
            refers to the whole picture. If the yaw is negative, both light and picture are
            mirrored.
    """

    nodes: SkinNodes = field(repr=False)
    visible: SeenNodes = field(repr=False)
    inside: Bools = field(repr=False)
    edge: Bools = field(repr=False)
    three: Indices = field(repr=False)
    weights: Float32 = field(repr=False)
    albedo: Float32 = field(repr=False)
    detail: Float32 = field(repr=False)
    glass: Indices = field(repr=False)
    glass_gain: Float32 = field(repr=False)
    glass_way: Float32 = field(repr=False)
    hair: Hair | None = None
    yaw_deg: float = 0.0

    @property
    def halves(self) -> tuple[int, ...]:
        """The halves that the samples represent: 1 for the light as is, -1 for mirrored light."""
        return (1, -1) if not self.yaw_deg else (1,) if self.yaw_deg > 0 else (-1,)

    @cached_property
    def lit_nodes(self) -> tuple[Indices, Indices]:
        """Nodes of one half with visible skin, (L,), and each visible node's index in 2 L, (M,)."""
        half, node = np.divmod(self.visible.index, len(self.nodes.normals))
        node_ids, row = np.unique(node, return_inverse=True)
        return node_ids, row + half * len(node_ids)

    def dressed(self, hair: Hair) -> PortraitHead:
        """Return the head with the given hair."""
        nodes = replace(self.nodes, horizon=self.nodes.horizon + hair.shade)
        visible = replace(self.visible, gain=np.where(self.visible.eye, np.float32(0), hair.gain))
        # The shade is already in the nodes, so do not keep it twice: a view would keep the whole
        # array.
        dressed_hair = replace(hair, shade=hair.shade[:0].copy())
        return replace(
            self, hair=dressed_hair, nodes=nodes, visible=visible, glass_gain=hair.glass_gain
        )

    def plain(self) -> PortraitHead:
        """Return the head without hair or pores, in a single colour."""
        return replace(self, albedo=np.ones_like(self.albedo), detail=np.ones_like(self.detail))

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns of the whole picture."""
        return self.inside.shape[0], len(self.halves) * self.inside.shape[1]

    @cached_property
    def halved(self) -> PortraitHead:
        """The head for pictures of half the size, with every second pixel, as for side views."""
        if self.yaw_deg:
            return self
        hair = None if self.hair is None else self.hair.halved(self.inside.shape[1])
        head = self._of(self.inside[::2, ::2], self.edge[::2, ::2], self._first[::2, ::2])
        return replace(head, hair=hair)

    @cached_property
    def close(self) -> PortraitHead:
        """The head as in `halved`, for thumbnails in which neck and shoulders remain black."""
        head, (rows, half) = self.halved, self.halved.inside.shape
        mask = np.zeros((rows, half), bool)
        beside = round((1 - CLOSE_COLUMNS) * half / (3 - len(self.halves)))
        mask[: round(CLOSE_ROWS * rows), beside : half - beside if self.yaw_deg else half] = True
        hair = None if head.hair is None else head.hair.within(mask)
        return replace(head._of(head.inside & mask, head.edge & mask, head._first), hair=hair)

    @cached_property
    def _first(self) -> Indices:
        """Index of the first sample of each pixel, (rows, half) intp."""
        single = int(self.inside.sum())
        first = np.zeros(self.inside.shape, np.intp)
        first[self.inside] = np.arange(single)
        first[self.edge] = single + 4 * np.arange(int(self.edge.sum()))
        return first

    def _of(self, inside: Bools, edge: Bools, first: Indices) -> PortraitHead:
        """Return a subset of the pixels and the nodes that they need, given `_first`."""
        four = first[edge][:, None] + np.arange(4)
        samples = np.concatenate([first[inside], four.ravel()])
        place = np.full(len(self.three), -1)
        place[samples] = np.arange(len(samples))
        rows = place[self.glass] >= 0
        ids, three = np.unique(self.three[samples], return_inverse=True)
        return replace(
            self,
            visible=self.visible.only(ids),
            inside=inside,
            edge=edge,
            three=three.reshape(-1, 3),
            weights=self.weights[samples],
            albedo=self.albedo[samples],
            detail=self.detail[samples],
            glass=place[self.glass][rows],
            glass_gain=self.glass_gain[rows],
            glass_way=self.glass_way[rows],
        )

    @cached_property
    def wide(self) -> Wide:
        """The arrays in the layout used for shading."""
        wide = 3 * len(self.halves)
        places = (self._both(np.flatnonzero(where)) for where in (self.inside, self.edge))
        return Wide(
            np.ascontiguousarray(self.three.T),
            np.stack([np.repeat(weight[:, None], wide, axis=1) for weight in self.weights.T]),
            np.tile(self.albedo, len(self.halves)),
            np.repeat(self.detail[:, None], wide, axis=1),
            *places,
        )

    @cached_property
    def combed(self) -> tuple[Indices, Float32, Float32]:
        """The hair's flat positions, (2, Q), its transmittance, (Q, 3), and its colour, (Q, 6)."""
        assert self.hair is not None
        keep = 1 - self.hair.cover
        if self.yaw_deg:
            # At the face's edge, the hair's remainder of a pixel is the face, then the background.
            keep = keep / np.maximum(self._bald.flat[self.hair.pixel], keep + np.float32(1e-6))
        keep = np.repeat(keep[:, None], 3, axis=1)
        return self._both(self.hair.pixel), keep, np.tile(self.hair.colour, len(self.halves))

    def _both(self, left: Indices) -> Indices:
        """Return the flat positions in the picture for the left half and for its mirror image."""
        columns = self.shape[1]
        row, column = np.divmod(left, self.inside.shape[1])
        places = [column if side > 0 else columns - 1 - column for side in self.halves]
        return np.asarray(row * columns + np.stack(places))

    @cached_property
    def pixels(self) -> Indices:
        """Flat position of each sample in the left half, (S,)."""
        edge = np.repeat(np.flatnonzero(self.edge), 4)
        return np.concatenate([np.flatnonzero(self.inside), edge])

    @cached_property
    def _bald(self) -> Float32:
        """Fraction of each pixel that would show the head without hair, (rows, half) float32."""
        coverage: Float32 = np.asarray(self.weights.any(axis=1), np.float32)
        left = np.zeros(self.inside.shape, np.float32)
        single = int(self.inside.sum())
        left[self.inside] = coverage[:single]
        left[self.edge] = coverage[single:].reshape(-1, 4).mean(axis=1)
        return left

    @cached_property
    def coverage(self) -> Float32:
        """Fraction of each pixel that shows the head, (rows, columns) float32."""
        left = self._bald.copy()
        if self.hair is not None:
            bald, hair = left.flat[self.hair.pixel], self.hair.cover
            both = np.minimum(bald + hair, 1) if self.yaw_deg else 1 - (1 - bald) * (1 - hair)
            left.flat[self.hair.pixel] = both
        return np.concatenate([left[:, ::side] for side in self.halves], axis=1)


def directions(azimuth: Float64, elevation: Float64) -> Float32:
    """Return unit vectors, (n, 3) float32, in the sitter's frame for directions in radians."""
    level = np.cos(elevation)
    parts = [-np.sin(azimuth) * level, np.sin(elevation), np.cos(azimuth) * level]
    return np.stack(parts, axis=-1).astype(np.float32)


@lru_cache(maxsize=1)
def cell_ways() -> Float32:
    """Return the unit vectors to the centres of the soft light's cells, (G, 3) float32."""
    row, azimuth, _, _ = grid()
    return directions(azimuth, np.pi / 2 - (row + 0.5) * np.pi / ROWS)


@dataclass(frozen=True, eq=False)
class PortraitSkin:
    """The transport of light inside the skin, from entry to exit.

    Attributes:
        source: (K, M) intp. Sources of each visible node. They are numbered first through the left
            half and then through the right half, each with its nodes, small patches and large
            patches.
        share: (K, M, 3) float32. Fraction of the light entering at the source that leaves at the
            node.
    """

    source: Indices = field(repr=False)
    share: Float32 = field(repr=False)

    @cached_property
    def shares(self) -> Float32:
        """`share` for both halves, (K, M, 6) float32."""
        return np.concatenate([self.share, self.share], axis=2)

    def fits(self, nodes: SkinNodes, visible_count: int) -> bool:
        """Return whether the data fit the number of visible nodes and the number of all nodes."""
        return (
            self.share.shape == (*self.source.shape, 3)
            and self.source.shape[1] == visible_count
            and int(self.source.max()) < 2 * sum(nodes.counts)
        )

    def only(self, head: PortraitHead) -> PortraitSkin:
        """Return the part of the data for the nodes that are visible in a head's picture."""
        if len(head.lit_nodes[0]) == self.source.shape[1]:
            return self
        return _part(self, head)


@lru_cache(maxsize=4)
def _part(skin: PortraitSkin, head: PortraitHead) -> PortraitSkin:
    # Use `take`, since an index would leave the arrays in a slow memory order.
    source = np.take(skin.source, head.lit_nodes[0], axis=1)
    return PortraitSkin(source, np.take(skin.share, head.lit_nodes[0], axis=1))
