"""What a style is named for: relations between areas of the face, and how far a picture has them.

A relation says how many stops brighter one area is than another. The mean of an area is linear in
the light, so relations are known at all turns for next to nothing. A picture that has every
relation of a style shows it: yes. One that misses some by less than a stated band reads as the
style, but shallower or softer: nearly. Any other does not: no.
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

Grade: TypeAlias = Literal["yes", "nearly", "no"]

GRADES: Final[tuple[Grade, ...]] = ("no", "nearly", "yes")
"""Grades from the worst to the best."""

NO, NEARLY, YES = range(3)

EXPLAINS: Final = 5.0
"""Points of match by which a style of the same grade explains a picture better than another."""

_BLACK: Final = 1 / 256  # of the brightest part of the head: nothing is seen in what is darker
_NOTHING: Final = 2.0**-40  # of the brightest area: no light
_VISIBLE: Final = 0.1  # stops: a shallower relation is not seen
_SHARE: Final = 0.7  # of the depth of a target under the photographer's lamps
_POINTS: Final = 20.0  # of match that weigh as much as a stop
_LIT_AREAS: Final = tuple(n for n, name in enumerate(AREAS) if name.split()[-1] in ("half", "edge"))


@dataclass(frozen=True, slots=True)
class Relation:
    """Required difference between two areas of the face, in stops.

    Attributes:
        aspect: What of the style it holds.
        nearly: A picture that misses the limits by no more than this still reads as the style.
    """

    aspect: Aspect
    bright: str
    dark: str
    least: float
    most: float
    nearly: float

    @property
    def mirrored(self) -> Relation:
        """Return the relation of the mirrored style."""
        return Relation(
            self.aspect,
            mirror_area(self.bright),
            mirror_area(self.dark),
            self.least,
            self.most,
            self.nearly,
        )


@dataclass(frozen=True, slots=True)
class Signature:
    """Relations and least match that define a style.

    Attributes:
        match: Least match of 100 for yes, and for nearly.
        even: Whether light that is even all round shows the style whatever the match.
        areas: Whether match is taken over the areas that the relations name, see `match_of_areas`.
    """

    relations: tuple[Relation, ...] = ()
    match: tuple[float, float] = (0.0, 0.0)
    even: bool = False
    areas: bool = False

    @property
    def mirrored(self) -> Signature:
        """Return the signature of the mirrored style."""
        return replace(self, relations=tuple(each.mirrored for each in self.relations))

    def scaled(self, own: Float64, other: Float64) -> Signature:
        """Return the signature for other lamps of the style.

        What must be deep may be shallower in proportion, as the style's own target is, but has
        most of its depth; other limits give way only as far as that target needs.

        Args:
            own, other: (R,) float64. Relations in the target with the style's own lamps, and with
                the other ones; stops.
        """
        rows = zip(self.relations, own.tolist(), other.tolist(), strict=True)
        return replace(self, relations=tuple(_scaled(*row) for row in rows))


def _scaled(relation: Relation, before: float, after: float) -> Relation:
    most = relation.most + max(after - before, 0.0)
    if not 0.0 < relation.least <= before:
        return replace(relation, least=min(relation.least, after - _VISIBLE), most=most)
    share = max(relation.least / before, _SHARE)
    least = max(min(relation.least, share * after), _VISIBLE)
    nearly = relation.nearly * min(least / relation.least, 1.0)
    return replace(relation, least=least, most=most, nearly=nearly)


UNSIGNED: Final = Signature()
"""That of a style that is known by its target picture alone."""


def stops_of(areas: Float64) -> Float64:
    """Convert means of `AREAS` to stops, with a floor for darkness.

    Args:
        areas: (..., A, n) float64. Any exposure.
    """
    floor = _BLACK * areas[..., _LIT_AREAS, :].max(axis=-2, keepdims=True)
    # Where the face gets no light at all, what is around it keeps ratios finite.
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
        """(3, R): least, most and the band of nearly."""
        rows = [(relation.least, relation.most, relation.nearly) for relation in self._relations]
        return np.array(rows, np.float64).reshape(-1, 3).T

    @cached_property
    def _floors(self) -> Float64:
        """(2, S): least match for yes and for nearly."""
        return np.array([signature.match for signature in self.styles], np.float64).T

    @cached_property
    def _even(self) -> Bools:
        return np.array([signature.even for signature in self.styles])

    @cached_property
    def by_areas(self) -> Bools:
        """(S,) styles whose match is taken over areas."""
        return np.array([signature.areas for signature in self.styles])

    def values(self, stops: Float64) -> Float64:
        """Return the values of all relations of all styles, concatenated.

        Args:
            stops: (..., A, n) float64, of `stops_of`.

        Returns:
            (..., R, n) float64, stops.
        """
        bright, dark = self._pairs
        return np.asarray(stops[..., bright, :] - stops[..., dark, :])

    def take_areas(self, areas: Float64, match: Float64, strength: Float64) -> None:
        """Replace match and strength of styles judged by areas, in place.

        Args:
            areas: (..., A, n) float64. Means of `AREAS`, any exposure.
            match, strength: (..., S, n) float64. Of 100; are changed.
        """
        for row, signature in enumerate(self.styles):
            if signature.areas:
                result = match_of_areas(signature, areas)
                match[..., row, :], strength[..., row, :] = result

    def slack(
        self, stops: Float64, match: Float64, even: Bools | None = None
    ) -> tuple[Float64, Float64]:
        """Return how far pictures are inside the limits of yes and of nearly; negative outside.

        Args:
            stops: (..., A, n) float64, of `stops_of`.
            match: (..., S, n) float64. Of 100.
            even: (..., S) bool. Whether the light is even all round; by default it is not.

        Returns:
            (..., S, n) float64 each, stops; nan for styles without a signature.
        """
        signed, rows = self._signed
        yes, nearly = ((match - floor[:, None]) / _POINTS for floor in self._floors)
        if even is not None:
            waived = even & self._even
            yes[waived] = nearly[waived] = np.inf
        for worst in (yes, nearly):
            worst[..., ~signed, :] = np.nan
        # One relation of every style at a time: few planes stay near the processor.
        inside, within = (worst[..., signed, :] for worst in (yes, nearly))
        for one in rows.T:
            bright, dark = (places[one] for places in self._pairs)
            least, most, band = self._limits[:, one, None]
            values = stops[..., bright, :]
            values -= stops[..., dark, :]
            room = np.minimum(values - least, np.subtract(most, values, out=values))
            np.minimum(inside, room, out=inside)
            room += band
            np.minimum(within, room, out=within)
        yes[..., signed, :], nearly[..., signed, :] = inside, within
        return yes, nearly

    @cached_property
    def _signed(self) -> tuple[Bools, Indices]:
        """(S,) styles that have relations, and (S', n) which these are; short rows repeat one."""
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
    """Return match and strength of a style judged by areas, such as a silhouette.

    The pattern wanted is the one that its relations speak of: areas that must be brighter are 1,
    those that must be darker are 0. Areas count by the square root, about as bright as they look.

    Args:
        areas: (..., A, n) float64. Means of `AREAS`, any exposure.

    Returns:
        (..., n) float64 each, of 100. Strength is how far dark areas are from bright ones.
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
    """Areas that must be brighter, then those that must be darker; and how many the first are."""
    relations = [relation for relation in signature.relations if relation.least > 0]
    bright = sorted({AREAS.index(relation.bright) for relation in relations})
    dark = sorted({AREAS.index(relation.dark) for relation in relations} - {*bright})
    return [*bright, *dark], len(bright)


def worst_relation(
    signature: Signature, areas: Float64, *, nearly: bool
) -> tuple[Relation, float] | None:
    """Return the relation that a picture misses by most.

    Args:
        areas: (A,) float64. Means of `AREAS`, any exposure.
        nearly: Beyond the band of nearly, too; else beyond the limits of yes.

    Returns:
        With its value, stops; None where no relation is missed.
    """
    stops = dict(zip(AREAS, stops_of(areas[:, None])[:, 0].tolist(), strict=True))
    misses = []
    for relation in signature.relations:
        value = stops[relation.bright] - stops[relation.dark]
        band = relation.nearly if nearly else 0.0
        inside = min(value - relation.least, relation.most - value) + band
        misses.append((inside, relation, value))
    worst = min(misses, key=lambda miss: miss[0], default=None)
    return None if worst is None or worst[0] >= 0 else worst[1:]


def grades(yes: Float64, nearly: Float64) -> Indices:
    """Return the grade of each picture by its slacks: `NO`, `NEARLY` or `YES`."""
    return np.where(yes >= 0, YES, np.where(nearly >= 0, NEARLY, NO))


def unrivalled(yes: Float64, match: Float64, rivals: Bools) -> Float64:
    """Return each picture's margin to the nearest rival style; see `better`.

    Args:
        yes: (..., S, n) float64. Slack of yes, stops; nan for styles without a signature.
        match: (..., S, n) float64. Of 100.
        rivals: (S, S) bool. Which other styles may explain each one's picture.

    Returns:
        (..., S, n) float64, stops; negative where one of them explains it better, and infinite
        where none of them is shown at any turn.
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
    """Return the style that explains a picture better than the style at `row`.

    It is graded higher on it, or alike with a match that is higher by `EXPLAINS`.

    Args:
        grade, match: (S,) of that picture for each style.
        rivals: Positions of the other styles that come into question.
    """
    rivals_ahead = [
        (grade[other], match[other], -other)
        for other in rivals
        if grade[other] > grade[row]
        or (grade[other] == grade[row] and match[other] >= match[row] + EXPLAINS)
    ]
    return -max(rivals_ahead)[2] if rivals_ahead else None


def neighbour(grade: Sequence[int], match: Sequence[float], rivals: Iterable[int]) -> int | None:
    """Return the style in reach whose match with the picture is best.

    Args:
        rivals: As for `better`; where none of them is in reach, the best match of all counts.
    """
    grades = [(grade[other] > NO, match[other], -other) for other in rivals]
    return -max(grades)[2] if grades else None
