"""Quality levels of a bake."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quality:
    """Numbers of samples and functions at one quality level.

    Attributes:
        paths: Number of random walks from each pixel.
        glints: Number of points in each pixel at which the reflection from the surface is sampled.
        shadows: Number of shadow rays along each side of a texel.
        rank: Number of functions into which the transport is compressed.
    """

    paths: int
    glints: int
    shadows: int
    rank: int


QUALITIES: dict[str, Quality] = {
    "draft": Quality(paths=512, glints=16, shadows=2, rank=192),
    "quick": Quality(paths=4096, glints=64, shadows=3, rank=256),
    "good": Quality(paths=16384, glints=256, shadows=4, rank=336),
    "best": Quality(paths=65536, glints=512, shadows=6, rank=400),
}
