"""Sentences about cautions: what is wrong, which answers depend on it and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from app.core.base.phrases import small_percent
from app.core.cautions.caution import Caution, Hazard
from app.core.measure.finish.remarks import RoughLight
from app.core.text import tr
from app.words.remarks import remark_words

_MISSING: Final = frozenset({Hazard.CLIPPED, Hazard.ROUGH, Hazard.UNSEEN})


def caution_lines(cautions: Iterable[Caution], styles: Sequence[str]) -> tuple[str, ...]:
    """Describe the cautions, and the requested styles that depend on each of them."""
    lines: list[str] = []
    for caution in cautions:
        lines += filter(None, (hazard_words(caution), _effect(caution, styles)))
    return tuple(lines)


def hazard_words(caution: Caution) -> str:
    """Describe a hazard and how to avoid it, or return "" if its effect says everything."""
    amount = caution.amount or 0.0
    if caution.hazard is Hazard.ROUGH:
        return remark_words(RoughLight(amount))
    if caution.hazard is Hazard.CLIPPED:
        return tr(
            "Clipped areas provide at least {share} of the light.", share=small_percent(amount)
        )
    if caution.hazard is Hazard.LENS_STEP:
        return tr(
            "The two lenses differ by {stops:.1f} stops. Clean both lenses and measure again in "
            "manual mode.",
            stops=amount,
        )
    if caution.hazard is Hazard.NEAR_LIGHT:
        return tr("Light is near. Put the camera exactly where the head will be.")
    if caution.hazard is Hazard.TILT and amount:
        return tr(
            "The camera was tilted by about {degrees:.0f}°. Level it and capture again.",
            degrees=amount,
        )
    return ""


def notice_lines(cautions: Iterable[Caution]) -> tuple[str, ...]:
    """Describe the hazards that no remark about the measurement mentions."""
    return tuple(
        filter(None, (hazard_words(each) for each in cautions if each.hazard not in _MISSING))
    )


def _effect(caution: Caution, styles: Sequence[str]) -> str:
    affected = [name for name in styles if caution.concerns(name)]
    names = _names(affected, styles)
    if caution.hazard is Hazard.UNSEEN:
        return (
            tr("Light from the gaps may change the answer for {names}.", names=names)
            if affected
            else tr("Light from the gaps does not change any answer.")
        )
    if caution.hazard in (Hazard.CLIPPED, Hazard.ROUGH):
        return (
            tr("Clipped light may change the answer for {names}.", names=names)
            if affected
            else tr("Clipped light does not change any answer.")
        )
    return (
        tr("This may change the answer for {names}.", names=names)
        if affected
        else tr("This does not change any answer.")
    )


def _names(doubtful: Sequence[str], styles: Sequence[str]) -> str:
    if len(doubtful) == len(styles) > 1:
        return tr("every style")
    return ", ".join(doubtful)
