"""The rule for the turn of a style, whether it is in reach, and why not.

By the picture objective the best grade goes before the best match: among the turns whose pictures
have the style's signature, or else come near it (`core.solver.style_signature`), the best match is
taken, whatever the match of turns of a lower grade. Where no turn comes near, the best match of all
is taken. A style is in reach where its grade at the turn offered is yes or nearly.

The turn offered is not the maximum itself but lies toward the middle of its tolerance arc, so that
a sitter who stands a little off still has the style: see `app.core.solver.peaks.find_peak`.

The paper's objective offers the largest C of all turns (eq. 5), exactly.

Painted styles have no signature. For them the best match counts among the turns whose strength
reaches its limit, or the largest C where there is none; they are in reach where match and strength
at the turn offered reach their limits.

Answers, the clip audit, painting and the second light all ask here.

How sure a turn is stands here, too. The app computes with a generic head. For most styles any
other head would have the sitter turn to the same place within the tolerance arc; for a few it would
not, and those are named. The numbers come from `turnlight evaluate --bake`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Bools, Float64, Int64
from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.solver.peaks import ARC_SHARE, Gate, Peak, best_index, find_peak, find_peaks
from app.core.solver.shortfall import Cause, LightShortfall, Origin
from app.core.solver.style_signature import NEARLY, NO, YES, grades
from app.core.styles.style import Style, StyleLamp
from app.core.text import tr

_LOBE_POWER: Final = 20.0
_ELEVATIONS_DEG: Final = (-75.0, -60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
_MISSING: Final = 0.25  # of the brightest lobe: a lamp two stops under it does not shape a face
_EVEN: Final = 3.0  # brightest lobe over mean radiance of a place without a main light
_OPPOSITE_DEG: Final = 150.0
_PRICE_SHARE: Final = ARC_SHARE / 3  # of the largest quality, where quality chooses
_TALL_DEG: Final = 20.0  # a style's lamp may stand this much higher or lower and do its work


@dataclass(frozen=True)
class LightMap:
    """Directions from which light comes at a place.

    Attributes:
        luminance: (H, W) float64. Environment at turn 0, any exposure, not all black.
    """

    luminance: Float64

    @cached_property
    def mean(self) -> float:
        """Mean radiance over the sphere."""
        bands = _bands(self.luminance.shape[0])
        return float((self.luminance.mean(axis=1) * bands).sum() / bands.sum())

    @cached_property
    def brightest(self) -> float:
        """Largest mean radiance of any lobe."""
        return max(float(self.ring(e).max()) for e in _ELEVATIONS_DEG)

    @cached_property
    def is_even(self) -> bool:
        """Whether the light is even."""
        return self.brightest < _EVEN * self.mean

    def ring(self, elevation_deg: float) -> Float64:
        """(W,) mean radiance in the lobes around an elevation, one per texel column."""
        height, width = self.luminance.shape
        lobe, total = _lobe(height, width, elevation_deg)
        spectrum = lobe * self._spectrum
        return np.asarray(np.fft.irfft(spectrum.sum(axis=0), n=width) / total)

    def toward(self, lamp: StyleLamp, turn_deg: float) -> float:
        """Return the mean radiance around a style's lamp at a turn."""
        width = self.luminance.shape[1]
        column = ((turn_deg - lamp.azimuth_deg) / 360.0 + 0.5) * width - 0.5
        return float(self.around(lamp)[round(column) % width])

    def around(self, lamp: StyleLamp) -> Float64:
        """(W,) mean radiance of the best lobe at about a lamp's height, one per column."""
        heights = [lamp.elevation_deg + step for step in (-_TALL_DEG, 0.0, _TALL_DEG)]
        rings = [self.ring(height) for height in heights if abs(height) <= 90.0]
        return np.asarray(np.max(rings, axis=0))

    @cached_property
    def _spectrum(self) -> NDArray[np.complex128]:
        return np.fft.rfft(self.luminance, axis=1)


@lru_cache(maxsize=32)
def _lobe(
    height: int, width: int, elevation_deg: float
) -> tuple[NDArray[np.complex128], np.float64]:
    """Spectrum (H, M) of the lobe around an elevation, and the sum of its weights."""
    elevation = math.radians(elevation_deg)
    row = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    away = 2 * np.pi * np.arange(width) / width
    cosine = math.sin(elevation) * np.sin(row)[:, None] + math.cos(elevation) * np.outer(
        np.cos(row), np.cos(away)
    )
    lobe = np.maximum(cosine, 0.0) ** _LOBE_POWER * _bands(height)[:, None]
    # The lobe is even in azimuth, so correlation and convolution are the same.
    return np.fft.rfft(lobe, axis=1), lobe.sum()


@lru_cache(maxsize=4)
def _bands(height: int) -> Float64:
    """(H,) share of the sphere that each row covers."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return np.asarray(edges[:-1] - edges[1:])


def light_shortfall(
    style: Style | None,
    match: float,
    strength: float,
    limits: Limits,
    light: LightMap,
    turn_deg: float,
) -> LightShortfall | None:
    """Return the fault of the light that keeps a style out of reach; None if it is in reach.

    Args:
        style: None for painted weights, which have no lamps.
        turn_deg: The chosen turn, deg.
    """
    if limits.are_met(match, strength):
        return None
    weak = strength < limits.strength
    if light.is_even:
        return limits.miss(Cause.EVEN, match, strength, weak=weak)
    weak = weak and match >= limits.match
    cause, origin = _cause(style, light, turn_deg, weak) if style else (Cause.NO_TURN, None)
    return limits.miss(cause, match, strength, origin, weak=weak)


def _cause(
    style: Style, light: LightMap, turn_deg: float, weak: bool
) -> tuple[Cause, Origin | None]:
    least = _MISSING * light.brightest
    absent = [lamp for lamp in style.lamps if light.around(lamp).max() < least]
    if absent and (len(style.lamps) == 1 or len(absent) == len(style.lamps)):
        return Cause.NO_LIGHT, _origin(absent[0])
    dark = [lamp for lamp in style.lamps if light.toward(lamp, turn_deg) < least]
    if len(style.lamps) == 2 and len(dark) == 1:
        if _opposite(*style.lamps):
            return Cause.ONE_SIDE, None
        return Cause.ONE_LAMP, _origin(dark[0])
    if dark and len(style.lamps) > 1:
        return Cause.APART, None
    return (Cause.FILLED if weak else Cause.SPOILED), None


def _opposite(one: StyleLamp, other: StyleLamp) -> bool:
    apart = abs(math.remainder(one.azimuth_deg - other.azimuth_deg, 360.0))
    return apart >= _OPPOSITE_DEG


def _origin(lamp: StyleLamp) -> Origin:
    side = abs(lamp.azimuth_deg)
    if lamp.elevation_deg <= -20:
        return Origin.BELOW
    if lamp.elevation_deg >= 60:
        return Origin.ABOVE
    if side >= 110:
        return Origin.BEHIND
    if side >= 60:
        return Origin.SIDE
    return Origin.HIGH_IN_FRONT if lamp.elevation_deg >= 20 else Origin.FRONT


Objective: TypeAlias = Literal["picture", "paper"]

OBJECTIVES: Final[tuple[Objective, ...]] = ("picture", "paper")


@dataclass(frozen=True, slots=True)
class Limits:
    """Least match and strength of a style in reach, of 100, and the paper's least C.

    Match and strength are for styles without a signature, as painted ones are. The match is the
    paper's value, read on the scale of match. A strength of 0 asks for none: then the best match of
    all turns is taken.

    Attributes:
        quality: The paper's own rule: a style is out of reach where the largest C is below it, on
            the scale of `app.core.solver.solve.quality_scale`.
    """

    match: float = 45.0
    strength: float = 20.0
    quality: float = 45.0

    def are_met(self, match: float, strength: float) -> bool:
        """Whether a style is in reach at a turn of this match and strength."""
        return match >= self.match and strength >= self.strength

    def miss(
        self,
        cause: Cause,
        match: float,
        strength: float,
        origin: Origin | None = None,
        *,
        weak: bool,
    ) -> LightShortfall:
        """State a cause with the measure that misses its limit: contrast where that is weak."""
        if weak:
            return LightShortfall(cause, "contrast", strength, self.strength, origin)
        return LightShortfall(cause, "match", match, self.match, origin)


PRICE: Final = 1.0
"""Points of match that the middle of the tolerance arc may cost."""

LIMITS: Final = Limits()
"""The default limits."""


@dataclass(frozen=True, slots=True)
class StyleMeasures:
    """Curves of styles at all turns, free of exposure; any axes in front.

    Attributes:
        quality: (..., n) float64. C of eq. 5, over the whole head.
        match: (..., n) float64. 100 x correlation of picture and target over the face.
        strength: (..., n) float64. Depth of the pattern over that of the target, of 100.
        yes, nearly: (..., n) float64. How far a picture is inside the limits of the grade, stops;
            nan where a style has no signature. Yes counts what other styles the picture shows.
        contrast: (..., n) float64. The contrast in match; 1 where match is not taken over the face.
    """

    quality: Float64
    match: Float64
    strength: Float64
    yes: Float64
    nearly: Float64
    contrast: Float64

    def __getitem__(self, lights: int | slice) -> StyleMeasures:
        """Take one or some along the first axis."""
        return StyleMeasures(*(getattr(self, each.name)[lights] for each in fields(self)))


@dataclass(frozen=True, slots=True)
class Choice:
    """Permitted turns of each style, and the curve to maximise.

    Attributes:
        curve: (..., n) float64. The objective: match where the picture objective chooses, quality C
            where C does.
        gate: (..., n) float64. What must be at least 0 at the turn chosen; infinite where nothing
            is asked.
        eligible: (..., n) bool. Turns that may be chosen.
        grade: (...) int64. Of the turns allowed by the picture objective: `NO`, `NEARLY`, `YES`.
        contrast: (..., n) float64. What the curve was divided by, see `find_peak`.
        price: (...) float64. What a turn nearer to the middle of its arc may cost, see `find_peak`;
            0 where the maximum itself is offered.
        is_open: (..., n) bool. Turns that may be offered at all, whatever their grade.
    """

    measured: StyleMeasures
    limits: Limits
    curve: Float64
    gate: Float64
    eligible: Bools
    grade: Int64
    contrast: Float64
    price: Float64
    is_open: Bools

    def __getitem__(self, lights: int | slice) -> Choice:
        """Take one or some along the first axis."""
        return Choice(
            self.measured[lights],
            self.limits,
            self.curve[lights],
            self.gate[lights],
            self.eligible[lights],
            self.grade[lights],
            self.contrast[lights],
            self.price[lights],
            self.is_open[lights],
        )

    @property
    def turns(self) -> Int64:
        """(S,) turn of the best of each style, of (S, 64) curves."""
        return np.array(
            [best_index(c, a) for c, a in zip(self.curve, self.eligible, strict=True)], np.int64
        )

    @property
    def best(self) -> Int64:
        """(...) the same for any axes, where ties do not matter."""
        return np.asarray(np.where(self.eligible, self.curve, -np.inf).argmax(axis=-1))

    @property
    def in_reach(self) -> Bools:
        """(...) whether each style is in reach."""
        return grade_at(self.measured, self.limits, self.best) > NO

    @property
    def offer(self) -> Int64:
        """(S,) grid turn that is offered for each style, of (S, 64) curves."""
        best = self.turns.tolist()
        return np.array([self[row].peak(at).index for row, at in enumerate(best)], np.int64)

    def peak(self, index: int) -> Peak:
        """The turn offered for one style, of (64,) curves; `index` is the grid turn of the best."""
        return find_peak(
            self.curve,
            index,
            self.guard,
            self.contrast,
            price=float(self.price),
            is_open=self.is_open,
        )

    def peaks(self, index: int) -> tuple[Peak, ...]:
        """The turn offered for one style, of (64,) curves, and its rivals.

        Args:
            index: Grid turn of the best.
        """
        return find_peaks(
            self.curve,
            index,
            self.guard,
            self.contrast,
            price=float(self.price),
            is_open=self.is_open,
        )

    @property
    def guard(self) -> Gate | None:
        """The gate of one style, None where nothing is asked."""
        return None if np.isinf(self.gate).any() else Gate(self.gate, 0.0)


def grade_at(measured: StyleMeasures, limits: Limits, turns: Int64 | int) -> Int64:
    """Grade of the pictures at some turns, (...) int64: `NO`, `NEARLY` or `YES`.

    Without a signature it is yes where match and strength reach their limits.
    """
    at = np.asarray(turns)[..., None]
    match, strength, yes, nearly = (
        np.take_along_axis(curve, at, axis=-1)[..., 0]
        for curve in (measured.match, measured.strength, measured.yes, measured.nearly)
    )
    plain = np.minimum(match - limits.match, strength - limits.strength)
    yes = np.where(np.isnan(yes), plain, yes)
    nearly = np.where(np.isnan(nearly), plain, nearly)
    return np.asarray(grades(yes, nearly), np.int64)


def choose(
    measured: StyleMeasures,
    objective: Objective = "picture",
    limits: Limits = LIMITS,
    is_open: Bools | None = None,
) -> Choice:
    """Apply the rule to each style's curves.

    Args:
        is_open: (n,) bool. Which of the n may be chosen at all; all by default.
    """
    shape = measured.match.shape
    free = np.broadcast_to(True if is_open is None else is_open, shape)
    if objective == "paper":
        gate, grade = np.broadcast_to(np.inf, shape), np.zeros(shape[:-1], np.int64)
        one = np.broadcast_to(1.0, shape)
        none = np.zeros(shape[:-1])
        return Choice(measured, limits, measured.quality, gate, free, grade, one, none, free)
    painted = np.isnan(measured.yes)
    least = limits.strength if limits.strength > 0 else -np.inf
    depth = measured.strength - least
    yes = np.where(painted, np.minimum(depth, measured.match - limits.match), measured.yes)
    nearly = np.where(painted, depth, measured.nearly)
    is_yes, is_nearly = free & (yes >= 0), free & (nearly >= 0)
    some_yes, some = (each.any(axis=-1, keepdims=True) for each in (is_yes, is_nearly))
    # What is painted is chosen by match wherever its strength is enough.
    some_yes = some_yes & ~painted
    eligible = np.where(some_yes, is_yes, np.where(some, is_nearly, free))
    # What is far inside or outside would make waves where the gate is followed between the turns.
    most = np.where(painted, 100.0, 1.0)
    gate = np.clip(np.where(some_yes, yes, nearly), -most, most)
    gate = np.where(some, gate, np.inf)
    by_quality = painted & ~some
    curve = np.where(by_quality, measured.quality, measured.match)
    grade = np.where(some_yes, YES, np.where(some, NEARLY, NO))[..., 0].astype(np.int64)
    contrast = np.where(by_quality, 1.0, measured.contrast)
    price = np.where(by_quality[..., 0], _PRICE_SHARE * np.abs(curve).max(axis=-1), PRICE)
    return Choice(measured, limits, curve, gate, eligible, grade, contrast, price, free)


TOLERANCE_DEG: Final = 8.5
"""The tolerance arc of the paper, to either side of the peak, deg."""

CERTAINTY_VERSION: Final = 1
_MOST_BYTES: Final = 1 << 16


@dataclass(frozen=True, slots=True)
class Certainty:
    """Spread of each style's best turn over heads and skins.

    Attributes:
        spread_deg: Mean angle by style, deg; styles that were attainable nowhere are not in it.
    """

    spread_deg: Mapping[str, float]
    scenes: int
    heads: tuple[str, ...]

    def less_certain(self, style: str) -> bool:
        """Return whether a style's turn differs between heads by more than the tolerance arc."""
        return self.spread_deg.get(style, 0.0) > TOLERANCE_DEG


def spread_of(style: str, certainty: Certainty | None = None) -> float | None:
    """Return how far a less certain style's best turn lies away on other heads, deg, on average.

    None where a style's turn is certain enough.
    """
    table = shipped_certainty() if certainty is None else certainty
    if table is None or not table.less_certain(style):
        return None
    return table.spread_deg[style]


@lru_cache(maxsize=1)
def shipped_certainty() -> Certainty | None:
    """Return the shipped certainty; None if it is missing."""
    try:
        return load_certainty(resources() / "evaluation" / "certainty.json")
    except CoreError:
        return None


def load_certainty(path: Path) -> Certainty:
    """Read what is known; raises `CoreError` if the file is missing, damaged or of another kind."""
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise CoreError(tr("{name} is too large.", name=path.name), tr("Reinstall Turnlight."))
        facts = json.loads(path.read_text(encoding="utf-8"))
        if int(facts["format_version"]) != CERTAINTY_VERSION:
            raise CoreError(
                tr("{name} was made by another Turnlight.", name=path.name),
                tr("Reinstall Turnlight."),
            )
        return Certainty(
            spread_deg={str(k): float(v) for k, v in facts["spread_deg"].items()},
            scenes=int(facts["scenes"]),
            heads=tuple(str(name) for name in facts["heads"]),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CoreError(
            tr("{name} is missing or damaged.", name=path.name), tr("Reinstall Turnlight.")
        ) from error
