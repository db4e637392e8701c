"""Time pictures: pre-integration, one picture of a turn, and the whole gallery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.environment.environment import from_radiance
from app.core.portrait.gallery_portraits import framing, portraits
from app.core.solver.place_light import pictures_at, prepare, turned
from app.core.solver.solve import solve_all
from app.core.solver.transport import render, to_image
from app.core.solver.weights import paint, painted, target_weights
from benchmarks.speed.plain_portrait import portrait
from benchmarks.speed.plain_search import matrix, preintegrate
from benchmarks.speed.timing.runner.rows import Case
from benchmarks.speed.timing.search import lively

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.core.solver.place_light import PlaceLight
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack
    from benchmarks.speed.timing.runner.rows import PeerCase

Float32: TypeAlias = NDArray[np.float32]

_STROKE: Final = 200  # pixels that one stroke changes
_CARD: Final = (136, 188)  # pixels of a card's picture on a dense screen
_PANORAMA: Final = (256, 512)


def picture_cases(transport: Transport, peers: tuple[PeerCase, ...] = ()) -> Iterator[Case]:
    """Yield pre-integration, whole and after a stroke, and the picture of one turn."""
    radiance = lively(transport.environment_shape)
    luminance = render(transport, radiance.mean(axis=2))
    weights = target_weights(luminance, transport.face).astype(np.float32)
    full = matrix(transport)
    before = painted(transport, weights)
    stroke = np.flatnonzero(transport.face)[:_STROKE]
    values = np.linspace(0, 1, len(stroke))
    basis = transport.luminance_basis
    texels = transport.texel_basis.nbytes
    yield Case(
        "preintegrate.full",
        lambda: preintegrate(transport, weights),
        lambda: weights @ full,
        "f @ T, full matrix",
        basis.nbytes + texels,
    )
    yield Case(
        "preintegrate.stroke",
        lambda: paint(transport, before, stroke, values).preintegrated(transport),
        lambda: weights @ full,
        "f @ T, full matrix",
        stroke.size * basis.itemsize * basis.shape[1] + texels,
    )
    channels = [matrix(transport, c) for c in range(3)]
    flat = np.ascontiguousarray(radiance.reshape(-1, 3).T)
    yield Case(
        "render.rgb",
        lambda: render(transport, radiance),
        lambda: [channels[c] @ flat[c] for c in range(3)],
        "T @ L per channel, full matrix",
        transport.pixel_basis.nbytes + texels,
        peers=peers,
    )


def gallery_case(transport: Transport, pack: StylePack) -> Case:
    """Return the case of all card pictures: every style at its own turn, framed and exposed.

    Returns:
        ``gallery.all``: the pictures that appear once a place is solved.
    """
    light = prepare(from_radiance(lively(_PANORAMA), "lively"))
    turns = [one.turn_refined_deg for one in solve_all(pack, light.searched)]
    coverage = pack.coverage.astype(np.float32)
    wanted = framing(transport.size, _CARD)
    channels = [matrix(transport, c) for c in range(3)]

    def fast() -> object:
        return portraits(pictures_at(transport, light, turns), coverage, wanted)

    def plain() -> object:
        return [_portrait(transport, channels, light, turn, coverage) for turn in turns]

    return Case(
        "gallery.all",
        fast,
        plain,
        "per style: T @ L, full matrix; develop, encode, scale",
        transport.pixel_basis.nbytes
        + transport.texel_basis.nbytes
        + len(turns) * 3 * (4 * transport.size**2 + _CARD[0] * _CARD[1]),
        most=20,
    )


def _portrait(
    transport: Transport, channels: list[Float32], light: PlaceLight, turn: float, coverage: Float32
) -> Float32:
    flat = turned(light, turn, transport.environment_shape).reshape(-1, 3).T
    values = np.stack([channels[c] @ np.ascontiguousarray(flat[c]) for c in range(3)], axis=1)
    return portrait(to_image(transport, values), coverage, _CARD)
