"""The result of a place for one style."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

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
from app.core.solver.style_signature import Grade


@dataclass(frozen=True, slots=True)
class PeakResult:
    """A turn at which an objective has a local maximum.

    Attributes:
        turn_deg, turn_refined_deg: Turn on the grid of 5.625 degrees, and refined, in degrees
            within (-180, 180], positive clockwise.
        arc_deg: Tolerance arc (from, to), clockwise, in degrees.
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
    """Improvement of a style by turning the face, with turn and yaw as in `StyleResult`."""

    lighting: Lighting
    turn_deg: float
    yaw_deg: float
    match: float


@dataclass(frozen=True, slots=True)
class StyleResult:
    """The answer of a place for a style.

    Attributes:
        turn_index: Grid turn 0..63 from the panorama's centre column, regardless of the front.
        turn_deg, turn_refined_deg: The turn offered, on the grid and refined as shown, at most a
            step of 5.625 degrees apart, in degrees, positive clockwise. See
            `app.core.solver.peaks.find_peak`.
        direction: Direction of the refined turn: clockwise, counter-clockwise or none.
        quality_curve, match_curve, strength_curve: (64,) float64. Values at turns of 5.625 k
            degrees. Quality is in the unit of the environment; the others are 100 for the studio
            picture.
        attainable: Whether the grade is yes or nearly or, for a style without a signature, whether
            match and strength reach their limits.
        arc_deg: Tolerance arc (from, to) around the best turn, clockwise, in degrees. It ends where
            the grade does. The refined turn is near its middle.
        grade: How well the picture shows the style, or None if the style has no signature.
        shortfall: The reason why the style is out of reach, or the respect in which the picture
            only nearly shows the style.
        looks_more_like: Name of the style that explains the picture better.
        same_picture: Names of the attainable styles with the same turn.
        neighbour: Name of the style that explains the picture second best, for which it may be
            mistaken. It is never the mirrored style.
        yaw_deg: Angle of the face towards the sitter's own left from the line to the lens; the turn
            is that of the lens. Match and its curve are for the picture as seen from there.
        yaw_arc_deg: Yaws (from, to) at which the picture is about as good, at the same direction of
            the nose.
        lighting: Whether the side of the face away from the lens is lit, or the side towards it.
        gains: Gains of a turned face: a better grade, or the same grade with a better match.
            Empty if the style stays out of reach.
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
        """Azimuth of the nose at the refined turn, in degrees."""
        return wrap(self.turn_refined_deg - self.yaw_deg)

    def arc_at(self, turn_deg: float) -> tuple[float, float] | None:
        """Return the nearest peak's tolerance arc, (from, to) in degrees, if it contains a turn.

        Angles are compared in whole degrees, as shown.
        """
        peaks = [(self.turn_refined_deg, self.arc_deg)]
        peaks += [(peak.turn_refined_deg, peak.arc_deg) for peak in self.peaks]
        _, arc = min(peaks, key=lambda peak: abs(difference(peak[0], turn_deg)))
        ends = (float(whole(arc[0])), float(whole(arc[1])))
        if arc[1] - arc[0] >= 360.0 or lies_on_arc(float(whole(turn_deg)), ends):
            return arc
        return None

    def arc_near(self, turn_deg: float) -> tuple[float, float]:
        """Return the arc that contains a turn, otherwise the arc of the best turn, in degrees."""
        return self.arc_at(turn_deg) or self.arc_deg

    @property
    def background_deg(self) -> float:
        """Azimuth straight behind the sitter at the refined turn, in degrees."""
        return wrap(self.turn_refined_deg + 180.0)

    def seen_from(self, front_deg: float) -> StyleResult:
        """Return the result with turns counted from the photographer at `front_deg`.

        Args:
            front_deg: Panorama azimuth of the photographer, in degrees.

        Returns:
            The result, in which each turn t becomes wrap(t - front_deg) and the curves are for the
            new turns.
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
