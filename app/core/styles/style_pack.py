"""Style packs, which hold the pre-integrated styles of a head for solving without its transport.

A pack contains the pre-integrated targets F of eq. 3, the search basis for the match, and the
target pictures for display. It is created by `bake` next to the transport and loads in a few
milliseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.errors import StyleError
from app.core.solver.face import AREAS, AROUND
from app.core.solver.search import SearchTables, build_tables, seen_light
from app.core.solver.style_signature import Signatures
from app.core.solver.transport import Transport
from app.core.solver.weights import region_weights
from app.core.styles.lamps import AS_PUBLISHED, Studio
from app.core.styles.style import Style
from app.core.styles.styles import mirror_name
from app.core.text import tr

PACK_VERSION: Final = 5

Float16: TypeAlias = NDArray[np.float16]


@dataclass(frozen=True, slots=True)
class PackHeader:
    """Information about the origin of a pack.

    Attributes:
        environment: Shape (H, W) of the environments that the pack accepts.
        picture: Side of the target pictures, in pixels.
    """

    head: str
    skin: str
    environment: tuple[int, int]
    picture: int
    transport_sha256: str
    basis_error: float
    paired: bool = False
    format_version: int = PACK_VERSION


@dataclass(frozen=True)
class StylePack:
    """Pre-integrated styles for one head.

    Attributes:
        targets: (S, N, N, 3) float16. Linear Rec. 709 target pictures, as lit by the styles' own
            lamps, each with a maximum of 1.
        coverage: (N, N) float16. Fraction of each pixel that the head covers.
        region: (N, N) float16. Weight of each pixel of the face in the match and the strength.
        areas: (A, N, N) float16. The areas of signatures (see `app.core.solver.face.AREAS`).
        mixing, mixtures: (2, 3), (K, H) float64. How the search splits coloured light (see
            `app.core.solver.search.SearchColours`).
        target_rows: (S, Q, W) float32. F of eq. 3 over the whole head, as in the paper, in panorama
            coordinates at turn 0, for light as the search sees it.
        face_rows: (S, Q, W) float32. The same, but over the face region.
        area_rows: (A, Q, W) float32. Pre-integrated means of the areas.
        weight_norm: (S,) float64. Norm of the weights over the face region.
        mean_rows: (Q, W) float32. Pre-integrated mean luminance of the face region.
        basis_even, basis_odd: (E, Q, W / 2), (O, Q, W / 2) float32. Search basis for the face's
            contrast.
        studio_ratio: (S,) float64. C / mean over the face region in the target picture itself,
            which is the denominator of the strength.
        studios: Lamps that light the targets, one entry per style, or an empty tuple if all targets
            are lit as in the paper.
    """

    header: PackHeader
    styles: tuple[Style, ...]
    targets: Float16
    coverage: Float16
    region: Float16
    areas: Float16
    mixing: Float64
    mixtures: Float64
    target_rows: Float32
    face_rows: Float32
    area_rows: Float32
    weight_norm: Float64
    mean_rows: Float32
    basis_even: Float32
    basis_odd: Float32
    studio_ratio: Float64
    studios: tuple[Studio, ...] = ()

    @cached_property
    def tables(self) -> SearchTables:
        """The targets and the basis of the pack, transformed for the search."""
        return build_tables(
            self.target_rows,
            self.mean_rows,
            self.basis_even,
            self.basis_odd,
            paired=self.header.paired,
            others=np.concatenate([self.area_rows, self.face_rows]),
            around=range(len(AREAS))[AROUND].start,
        )

    @cached_property
    def signatures(self) -> Signatures:
        """The signatures of all styles."""
        return Signatures(tuple(style.signature for style in self.styles))

    @cached_property
    def rivals(self) -> tuple[tuple[list[int], list[int]], ...]:
        """Rivals that may explain each style's picture, with and without its mirror image.

        Styles that hardly light the face are compatible with any light on the face.
        """
        every = list(enumerate(self.styles))
        groups = []
        for row, style in every:
            alike = [n for n, s in every if s.signature.areas == style.signature.areas and n != row]
            twin = mirror_name(style.name)
            groups.append((alike, [n for n in alike if self.styles[n].name != twin]))
        return tuple(groups)

    @cached_property
    def rivalry(self) -> Bools:
        """(S, S) bool. Whether the style in a column may explain the picture in a row."""
        table = np.zeros((len(self.styles), len(self.styles)), bool)
        for row, (alike, _) in enumerate(self.rivals):
            table[row, alike] = True
        return table

    @property
    def preintegrated(self) -> Float32:
        """F of eq. 3 for grey light, (S, H, W) float32, in panorama coordinates at turn 0."""
        return self.target_rows[:, : self.header.environment[0]]

    def project(self, light: Floats) -> Float64:
        """Convert an environment to the rows that the search uses.

        Args:
            light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance at turn 0, or the luminance
                of grey light.

        Returns:
            (Q, W) float64. Rows for `app.core.solver.search.curves`, in the same units as `light`.
        """
        return seen_light(light, self.mixing, self.mixtures)

    def region_on(self, transport: Transport) -> Float64:
        """Return the weight of each head pixel in the match and the strength, (P,) float64."""
        return self.region.ravel()[transport.pixels].astype(np.float64)

    def weights_on(self, transport: Transport) -> Float64:
        """Compute the weights of all styles over the judged pixels, (S, P), from the targets."""
        flat = self.targets.reshape(len(self.styles), -1, 3)[:, transport.pixels]
        luminance = flat.astype(np.float64) @ np.asarray(transport.header.luminance_weights)
        region = self.region_on(transport)
        regions = (judged_region(style, transport, region) for style in self.styles)
        return np.stack([region_weights(*each) for each in zip(luminance, regions, strict=True)])

    def index(self, name: str) -> int:
        """Return the index of a style.

        Raises:
            StyleError: If the pack has no style with that name.
        """
        for position, style in enumerate(self.styles):
            if style.name == name:
                return position
        raise StyleError(
            tr(
                "The head {head!r} has no target for the style {name!r}.",
                head=self.header.head,
                name=name,
            )
        )

    def studio(self, name: str) -> Studio:
        """Return the lamps that light the target of a style."""
        return self.studios[self.index(name)] if self.studios else AS_PUBLISHED

    def target(self, name: str) -> Float32:
        """Return a style's target, (N, N, 3) float32 linear Rec. 709, with a maximum of 1."""
        return np.asarray(self.targets[self.index(name)].astype(np.float32))


def judged_region(style: Style, transport: Transport, region: Float64) -> Float64:
    """Return the weights, (P,), of the pixels by which a style is judged.

    These are the weights of the face region, or of the whole head if the style is judged by areas.
    """
    return transport.face.astype(np.float64) if style.signature.areas else region


def rounded(rows: Float32, digits: int = 17) -> Float32:
    """Round float32 values to the given number of binary digits to make files compress better."""
    last = 1 << (24 - digits)
    bits = np.ascontiguousarray(rows).view(np.uint32)
    return ((bits + np.uint32(last // 2)) & np.uint32(2**32 - last)).view(np.float32)
