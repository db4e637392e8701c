"""Time the search for the lens position: curves of all yaws, and whole answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.solver.face import region_in_view
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.lens.view_tables import match_curves, view_tables
from app.core.solver.search import curves
from app.core.solver.solve import measure
from benchmarks.speed.timing.runner.rows import Case
from benchmarks.speed.timing.search import lively, plain_match

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.core.portrait.head_views import HeadViews
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
Plain: TypeAlias = tuple[Float32, Float32, Float32]


def lens_cases(transport: Transport, pack: StylePack, views: HeadViews) -> Iterator[Case]:
    """Yield the search of all styles at all turns and yaws.

    Yields:
        ``solve.match.yaw`` (curves of all yaws, including the spectra of the light and the grades)
        and ``answers.yaw`` (whole answers, the best of all yaws for each style).
    """
    radiance = lively(pack.header.environment)
    light = radiance.mean(axis=2)
    tables = [view_tables(pack, views.at(yaw, pack.styles), views.shape) for yaw in views.parts]
    seen = pack.project(light)
    plain = plain_views(transport, pack, views)
    every = [pack.tables, *(one.tables for one in tables)]
    touched = sum(one.targets.nbytes + one.basis.nbytes for one in every) + seen.nbytes
    touched += 8 * TURNS * len(pack.styles) * len(views.yaws)

    def all_yaws() -> dict[float, tuple[Float64, Float64]]:
        return match_curves(pack, tables, seen, measure(pack, curves(pack.tables, seen)))

    yield Case(
        "solve.match.yaw",
        all_yaws,
        lambda: plain_yaws(plain, light),
        "per yaw: 64 products T @ L, np.cov",
        touched,
    )
    yield Case(
        "answers.yaw",
        lambda: solve_lens(pack, tables, radiance, LensWish("auto")),
        lambda: plain_yaws(plain, light).max(axis=0).argmax(axis=1),
        "per yaw: 64 products T @ L, np.cov; best turn",
        touched,
    )


def plain_views(transport: Transport, pack: StylePack, views: HeadViews) -> list[Plain]:
    """Return, for each yaw, the face's full matrix, its targets, and the region's root."""
    weights = np.asarray(transport.header.luminance_weights, np.float32)
    flat = pack.targets.reshape(len(pack.styles), -1, 3)[:, transport.pixels].astype(np.float32)
    front = transport, flat @ weights, pack.region_on(transport)
    found = []
    for yaw in views.yaws:
        seen, targets, region = front
        if yaw:
            view = views.at(yaw, pack.styles)
            region = region_in_view(view.transport, view.shape, views.shape)
            seen, targets = view.transport, view.targets
        face = region > 0
        full = seen.luminance_basis[face] @ seen.texel_basis
        found.append((full, targets[:, face], np.sqrt(region[face]).astype(np.float32)))
    return found


def plain_yaws(plain: list[Plain], light: Float32) -> Float64:
    """Return the match of every style with the lens straight in front and aside, (Y, S, 64)."""
    return np.stack([plain_match(full, targets, root, light) for full, targets, root in plain])
