"""Sentences about light that an environment lacks, and about the answers that depend on it."""

from __future__ import annotations

from collections.abc import Sequence

from app.core.base.phrases import small_percent
from app.core.environment.environment import Environment
from app.core.measure.finish.doubtful_answers import Doubt
from app.core.measure.finish.remarks import RoughLight
from app.core.text import tr
from app.words.remarks import remark_words


def doubt_words(doubt: Doubt, environment: Environment, styles: Sequence[str]) -> tuple[str, ...]:
    """Describe how much light is missing, and which of the requested styles depend on it."""
    lines: list[str] = []
    clipped = [name for name in styles if name in doubt.clipped]
    unseen = [name for name in styles if name in doubt.unseen]
    if environment.rough:
        lines.append(remark_words(RoughLight(environment.clipped_light)))
    elif environment.clipped is not None:
        lines.append(
            tr(
                "Clipped areas provide at least {share} of the light.",
                share=small_percent(environment.clipped_light),
            )
        )
    if environment.clipped is not None:
        lines.append(
            tr("Clipped light may change the answer for {names}.", names=_names(clipped, styles))
            if clipped
            else tr("Clipped light does not change any answer.")
        )
    if environment.unseen is not None:
        lines.append(
            tr(
                "Light from the gaps may change the answer for {names}.",
                names=_names(unseen, styles),
            )
            if unseen
            else tr("Light from the gaps does not change any answer.")
        )
    return tuple(lines)


def _names(doubtful: Sequence[str], styles: Sequence[str]) -> str:
    if len(doubtful) == len(styles) > 1:
        return tr("every style")
    return ", ".join(doubtful)
