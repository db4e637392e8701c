"""Signatures of styles: relations between areas of the face that a picture must satisfy.

A relation is the difference between two areas, in stops. The mean of an area is linear in the
light, so evaluating relations at every turn costs almost nothing. A picture that satisfies every
relation of a style shows the style and is graded yes. A picture that misses some relations, but by
less than a specified band, reads as a shallower or softer version of the style and is graded
soft. Any other picture is graded no.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.arrays import Bools, Float64, Indices
from app.core.solver.face import AREAS, mirror_area
from app.core.solver.shortfall import Aspect

Grade: TypeAlias = Literal["yes", "soft", "no"]

GRADES: Final[tuple[Grade, ...]] = ("no", "soft", "yes")
"""Grades, from worst to best."""

FORMER_GRADES: Final = {"nearly": "soft"}
"""Names of grades in the files of earlier versions, and their present names."""

NO, SOFT, YES = range(3)

EXPLAINS: Final = 5.0
"""Lead in points of match with which a style of equal grade explains a picture better."""

_BLACK: Final = 1 / 256  # fraction of the head's brightest part below which an area counts as black
_NOTHING: Final = 2.0**-40  # fraction of the brightest area below which there is no light
_VISIBLE: Final = 0.1  # stops: a shallower relation is invisible
_SHARE: Final = 0.7  # minimum fraction of a target's depth to keep under the photographer's lamps
_POINTS: Final = 20.0  # points of match that are equivalent to one stop
_SURROUNDINGS: Final = AREAS.index("surroundings")
_LIT_AREAS: Final = tuple(n for n, name in enumerate(AREAS) if name.split()[-1] in ("half", "edge"))


@dataclass(frozen=True, slots=True)
class Relation:
    """The required difference between two areas of the face, in stops.

    Attributes:
        aspect: Aspect of the style that the relation describes.
        least, most: Limits of the difference.
        soft: The largest miss of the limits at which a picture still reads as the style.
    """

    aspect: Aspect
    bright: str
    dark: str
    least: float
    most: float
    soft: float

    @property
    def mirrored(self) -> Relation:
        """The relation of the mirrored style."""
        return Relation(
            self.aspect,
            mirror_area(self.bright),
            mirror_area(self.dark),
            self.least,
            self.most,
            self.soft,
        )


@dataclass(frozen=True, slots=True)
class Signature:
    """The relations and the minimum match that define a style.

    Attributes:
        match: Minimum match, 0 to 100, for the grades yes and soft.
        even: Whether light that is even all around shows the style regardless of the match.
        areas: Whether the match is computed over the areas in the relations (see
            `match_of_areas`).
    """

    relations: tuple[Relation, ...] = ()
    match: tuple[float, float] = (0.0, 0.0)
    even: bool = False
    areas: bool = False

    @property
    def mirrored(self) -> Signature:
        """The signature of the mirrored style."""
        return replace(self, relations=tuple(each.mirrored for each in self.relations))

    def scaled(self, own: Float64, other: Float64) -> Signature:
        """Return the signature for a different set of lamps.

        Deep relations may become shallower in proportion to the style's own target, but they keep
        most of their depth. Other limits are relaxed only as far as the target requires.

        Args:
            own, other: (R,) float64. Values of the relations in the target, in stops, with the
                style's own lamps and with the other lamps.
        """
        rows = zip(self.relations, own.tolist(), other.tolist(), strict=True)
        return replace(self, relations=tuple(_scaled(*row) for row in rows))


def _scaled(relation: Relation, before: float, after: float) -> Relation:
    most = relation.most + max(after - before, 0.0)
    if not 0.0 < relation.least <= before:
        return replace(relation, least=min(relation.least, after - _VISIBLE), most=most)
    share = max(relation.least / before, _SHARE)
    least = max(min(relation.least, share * after), _VISIBLE)
    soft = relation.soft * min(least / relation.least, 1.0)
    return replace(relation, least=least, most=most, soft=soft)


UNSIGNED: Final = Signature()
"""Signature of a style that is defined only by its target picture."""


def stops_of(areas: Float64) -> Float64:
    """Convert means of `AREAS` to stops, with a lower limit for dark areas.

    Args:
        areas: (..., A, n) float64. Means of `AREAS`, at any exposure.
    """
    floor = _BLACK * areas[..., _LIT_AREAS, :].max(axis=-2, keepdims=True)
    # If the face gets no light at all, the light around it keeps the ratios finite.
    least = np.maximum(_NOTHING * areas.max(axis=-2, keepdims=True), 1e-30)
    bright: Float64 = np.maximum(areas, np.maximum(floor, least))
    np.log2(bright, out=bright)
    return bright


@dataclass(frozen=True)
class Signatures:
    """Signatures of several styles, evaluated at all turns at once."""

    styles: tuple[Signature, ...]

    @cached_property
    def _relations(self) -> tuple[Relation, ...]:
        return tuple(r for signature in self.styles for r in signature.relations)

    @cached_property
    def _pairs(self) -> tuple[Indices, Indices]:
        names = {name: n for n, name in enumerate(AREAS)}
        bright = [names[relation.bright] for relation in self._relations]
        return np.array(bright, np.intp), np.array(
            [names[relation.dark] for relation in self._relations], np.intp
        )

    @cached_property
    def _limits(self) -> Float64:
        """The lower limits, the upper limits and the bands for soft, (3, R)."""
        rows = [(relation.least, relation.most, relation.soft) for relation in self._relations]
        return np.array(rows, np.float64).reshape(-1, 3).T

    @cached_property
    def _floors(self) -> Float64:
        """The minimum match for yes and for soft, (2, S)."""
        return np.array([signature.match for signature in self.styles], np.float64).T

    @cached_property
    def _even(self) -> Bools:
        return np.array([signature.even for signature in self.styles])

    @cached_property
    def by_areas(self) -> Bools:
        """A mask, (S,), of the styles whose match is computed over areas."""
        return np.array([signature.areas for signature in self.styles])

    def values(self, stops: Float64) -> Float64:
        """Return the values of all relations of every style, concatenated.

        Args:
            stops: (..., A, n) float64. Means of `AREAS` in stops, from `stops_of`.

        Returns:
            (..., R, n) float64. The values, in stops.
        """
        bright, dark = self._pairs
        return np.asarray(stops[..., bright, :] - stops[..., dark, :])

    def take_areas(self, areas: Float64, match: Float64, strength: Float64) -> None:
        """Replace the match and strength of the styles that are judged by areas, in place.

        Args:
            areas: (..., A, n) float64. Means of `AREAS`, at any exposure.
            match, strength: (..., S, n) float64. The values to replace, 0 to 100.
        """
        for row, signature in enumerate(self.styles):
            if signature.areas:
                result = match_of_areas(signature, areas)
                match[..., row, :], strength[..., row, :] = result

    def slack(
        self, stops: Float64, match: Float64, even: Bools | None = None
    ) -> tuple[Float64, Float64]:
        """Return how far pictures are within the limits for yes and for soft.

        Args:
            stops: (..., A, n) float64. Means of `AREAS` in stops, from `stops_of`.
            match: (..., S, n) float64. Match, 0 to 100.
            even: (..., S) bool. Whether the light is even all around. The default is False.

        Returns:
            The slacks for yes and for soft in stops, (..., S, n) float64 each. They are negative
            outside the limits, and NaN for styles without a signature.
        """
        signed, rows = self._signed
        yes, soft = ((match - floor[:, None]) / _POINTS for floor in self._floors)
        if even is not None:
            waived = even & self._even
            yes[waived] = soft[waived] = np.inf
        for worst in (yes, soft):
            worst[..., ~signed, :] = np.nan
        # Take one relation of every style at a time, so that the planes in use stay in the cache.
        inside, within = (worst[..., signed, :] for worst in (yes, soft))
        for one in rows.T:
            bright, dark = (places[one] for places in self._pairs)
            least, most, band = self._limits[:, one, None]
            values = stops[..., bright, :]
            values -= stops[..., dark, :]
            room = np.minimum(values - least, np.subtract(most, values, out=values))
            np.minimum(inside, room, out=inside)
            room += band
            np.minimum(within, room, out=within)
        yes[..., signed, :], soft[..., signed, :] = inside, within
        return yes, soft

    @cached_property
    def _signed(self) -> tuple[Bools, Indices]:
        """A mask, (S,), of the styles with relations, and their padded relations, (S', n)."""
        counts = [len(signature.relations) for signature in self.styles]
        most = np.arange(max(counts, default=0))
        ends = np.cumsum(counts, dtype=np.intp)
        rows = [
            np.minimum(end - count + most, end - 1)
            for end, count in zip(ends, counts, strict=True)
            if count
        ]
        return np.array(counts) > 0, np.array(rows, np.intp).reshape(len(rows), len(most))


def match_of_areas(signature: Signature, areas: Float64) -> tuple[Float64, Float64]:
    """Return the match and strength of a style that is judged by areas, such as a silhouette.

    The target pattern is derived from the relations: it is 1 for areas that must be brighter, and 0
    for those that must be darker. Areas are compared by their square roots, which are close to
    perceived brightness.

    Args:
        areas: (..., A, n) float64. Means of `AREAS`, at any exposure.

    Returns:
        The match and strength, (..., n) float64 each, 0 to 100. The strength is the difference
        between bright and dark areas.
    """
    order, count = _bright_and_dark(signature)
    bright = np.sqrt(np.maximum(areas[..., order, :], 0.0))
    share = count / len(order)
    high = bright[..., :count, :].sum(axis=-2) / count
    low = bright[..., count:, :].sum(axis=-2) / (len(order) - count)
    mean = share * high + (1 - share) * low
    squares = np.square(bright).sum(axis=-2) / len(order) - np.square(mean)
    spread = np.sqrt(np.maximum(squares, 1e-12 * np.square(mean) + 1e-60))
    match = 100.0 * np.sqrt(share * (1 - share)) * (high - low) / spread
    return match, 100.0 * (high - low) / np.maximum(high + low, 1e-30)


@lru_cache(maxsize=64)
def _bright_and_dark(signature: Signature) -> tuple[list[int], int]:
    """Return the areas that must be brighter, the darker areas, and how many must be brighter."""
    relations = [relation for relation in signature.relations if relation.least > 0]
    bright = sorted({AREAS.index(relation.bright) for relation in relations})
    # A picture does not show the surroundings, only the background.
    dark = sorted({AREAS.index(relation.dark) for relation in relations} - {*bright, _SURROUNDINGS})
    return [*bright, *dark], len(bright)


def worst_relation(
    signature: Signature, areas: Float64, *, soft: bool
) -> tuple[Relation, float] | None:
    """Return the relation that a picture misses by the largest amount.

    Args:
        areas: (A,) float64. Means of `AREAS`, at any exposure.
        soft: Whether the relation must miss even the band for soft, and not only the limits for
            yes.

    Returns:
        The relation and its value, in stops, or None if no relation is missed.
    """
    stops = dict(zip(AREAS, stops_of(areas[:, None])[:, 0].tolist(), strict=True))
    misses = []
    for relation in signature.relations:
        value = stops[relation.bright] - stops[relation.dark]
        band = relation.soft if soft else 0.0
        inside = min(value - relation.least, relation.most - value) + band
        misses.append((inside, relation, value))
    worst = min(misses, key=lambda miss: miss[0], default=None)
    return None if worst is None or worst[0] >= 0 else worst[1:]


def grades(yes: Float64, soft: Float64) -> Indices:
    """Return the grade of each picture, `NO`, `SOFT` or `YES`, from its slacks of any shape."""
    return np.where(yes >= 0, YES, np.where(soft >= 0, SOFT, NO))


def unrivalled(yes: Float64, match: Float64, rivals: Bools) -> Float64:
    """Return the margin between each picture and the nearest rival style (see `better`).

    Args:
        yes: (..., S, n) float64. Slack for yes, in stops, or NaN for styles without a signature.
        match: (..., S, n) float64. Match, 0 to 100.
        rivals: (S, S) bool. The other styles that may explain each style's picture.

    Returns:
        (..., S, n) float64. The margin in stops. It is negative where a rival explains the picture
        better, and infinite if no picture shows a rival at any turn.
    """
    free = np.full(yes.shape, np.inf)
    axes = (*range(yes.ndim - 2), yes.ndim - 1)
    yes_rows = np.flatnonzero((yes >= 0).any(axis=axes))
    for row in yes_rows.tolist():
        others = yes_rows[rivals[row, yes_rows]]
        if others.size:
            behind = (match[..., row, None, :] + EXPLAINS - match[..., others, :]) / _POINTS
            np.min(np.maximum(behind, -yes[..., others, :]), axis=-2, out=free[..., row, :])
    return free


def better(
    row: int, grade: Sequence[int], match: Sequence[float], rivals: Iterable[int]
) -> int | None:
    """Return the style that explains a picture better than the style at `row`, or None.

    Such a style has a higher grade for the picture, or the same grade and a match that is higher by
    at least `EXPLAINS`.

    Args:
        grade, match: (S,). Grade and match of the picture for each style.
        rivals: Indices of the other styles to consider.
    """
    rivals_ahead = [
        (grade[other], match[other], -other)
        for other in rivals
        if grade[other] > grade[row]
        or (grade[other] == grade[row] and match[other] >= match[row] + EXPLAINS)
    ]
    return -max(rivals_ahead)[2] if rivals_ahead else None


def neighbour(grade: Sequence[int], match: Sequence[float], rivals: Iterable[int]) -> int | None:
    """Return the style within reach that has the best match.

    Args:
        rivals: As in `better`. If none of them is within reach, the one with the best match is
            returned.
    """
    grades = [(grade[other] > NO, match[other], -other) for other in rivals]
    return -max(grades)[2] if grades else None
