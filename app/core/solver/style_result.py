"""The result for one style at a place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, Protocol, TypeAlias

from app.core.base.angles import (
    difference,
    direction,
    lies_on_arc,
    whole,
    wrap,
)
from app.core.base.arrays import Float64
from app.core.solver.peaks import shift
from app.core.solver.shortfall import Shortfall
from app.core.solver.style_signature import GRADES, YES, Grade


@dataclass(frozen=True, slots=True)
class PeakResult:
    """A turn at which an objective has a local maximum.

    Attributes:
        turn_deg, turn_refined_deg: The turn on the grid of 5.625 degrees, and the refined turn, in
            degrees within (-180, 180], positive clockwise.
        arc_deg: The clockwise tolerance arc (from, to), in degrees.
    """

    turn_deg: float
    turn_refined_deg: float
    quality: float
    match: float
    strength: float
    arc_deg: tuple[float, float]


Lighting: TypeAlias = Literal["front", "short", "broad"]


@dataclass(frozen=True, slots=True)
class Gain:
    """An improvement of a style from turning the face, with turn and yaw as in `StyleResult`."""

    lighting: Lighting
    turn_deg: float
    yaw_deg: float
    match: float


class StyleAnswer(Protocol):
    """The part of a `StyleResult` by which styles are ranked and grouped."""

    @property
    def name(self) -> str:
        """Name of the style."""

    @property
    def title(self) -> str:
        """Title of the style."""

    @property
    def attainable(self) -> bool:
        """Whether the style is within reach."""

    @property
    def match(self) -> float:
        """Match at the offered turn."""

    @property
    def grade(self) -> Grade | None:
        """Grade, or None if the style has no signature."""

    @property
    def same_picture(self) -> tuple[str, ...]:
        """Names of the attainable styles with the same picture."""


@dataclass(frozen=True, slots=True)
class StyleResult:
    """The result for a style at a place.

    Attributes:
        turn_index: Grid turn, 0 to 63, from the panorama's centre column, regardless of the front.
        turn_deg, turn_refined_deg: The offered turn, on the grid and refined for display, in
            degrees, positive clockwise. The two differ by at most one step of 5.625 degrees (see
            `app.core.solver.peaks.find_peak`).
        direction: Direction of the refined turn: clockwise, counter-clockwise or none.
        quality_curve, match_curve, strength_curve: (64,) float64. Values at turns of 5.625 k
            degrees. Quality is in the same unit as the environment. The other two are 100 for the
            studio picture.
        attainable: Whether the grade is yes or soft or, for a style without a signature, whether
            match and strength reach their limits.
        arc_deg: Clockwise tolerance arc (from, to) around the best turn, in degrees. It ends where
            the grade changes. The refined turn is near its middle.
        grade: How well the picture shows the style, or None if the style has no signature.
        shortfall: The reason why the style is out of reach, or the respect in which the picture
            shows the style only softly.
        looks_more_like: Name of the style that explains the picture better.
        same_picture: Names of the attainable styles with the same picture: the same turn, lens and
            exposure.
        neighbour: Name of the style that explains the picture second best and for which this style
            may be mistaken. It is never the mirrored style.
        yaw_deg: Angle by which the face is turned from the lens towards the sitter's own left. The
            turn is that of the lens. The match and its curve are for the picture as seen from
            there.
        yaw_arc_deg: Range of yaws (from, to) over which the picture is about equally good while the
            nose points in the same direction.
        lighting: Whether the main light falls on the side of the face that is turned away from the
            lens or on the side turned towards it.
        gains: Gains from turning the face: a better grade, or a better match at the same grade.
            Empty if the style remains out of reach.
    """

    name: str
    title: str
    side: str
    turn_index: int
    turn_deg: float
    turn_refined_deg: float
    direction: str
    quality_curve: Float64
    match_curve: Float64
    strength_curve: Float64
    quality: float
    match: float
    strength: float
    attainable: bool
    arc_deg: tuple[float, float]
    peaks: tuple[PeakResult, ...]
    grade: Grade | None = None
    shortfall: Shortfall | None = None
    looks_more_like: str | None = None
    same_picture: tuple[str, ...] = ()
    neighbour: str | None = None
    yaw_deg: float = 0.0
    yaw_arc_deg: tuple[float, float] = (0.0, 0.0)
    lighting: Lighting = "front"
    gains: tuple[Gain, ...] = ()

    @property
    def nose_deg(self) -> float:
        """The azimuth of the nose at the refined turn, in degrees."""
        return wrap(self.turn_refined_deg - self.yaw_deg)

    @property
    def rank(self) -> int:
        """The index of the grade in `GRADES`. A painted style counts as yes or no."""
        return GRADES.index(self.grade) if self.grade else YES * self.attainable

    def arc_at(self, turn_deg: float) -> tuple[float, float] | None:
        """Return the nearest peak's tolerance arc (from, to), in degrees, if it contains a turn.

        Angles are compared in whole degrees, as displayed.
        """
        peaks = [(self.turn_refined_deg, self.arc_deg)]
        peaks += [(peak.turn_refined_deg, peak.arc_deg) for peak in self.peaks]
        _, arc = min(peaks, key=lambda peak: abs(difference(peak[0], turn_deg)))
        ends = (float(whole(arc[0])), float(whole(arc[1])))
        if arc[1] - arc[0] >= 360.0 or lies_on_arc(float(whole(turn_deg)), ends):
            return arc
        return None

    def arc_near(self, turn_deg: float) -> tuple[float, float]:
        """Return the arc that contains a turn, or else the arc of the best turn, in degrees."""
        return self.arc_at(turn_deg) or self.arc_deg

    @property
    def background_deg(self) -> float:
        """The azimuth directly behind the sitter at the refined turn, in degrees."""
        return wrap(self.turn_refined_deg + 180.0)

    def seen_from(self, front_deg: float) -> StyleResult:
        """Return the result with turns measured from the photographer at `front_deg`.

        Args:
            front_deg: Panorama azimuth of the photographer, in degrees.

        Returns:
            The result, in which each turn t becomes wrap(t - front_deg) and the curves are shifted
            accordingly.
        """

        def shifted(angle: float) -> float:
            return wrap(angle - front_deg)

        def arc(ends: tuple[float, float]) -> tuple[float, float]:
            return ends if ends == (-180.0, 180.0) else (shifted(ends[0]), shifted(ends[1]))

        refined = shifted(self.turn_refined_deg)
        return replace(
            self,
            turn_deg=shifted(self.turn_deg),
            turn_refined_deg=refined,
            direction=direction(refined),
            quality_curve=shift(self.quality_curve, front_deg),
            match_curve=shift(self.match_curve, front_deg),
            strength_curve=shift(self.strength_curve, front_deg),
            arc_deg=arc(self.arc_deg),
            gains=tuple(replace(gain, turn_deg=shifted(gain.turn_deg)) for gain in self.gains),
            peaks=tuple(
                replace(
                    peak,
                    turn_deg=shifted(peak.turn_deg),
                    turn_refined_deg=shifted(peak.turn_refined_deg),
                    arc_deg=arc(peak.arc_deg),
                )
                for peak in self.peaks
            ),
        )
