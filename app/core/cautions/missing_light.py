"""Cautions about light that a panorama lacks: clipped, in gaps or estimated from one photo."""

from __future__ import annotations

from app.core.cautions.caution import Caution, Hazard
from app.core.environment.environment import Environment
from app.core.measure.finish.doubtful_answers import Doubt


def missing_light(environment: Environment, doubt: Doubt | None) -> tuple[Caution, ...]:
    """Return the cautions about an environment whose doubtful styles have been determined."""
    if doubt is None:
        return ()
    cautions: list[Caution] = []
    if environment.rough or environment.clipped is not None:
        hazard = Hazard.ROUGH if environment.rough else Hazard.CLIPPED
        cautions.append(Caution(hazard, environment.clipped_light, doubt.clipped))
    if environment.unseen is not None:
        cautions.append(Caution(Hazard.UNSEEN, environment.blind, doubt.unseen))
    return tuple(cautions)
