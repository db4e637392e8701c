"""Time the search for the best turn: curves, and whole answers by both objectives."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.solver.search import SearchTables, build_tables, curves, quality_curves
from app.core.solver.solve import measure, solve_all
from benchmarks.speed.timing.runner.rows import Case

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack

Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]


def lively(shape: tuple[int, int]) -> Float32:
    """Return a detailed environment; no timing depends on its content.

    Args:
        shape: Rows and columns.

    Returns:
        (H, W, 3) float32. Linear Rec. 709 radiance.
    """
    rng = np.random.default_rng(2019)
    return np.exp(1.5 * rng.standard_normal((*shape, 3))).astype(np.float32)


def search_cases(transport: Transport, pack: StylePack) -> Iterator[Case]:
    """Yield the search of all styles at all turns.

    Yields:
        ``solve.quality`` and ``solve.match`` (curves, the latter with grades),
        ``solve.match.product``
        (match alone, against one large product), ``solve.paper`` and ``answers.all`` (whole
        answers:
        turns, arcs, peaks, reasons).
    """
    radiance = lively(pack.header.environment)
    light = radiance.mean(axis=2)
    tables, targets = pack.tables, pack.preintegrated
    seen = pack.project(light)
    root = np.sqrt(pack.region_on(transport)).astype(np.float32)
    face = root > 0
    pixels, root = transport.pixels[face], root[face]
    size = pack.header.picture**2
    weights = np.asarray(transport.header.luminance_weights, np.float32)
    flat = pack.targets.reshape(len(pack.styles), size, 3).astype(np.float32)
    pictures = (flat @ weights)[:, pixels]
    full = transport.luminance_basis[face] @ transport.texel_basis
    out = 8 * TURNS * len(pack.styles)
    plain_tables = build_tables(
        pack.target_rows,
        pack.mean_rows,
        pack.basis_even,
        pack.basis_odd,
        paired=pack.header.paired,
        others=pack.face_rows,
    )
    yield Case(
        "solve.quality",
        lambda: quality_curves(tables, seen),
        lambda: plain_quality(targets, light),
        "per style and turn: roll, dot",
        tables.targets.nbytes + seen.nbytes + out,
    )
    touched = tables.targets.nbytes + tables.basis.nbytes + seen.nbytes + 3 * out
    yield Case(
        "solve.match",
        lambda: measure(pack, curves(tables, seen)),
        lambda: plain_match(full, pictures, root, light),
        "64 products T @ L, np.cov",
        touched,
    )
    yield Case(
        "solve.match.product",
        lambda: match_alone(pack, plain_tables, seen),
        lambda: product_match(full, pictures, root, light),
        "one product T @ L for 64 turns",
        touched,
    )
    yield Case(
        "solve.paper",
        lambda: solve_all(pack, radiance, "paper"),
        lambda: plain_quality(targets, light).argmax(axis=1),
        "per style and turn: roll, dot; best turn",
        touched,
    )
    yield Case(
        "answers.all",
        lambda: solve_all(pack, radiance, "picture"),
        lambda: plain_match(full, pictures, root, light).argmax(axis=1),
        "64 products T @ L, np.cov; best turn",
        touched,
    )


def match_alone(pack: StylePack, tables: SearchTables, seen: Float64) -> Float64:
    """Return the match of every style at all turns, without the areas for grades."""
    found = curves(tables, seen)
    return 100.0 * found.others / (pack.weight_norm[:, None] * found.contrast)


def plain_quality(targets: Float32, light: Float32, step: int = 1) -> Float64:
    """Evaluate eq. 5 literally: every style and turn, roll (by `step` texels) and dot."""
    quality = np.empty((len(targets), TURNS))
    for style, target in enumerate(targets):
        for turn in range(TURNS):
            turned = np.roll(light, -step * turn, axis=1)
            quality[style, turn] = np.dot(target.ravel(), turned.ravel())
    return quality


def plain_match(full: Float32, pictures: Float32, root: Float32, light: Float32) -> Float64:
    """Return the match of every style from 64 pictures, each rendered with the full matrix."""
    match = np.empty((len(pictures), TURNS))
    for turn in range(TURNS):
        face = full @ np.roll(light, -turn, axis=1).ravel()
        for style, target in enumerate(pictures):
            table = np.cov(target, face, aweights=root**2)
            match[style, turn] = 100 * table[0, 1] / np.sqrt(table[0, 0] * table[1, 1])
    return match


def product_match(full: Float32, pictures: Float32, root: Float32, light: Float32) -> Float32:
    """Return the match of every style from one product of the full matrix with all turns."""
    turned = np.stack([np.roll(light, -turn, axis=1).ravel() for turn in range(TURNS)], axis=1)
    faces = full @ turned
    share = root**2 / np.sum(root**2)
    faces = root[:, None] * (faces - share @ faces)
    wishes = root * (pictures - (pictures @ share)[:, None])
    wishes /= np.linalg.norm(wishes, axis=1, keepdims=True)
    match: Float32 = 100 * (wishes @ faces) / np.linalg.norm(faces, axis=0)
    return match
