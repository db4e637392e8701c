"""The contents of a set sheet, and how they are assembled from the results for a place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final

import numpy as np

from app.core.base.angles import difference, whole
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.findings import Findings, find
from app.core.portrait.catchlights import Catchlight
from app.core.portrait.ratio_and_glare import (
    Flow,
    Glare,
    LightingRatio,
    eye_light,
    glare,
    light_flow,
    lighting_ratio,
)
from app.core.solver.peaks import value_at
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import Transport, render, to_image
from app.words.why_out_of_reach import reason_sentence

_LEAST_SHARE: Final = 0.03
_MOST_LAMPS: Final = 4
_WIDEST: Final = 4096
_SUN_DEG: Final = 4.0


@dataclass(frozen=True, slots=True)
class SheetLamp:
    """A light at the place, as marked on the plan and on the panorama.

    Attributes:
        azimuth_deg, elevation_deg: Direction in the panorama's coordinate system, in degrees.
        share: Fraction of all light at the place, 0 to 1.
    """

    name: str
    azimuth_deg: float
    elevation_deg: float
    share: float
    sun: bool = False
    clipped: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class SetSheet:
    """One page for a style at a place.

    Attributes:
        turn_deg: Turn from the photographer's starting position, in degrees, positive clockwise as
            seen from above.
        arc_deg: Tolerance arc (from, to), clockwise, in degrees.
        panorama: NDArray[np.uint8], (H, 2 H, 3). sRGB panorama as measured. It looks sharp with
            2,048 columns or more.
        front_deg: Panorama azimuth of the photographer's starting position, in degrees.
        yaw_deg: Turn of the face away from the lens, in degrees, positive towards the sitter's own
            left.
        reason: Why the style is out of reach here, or None if it is within reach.
        ratio, glare, flow: Readings taken from the picture and the light at this turn. If one is
            None, its line is omitted.
        verdict: The verdict about the place, or "" to leave it out.
        draw: Function that renders the target and the picture as they appear on screen, (h, w, 3)
            uint8 sRGB, at a size given in rows and columns.
    """

    title: str
    side: str
    turn_deg: float
    arc_deg: tuple[float, float]
    match: float
    strength: float
    panorama: Bytes = field(repr=False)
    place: str
    draw: Callable[[tuple[int, int]], tuple[Bytes, Bytes]]
    light: str = ""
    front_deg: float = 0.0
    yaw_deg: float = 0.0
    lamps: tuple[SheetLamp, ...] = ()
    reason: str | None = None
    limit: float = 45.0
    ratio: LightingRatio | None = None
    glare: Glare | None = None
    flow: Flow | None = None
    made_text: str = ""
    age: str = ""
    head: str = ""
    notes: str = ""
    verdict: str = ""
    catchlights: tuple[Catchlight, ...] | None = None

    @property
    def nose_deg(self) -> float:
        """The turn at which the nose points, computed from the whole degrees shown."""
        return float(whole(self.turn_deg) - round(self.yaw_deg))

    @property
    def visible_lamps(self) -> tuple[SheetLamp, ...]:
        """At most four lamps to draw: the sun, then those with a noticeable share of the light."""
        fair = [lamp for lamp in self.lamps if lamp.sun or lamp.share >= _LEAST_SHARE]
        return tuple(sorted(fair, key=lambda lamp: not lamp.sun)[:_MOST_LAMPS])


def lamps_of(findings: Findings, sun: tuple[float, float] | None = None) -> tuple[SheetLamp, ...]:
    """Return the lamps of a place as they are marked on the sheet.

    Args:
        sun: Azimuth and elevation of the sun in degrees, or None if unknown. A lamp in that
            direction is labelled as the sun.
    """
    return tuple(
        SheetLamp(
            lamp.letter,
            lamp.azimuth_deg,
            lamp.elevation_deg,
            lamp.share,
            lamp.kind == "sun" or _is_near(lamp.azimuth_deg, lamp.elevation_deg, sun),
            lamp.clipped,
        )
        for lamp in findings.lamps
    )


def _is_near(azimuth: float, elevation: float, sun: tuple[float, float] | None) -> bool:
    if sun is None:
        return False
    aside = abs(difference(azimuth, sun[0])) * np.cos(np.radians(elevation))
    return bool(np.hypot(aside, elevation - sun[1]) < _SUN_DEG)


def assemble(
    result: StyleResult,
    transport: Transport,
    radiance: FloatImage,
    *,
    place: str,
    face_picture: FloatImage,
    draw: Callable[[FloatImage, tuple[int, int]], tuple[Bytes, Bytes]],
    light: str = "",
    front_deg: float = 0.0,
    turn_deg: float | None = None,
    sun: tuple[float, float] | None = None,
    limit: float = 45.0,
    made_text: str = "",
    age: str = "",
    head: str = "",
    notes: str = "",
    verdict: str = "",
    findings: Findings | None = None,
    catchlights: tuple[Catchlight, ...] | None = None,
) -> SetSheet:
    """Assemble the set sheet for a style at a place.

    Args:
        radiance: NDArray[np.float32], (H, 2 H, 3). Linear Rec. 709 environment as measured.
        face_picture: The environment around the nose at the turn, in the form that a transport
            takes as input.
        draw: Function as in `SetSheet`, with the linear picture of the head here, (N, N, 3), as an
            additional first argument.
        front_deg: Panorama azimuth of the photographer, in degrees.
        turn_deg: A turn other than the best one, in degrees, or None for the best turn. For another
            turn, the match and the strength are interpolated between the turns of the grid, and the
            arc is that of the peak to which the turn belongs.
        sun: Panorama azimuth and elevation of the sun in degrees, or None if unknown.
        findings: Lamps of the place, or None to detect them in `radiance`.
        catchlights: Catchlights in the eyes, or None if no picture shows the eyes.

    Raises:
        CoreError: If the environment is not a panorama, or is black.
    """
    turn = result.turn_refined_deg if turn_deg is None else turn_deg
    match, strength, arc = _at_turn(result, turn_deg)
    facing = turn + front_deg
    pixels = render(transport, face_picture)
    eyes = eye_light(radiance)
    light_findings = find(radiance) if findings is None else findings
    return SetSheet(
        title=result.title or result.name,
        side=result.side,
        turn_deg=turn,
        arc_deg=arc,
        match=match,
        strength=strength,
        panorama=display_panorama(radiance, width=min(radiance.shape[1], _WIDEST)),
        place=place,
        draw=partial(draw, to_image(transport, pixels)),
        light=light,
        front_deg=front_deg,
        yaw_deg=result.yaw_deg,
        lamps=lamps_of(light_findings, sun),
        reason=None if result.attainable else reason_sentence(result.shortfall),
        limit=limit,
        ratio=lighting_ratio(transport, pixels),
        # The eyes look into the lens, but the nose direction determines how light falls on the
        # face.
        glare=glare(eyes, facing, sun, light_findings),
        flow=light_flow(eyes, facing - result.yaw_deg),
        made_text=made_text,
        age=age,
        head=head,
        notes=notes,
        verdict=verdict,
        catchlights=catchlights,
    )


def _at_turn(
    result: StyleResult, turn_deg: float | None
) -> tuple[float, float, tuple[float, float]]:
    """Return the match, the strength and the arc at a turn."""
    if turn_deg is None:
        return result.match, result.strength, result.arc_deg
    match, strength = (
        value_at(curve, turn_deg) for curve in (result.match_curve, result.strength_curve)
    )
    return match, strength, result.arc_near(turn_deg)
