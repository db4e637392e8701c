"""The whole evaluation: sizes, peaks, attainable styles, heads and skins, probe positions."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.base.colour import luminance
from app.core.base.errors import TransportError
from app.core.environment.environment import reduce_radiance
from app.core.solver.turn_choice import OBJECTIVES
from benchmarks.answers.evaluation.differences import Best, Change, best_turns, change
from benchmarks.answers.evaluation.heads import Spread, from_best, from_results, solved, spread
from benchmarks.answers.evaluation.lens import LensGains, lens_gains
from benchmarks.answers.evaluation.tables import styles_digest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.core.base.progress import PhraseReport, Progress, Token
    from app.core.solver.lens.view_tables import ViewTables
    from app.core.solver.style_result import StyleResult
    from app.core.solver.turn_choice import Objective
    from app.core.styles.style import Style
    from app.core.styles.style_pack import StylePack
    from benchmarks.answers.evaluation.offsets import Offsets
    from benchmarks.answers.evaluation.scenes import Scene
    from benchmarks.answers.evaluation.tables import Tables


Floats: TypeAlias = NDArray[np.floating[Any]]


def quality_at_turns(targets: Floats, light: Floats, turns: int = TURNS) -> Float64:
    """Return C of every target at turns 0, 360 / `turns` ... deg.

    Args:
        targets: (S, H, W) float. Pre-integrated targets F (eq. 3), panorama coordinates at turn 0.
        light: (H, W) float. Luminance of the environment at turn 0.
        turns: Number of turns. Environments with more columns are shifted by several; those with
            fewer are interpolated between their columns (band-limited, like the refined turn).

    Returns:
        (S, turns) float64. In the unit of `light`.

    Examples:
        >>> F = np.zeros((1, 2, 4)); F[0, 0, 1] = 1
        >>> L = np.zeros((2, 4)); L[0, 3] = 5
        >>> quality_at_turns(F, L, 4).round(6).tolist()
        [[0.0, 0.0, 5.0, 0.0]]
    """
    width = light.shape[1]
    forward = np.fft.rfft(np.asarray(targets, np.float64), axis=2)
    seen = np.fft.rfft(np.asarray(light, np.float64), axis=1)
    spectrum = (np.conj(forward) * seen).sum(axis=1)
    if turns > width:
        # The last frequency represents both ends of the spectrum, which are separate from here on.
        spectrum[:, -1] *= 0.5
        between: Float64 = np.fft.irfft(spectrum, turns, axis=1) * (turns / width)
        return between
    every: Float64 = np.fft.irfft(spectrum, width, axis=1)[:, :: width // turns]
    return every


def block_sums(targets: Floats, shape: tuple[int, int]) -> Float64:
    """Return pre-integrated targets for an environment with fewer texels.

    T contains the texels' solid angle, so the column of a larger texel is the sum of those in it.

    Args:
        targets: (..., H, W) float. F of eq. 3.
        shape: Rows and columns of the result; H and W must be whole multiples of them.

    Returns:
        (..., rows, columns) float64.
    """
    rows, columns = shape
    height, width = targets.shape[-2:]
    blocks = np.asarray(targets, np.float64).reshape(
        *targets.shape[:-2], rows, height // rows, columns, width // columns
    )
    result: Float64 = blocks.sum(axis=(-3, -1))
    return result


Float64: TypeAlias = NDArray[np.float64]

GENERIC: Final = "generic"
ENVIRONMENTS: Final = ((16, 32), (32, 64), (64, 128))
PICTURES: Final = (50, 100, 200)
_OWN_ENVIRONMENT: Final = (32, 64)
_OWN_PICTURE: Final = 100


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """Results of one panorama size, compared with the largest.

    Attributes:
        own_steps: The same with turns in whole texels of each size (32, 64 or 128 turns); None for
            pictures.
        curves: (N, 64) float64. Quality at the turns of the grid.
    """

    name: str
    change: Change
    own_steps: float | None
    curves: Float64 = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Widths:
    """Widths of the best peaks.

    Attributes:
        all_deg: (N,) float64. Widths of all pairs, deg.
        attainable: (N,) bool.
    """

    all_deg: Float64 = field(repr=False)
    attainable: NDArray[np.bool_] = field(repr=False)

    def mean(self, *, attainable: bool = False) -> tuple[float, float]:
        """Return mean and standard deviation, deg, of all pairs or of the attainable ones."""
        kept = self.all_deg[self.attainable] if attainable else self.all_deg
        return (float(kept.mean()), float(kept.std())) if kept.size else (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """Effect of a probe beside the spot on the best turn.

    Attributes:
        spot: (K,) int32. Spot of each place beside one.
        feet, bearing_deg: (K,) float32.
        degrees, regret: (K, S) float64. Angle between the best turns (deg), and the loss of the
            other turn at the spot.
        tied: (K, S) bool. Pairs whose two best peaks at the spot are nearly equal.
    """

    spots: tuple[str, ...]
    spot: NDArray[np.int32]
    feet: NDArray[np.float32]
    bearing_deg: NDArray[np.float32]
    degrees: Float64 = field(repr=False)
    regret: Float64 = field(repr=False)
    tied: NDArray[np.bool_] = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """All results."""

    scenes: tuple[str, ...]
    styles: tuple[Style, ...]
    objective: Objective
    lighting: tuple[Row, ...]
    pictures: tuple[Row, ...]
    widths: dict[str, Widths]
    results: tuple[tuple[StyleResult, ...], ...] = field(repr=False)
    spreads: dict[str, Spread]
    moved: Moved | None
    lens: LensGains | None = None
    notes: tuple[str, ...] = ()

    @property
    def pairs(self) -> int:
        """Number of (scene, style) pairs."""
        return len(self.scenes) * len(self.styles)


def evaluate(
    scenes: Sequence[Scene],
    packs: Mapping[str, StylePack],
    tables: Tables,
    offsets: Offsets | None,
    *,
    objective: Objective,
    views: Sequence[ViewTables] = (),
    report: PhraseReport,
    token: Token,
) -> Evaluation:
    """Evaluate the paper's styles in some scenes.

    Args:
        views: Views of the generic head, for the gain of other yaws.

    Raises:
        TransportError: If the tables and the packs have different styles.
        Cancelled: If the token was cancelled.
    """
    generic = packs[GENERIC]
    _check(generic, tables)
    styles = tuple(style for style in generic.styles if style.paper)
    rows = [tables.styles.index(style.name) for style in styles]
    tables = _only(tables, rows)

    def step(share: float, words: Progress | str) -> None:
        token.check()
        report(share, words)

    step(0.0, "Comparing sizes")
    grey = [luminance(scene.light).astype(np.float64) for scene in scenes]
    lighting = _lighting(tables.picture(_OWN_PICTURE), grey)
    pictures = _pictures(tables, grey)
    step(0.3, "Solving for every head")
    lights = [reduce_radiance(scene.light, _OWN_ENVIRONMENT) for scene in scenes]
    names = [style.name for style in styles]
    answers, heads = _answers(packs, lights, names, step)
    step(0.9, "Comparing heads and places")
    small = [_grey(light, _OWN_ENVIRONMENT) for light in grey]
    reached = _reached(answers["paper"])
    return Evaluation(
        scenes=tuple(scene.name for scene in scenes),
        styles=styles,
        objective=objective,
        lighting=lighting,
        pictures=pictures,
        widths=_widths(answers),
        results=answers[objective],
        spreads={
            "picture": _spread_by_match(heads),
            "paper": _spread_by_quality(packs, tables, small, reached),
        },
        moved=None if offsets is None else _moved(offsets, tables),
        lens=lens_gains(generic, views, lights, names) if views else None,
    )


_Answered: TypeAlias = "dict[str, tuple[tuple[StyleResult, ...], ...]]"


def _check(generic: StylePack, tables: Tables) -> None:
    known = {style.name: style for style in generic.styles}
    fits = all(name in known for name in tables.styles)
    fits = fits and styles_digest([known[n] for n in tables.styles]) == tables.styles_sha256
    fits = fits and all(style.name in tables.styles for style in generic.styles if style.paper)
    fits = fits and set(PICTURES) <= set(tables.pictures)
    fits = fits and tables.sizes.shape[2:] == ENVIRONMENTS[-1]
    if not fits:
        raise TransportError(
            "The tables of evaluation belong to other styles.",
            "Make them again with 'turnlight evaluate --bake'.",
        )


def _only(tables: Tables, rows: Sequence[int]) -> Tables:
    """Keep some styles."""
    return replace(
        tables,
        styles=tuple(tables.styles[row] for row in rows),
        sizes=tables.sizes[:, rows],
        heads={name: f[rows] for name, f in tables.heads.items()},
    )


def _lighting(targets: NDArray[Any], grey: Sequence[Float64]) -> tuple[Row, ...]:
    """Compare best turns by size of the environment with the largest."""
    bests, fine = [], []
    for shape in ENVIRONMENTS:
        table = block_sums(targets, shape)
        lights = [_grey(light, shape) for light in grey]
        bests.append(best_turns(_curves(table, lights)))
        fine.append(_peaks(table, lights, shape[1]))
    reference = bests[-1]
    clear = ~change(reference, reference).tied
    return tuple(
        Row(
            name=f"{shape[1]} × {shape[0]}",
            change=change(reference, best),
            own_steps=float(_apart(own - fine[-1])[clear].mean()) if clear.any() else 0.0,
            curves=best.curves,
        )
        for shape, best, own in zip(ENVIRONMENTS, bests, fine, strict=True)
    )


def _pictures(tables: Tables, grey: Sequence[Float64]) -> tuple[Row, ...]:
    """Compare best turns by size of the picture with the largest."""
    lights = [_grey(light, _OWN_ENVIRONMENT) for light in grey]
    bests = [
        best_turns(_curves(block_sums(tables.picture(size), _OWN_ENVIRONMENT), lights))
        for size in PICTURES
    ]
    return tuple(
        Row(f"{size} × {size}", change(bests[-1], best), None, best.curves)
        for size, best in zip(PICTURES, bests, strict=True)
    )


def _curves(table: NDArray[Any], lights: Sequence[Float64]) -> Float64:
    """Return the quality of all pairs, scene by scene, (N, 64)."""
    return np.concatenate([quality_at_turns(table, light) for light in lights])


def _peaks(table: NDArray[Any], lights: Sequence[Float64], turns: int) -> Float64:
    """Return the best turn of each pair among a size's own turns by whole texels, deg."""
    found = [quality_at_turns(table, light, turns).argmax(axis=1) for light in lights]
    return np.concatenate(found) * (360.0 / turns)


def _grey(light: Float64, shape: tuple[int, int]) -> Float64:
    small = reduce_radiance(light[..., None].astype(np.float32), shape)[..., 0]
    return np.asarray(small, np.float64)


def _answers(
    packs: Mapping[str, StylePack],
    lights: Sequence[NDArray[Any]],
    styles: Sequence[str],
    step: PhraseReport,
) -> tuple[_Answered, _Answered]:
    """Return answers of the generic head by both objectives, and of all heads by match."""
    generic = {name: solved(packs[GENERIC], lights, name, styles) for name in OBJECTIVES}
    heads = {GENERIC: generic["picture"]}
    for number, (name, pack) in enumerate(packs.items()):
        step(0.4 + 0.5 * number / len(packs), "Solving for every head")
        if name != GENERIC:
            heads[name] = solved(pack, lights, "picture", styles)
    return {str(name): found for name, found in generic.items()}, heads


def _widths(generic: _Answered) -> dict[str, Widths]:
    widths = {}
    for objective, found in generic.items():
        arcs = np.array([[one.arc_deg for one in row] for row in found]).reshape(-1, 2)
        wide = (arcs[:, 1] - arcs[:, 0]) % 360.0
        wide[(arcs == (-180.0, 180.0)).all(axis=1)] = 360.0
        widths[objective] = Widths(wide, _reached(found).ravel())
    return widths


def _reached(found: Sequence[Sequence[StyleResult]]) -> NDArray[np.bool_]:
    return np.array([[one.attainable for one in row] for row in found], bool)


def _spread_by_match(heads: _Answered) -> Spread:
    own = {name: from_results(found) for name, found in heads.items()}
    return spread(own.pop(GENERIC), own)


def _spread_by_quality(
    packs: Mapping[str, StylePack],
    tables: Tables,
    lights: Sequence[Float64],
    attainable: NDArray[np.bool_],
) -> Spread:
    """Compare all heads with the generic one by their F alone, for grey light."""
    known = {
        name: pack.preintegrated[[pack.index(style) for style in tables.styles]]
        for name, pack in packs.items()
    }
    own = {
        name: from_best(best_turns(_curves(table, lights)), len(lights), attainable)
        for name, table in (known | tables.heads).items()
    }
    return spread(own.pop(GENERIC), own)


def _moved(offsets: Offsets, tables: Tables) -> Moved:
    """Compare the best turns beside each spot with those at the spot."""
    table = block_sums(tables.picture(_OWN_PICTURE), _OWN_ENVIRONMENT)
    grey = [np.asarray(luminance(light), np.float64) for light in offsets.light]
    bests = [best_turns(quality_at_turns(table, _grey(light, _OWN_ENVIRONMENT))) for light in grey]
    centres = {int(offsets.spot[k]): bests[k] for k in np.flatnonzero(offsets.feet == 0)}
    beside = np.flatnonzero(offsets.feet > 0)
    found = [_change_of(centres[int(offsets.spot[k])], bests[k]) for k in beside]
    return Moved(
        spots=offsets.spots,
        spot=offsets.spot[beside],
        feet=offsets.feet[beside],
        bearing_deg=offsets.bearing_deg[beside],
        degrees=np.array([one.degrees for one in found]),
        regret=np.array([one.regret for one in found]),
        tied=np.array([one.tied for one in found]),
    )


def _change_of(centre: Best, other: Best) -> Change:
    return change(centre, other)


def _apart(degrees: Float64) -> Float64:
    wrapped: Float64 = np.abs((degrees + 180.0) % 360.0 - 180.0)
    return wrapped
