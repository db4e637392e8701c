"""Sentences about light that an environment does not hold, and the answers that depend on it."""

from __future__ import annotations

from app.core.hdr.doubt import Doubt
from app.core.solver.environment import Environment
from app.core.solver.style_pack import StylePack
from app.core.text import tr
from app.core.text.quantities import percent, small_percent


def doubt_words(doubt: Doubt, environment: Environment, pack: StylePack) -> tuple[str, ...]:
    """Say how much light is missing, and which styles depend on it."""
    lines: list[str] = []
    if environment.rough and environment.clipped is None:
        lines.append(tr("A rough answer: one photograph, though nothing in it is clipped."))
    elif environment.rough:
        lines.append(
            tr(
                "A rough answer: in one photograph {share} of the light is a guess, where it is "
                "clipped.",
                share=percent(environment.clipped_light),
            )
        )
    elif environment.clipped is not None:
        lines.append(
            tr(
                "Clipped areas give {share} of the light, and may give more.",
                share=small_percent(environment.clipped_light),
            )
        )
    if environment.clipped is not None:
        lines.append(
            tr("The answer depends on what is clipped: {names}.", names=_names(doubt.clipped, pack))
            if doubt.clipped
            else tr("No answer depends on what is clipped.")
        )
    if environment.unseen is not None:
        lines.append(
            tr(
                "The answer depends on what was not seen: {names}.",
                names=_names(doubt.unseen, pack),
            )
            if doubt.unseen
            else tr("No answer depends on what was not seen.")
        )
    return tuple(lines)


def _names(doubtful: tuple[str, ...], pack: StylePack) -> str:
    if len(doubtful) == len(pack.styles):
        return tr("every style")
    return ", ".join(doubtful)
