"""Measure a single picture and grade it for every style."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.core.base.arrays import Float64, Floats, Indices
from app.core.solver.shortfall import AreaShortfall, Cause, LightShortfall, Shortfall
from app.core.solver.style_signature import (
    GRADES,
    NO,
    SOFT,
    YES,
    Grade,
    better,
    grades,
    neighbour,
    stops_of,
    worst_relation,
)
from app.core.solver.transport import Transport
from app.core.solver.turn_choice import Limits
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack


@dataclass(frozen=True, slots=True, eq=False)
class PictureMeasure:
    """The measures of a picture.

    Attributes:
        areas: (A,) float64. Means of `AREAS`, at any exposure.
        match, strength: (S,) float64. Values for each style, which are 100 for its target picture.
        grade: (S,) int. Grade for each style, or `NO` if the style has no signature.
    """

    areas: Float64
    match: Float64
    strength: Float64
    grade: Indices


def picture_of(
    pack: StylePack, areas: Float64, match: Float64, strength: Float64
) -> PictureMeasure:
    """Grade a picture for every style, updating `match` and `strength` in place."""
    pack.signatures.take_areas(areas[:, None], match[:, None], strength[:, None])
    yes, soft = pack.signatures.slack(stops_of(areas[:, None]), match[:, None])
    return PictureMeasure(areas, match, strength, grades(yes[:, 0], soft[:, 0]))


def measure_picture(pack: StylePack, transport: Transport, luminance: Floats) -> PictureMeasure:
    """Measure a single picture (see `app.core.solver.solve.measure` for all turns).

    Args:
        luminance: (P,) float. Linear luminance on the head's pixels, at any exposure.
    """
    grey, region = np.asarray(luminance, np.float64), pack.region_on(transport)
    weights = pack.weights_on(transport)
    mean = float(grey @ region) / float(region.sum())
    contrast = float(np.sqrt(region @ (grey - mean) ** 2))
    areas = pack.areas.reshape(len(pack.areas), -1)[:, transport.pixels].astype(np.float64)
    product = weights @ grey
    match = 100.0 * product / np.maximum(pack.weight_norm * contrast, 1e-30)
    strength = 100.0 * product / np.maximum(pack.studio_ratio * mean, 1e-30)
    # A picture of the head says nothing about its surroundings.
    means = areas @ grey / np.maximum(areas.sum(axis=1), 1e-30)
    return picture_of(pack, means, match, strength)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The grade of a picture for a style, with fields as in `StyleResult`."""

    attainable: bool
    grade: Grade | None = None
    shortfall: Shortfall | None = None
    looks_more_like: str | None = None
    neighbour: str | None = None


def judge(pack: StylePack, row: int, picture: PictureMeasure, limits: Limits) -> Verdict:
    """Grade a picture for the style at `row`, among its rivals.

    Returns:
        The verdict, without a shortfall if the style has no signature.
    """
    style, match = pack.styles[row], float(picture.match[row])
    if not style.signature.relations:
        return Verdict(limits.are_met(match, float(picture.strength[row])))
    grade_of, match_of = picture.grade.tolist(), picture.match.tolist()
    rivals, apart = pack.rivals[row]
    other = better(row, grade_of, match_of, rivals)
    second = neighbour(grade_of, match_of, apart)
    alike = None if other is None or picture.grade[other] == NO else pack.styles[other].name
    grade = grade_of[row] if alike is None else min(grade_of[row], SOFT)
    shortfall = None if grade == YES else _shortfall(style, picture.areas, match, grade)
    return Verdict(
        attainable=grade > NO,
        grade=GRADES[grade],
        shortfall=shortfall,
        looks_more_like=alike,
        neighbour=None if second is None else pack.styles[second].name,
    )


def _shortfall(style: Style, areas: Float64, match: float, grade: int) -> Shortfall | None:
    """Return the shortfall of a picture, or None if it satisfies its style's whole signature."""
    worst = worst_relation(style.signature, areas, soft=grade == NO)
    if worst is None:
        least, lowest = style.signature.match
        enough = match >= (least if grade == SOFT else lowest)
        return None if enough else LightShortfall(Cause.SPOILED, "match", match, least)
    relation, value = worst
    # The limit of yes, whatever the grade: a style has one.
    limit = relation.least if value < relation.least else relation.most
    return AreaShortfall(relation.aspect, style.title, relation.bright, relation.dark, value, limit)
