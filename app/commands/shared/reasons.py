"""The light in the way of each style, and what would help, as JSON and as lines of text."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from app.commands.shared.arguments import asked_lens
from app.commands.shared.printing import short
from app.core.base.arrays import Floats
from app.core.environment.environment import Environment
from app.core.measure.finish.findings import find
from app.core.reasons.diagnosis import Diagnosis, diagnose, solver_of
from app.core.reasons.light_in_the_way import LightInTheWay, lamp_lights
from app.core.solver.lens.view_tables import ViewTables
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack
from app.core.text import tr
from app.words.phrases.light_in_the_way import help_words, in_the_way_name


def diagnose_place(
    pack: StylePack,
    views: Sequence[ViewTables],
    environment: Environment,
    light: Floats,
    results: Sequence[StyleResult],
    args: argparse.Namespace,
) -> dict[str, Diagnosis]:
    """Explain the results of built-in styles, by name (see `diagnose`)."""
    names = {style.name for style in pack.styles}
    built_in = [one for one in results if one.name in names]
    solve = solver_of(
        pack, views, asked_lens(args), args.objective, [one.name for one in built_in], args.front
    )
    findings = find(environment.radiance, clipped=environment.clipped)
    return diagnose(pack, lamp_lights(environment, findings, light), built_in, solve)


def diagnosis_facts(diagnosis: Diagnosis | None) -> dict[str, Any]:
    """Return a style's JSON entries on the light in the way and on what would help."""
    if diagnosis is None:
        return {"in_the_way": None, "mends": []}
    mends = [
        {
            "how": mend.how,
            "grade": mend.grade,
            "turn_deg": round(mend.turn_deg, 6),
            "spot": mend.spot or None,
        }
        for mend in diagnosis.mends
    ]
    return {"in_the_way": _way_facts(diagnosis.way), "mends": mends}


def _way_facts(way: LightInTheWay | None) -> dict[str, Any] | None:
    if way is None:
        return None
    blocked = way.blocked
    return {
        "lamp": way.letter or None,
        "name": in_the_way_name(way),
        "azimuth_deg": _tenths(way.azimuth_deg),
        "elevation_deg": _tenths(way.elevation_deg),
        "area": way.area,
        "share": short(way.share),
        "stops_without": None if way.stops is None else short(way.stops),
        "grade_without": None if blocked is None else blocked.grade,
        "turn_without_deg": None if blocked is None else round(blocked.turn_refined_deg, 6),
    }


def _tenths(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else round(angle_deg, 1)


def diagnosis_lines(
    results: Sequence[StyleResult], diagnoses: Mapping[str, Diagnosis]
) -> list[str]:
    """Name the lights that are worth blocking, and the styles that they keep out of reach."""
    lines = [
        tr("{style}: {words}", style=full_name(result), words=help_words(diagnosis, result))
        for result in results
        if (diagnosis := diagnoses.get(result.name)) is not None and diagnosis.mends
    ]
    return ["", tr("What would help:"), *lines] if lines else []


def full_name(result: StyleResult) -> str:
    """Return the title of a style, with its side if it has one, for a line of text."""
    if result.side == "none":
        return result.title
    left, right = (
        tr("{style} (left)", style=result.title),
        tr("{style} (right)", style=result.title),
    )
    return left if result.side == "left" else right
