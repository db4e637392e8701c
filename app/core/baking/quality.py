"""Quality levels of a bake."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quality:
    """Numbers of samples.

    Attributes:
        paths: Random walks from each pixel.
        glints: Points in each pixel at which the reflection of the surface is sampled.
        shadows: Shadow rays along each side of a texel.
        rank: Functions that the transport is compressed to.
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
