"""The selected style with the lamp: the match, the verdict, the best position and the numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

from app.core.base.arrays import Bytes
from app.core.second_light.lamp_answers import best_held, kind_of, powers_for
from app.core.second_light.search import LampPlacement
from app.core.solver.shortfall import LensShortfall
from app.core.solver.turn_choice import LIMITS
from app.core.text import tr
from app.ui.screens.light.placement.pictures import LampView
from app.ui.screens.light.placement.result import LampResult
from app.ui.screens.light.two_steps import move_words
from app.words.lamps import HARDLY_CHANGES, power_share, stops_down
from app.words.phrases.directions import light_words, lit_aside_words
from app.words.phrases.quantities import contrast_words, lower_first, upper_first
from app.words.phrases.turns import signed, turn_words
from app.words.verdict import whole_of
from app.words.why_out_of_reach import reason_sentence

Verdict: TypeAlias = Literal["", "in", "out"]
"""Verdict on the style with the lamp at its current position, or "" until the verdict is known."""


@dataclass(frozen=True, slots=True, eq=False)
class LampDetailState:
    """The selected style with the lamp at its current position.

    Attributes:
        target, with_lamp, without: Portraits, each an (h, w, 3) uint8 sRGB array, or None until it
            is rendered.
        without_tag: Text such as "Without it, at 62°".
        power: Text such as "1/8, 3 stops down", or an empty string for a lamp with only one power.
    """

    key: str = ""
    title: str = ""
    side: str = ""
    target: Bytes | None = field(default=None, repr=False)
    with_lamp: Bytes | None = field(default=None, repr=False)
    without: Bytes | None = field(default=None, repr=False)
    without_tag: str = tr("Without it")
    before: str = ""
    after: str = ""
    verdict: Verdict = ""
    verdict_words: str = ""
    best_title: str = ""
    best_line: str = ""
    at_best: bool = True
    numbers: tuple[tuple[str, str], ...] = ()
    power: str = ""
    weaker: bool = False
    stronger: bool = False
    stale: bool = False


def _lens(result: LampResult) -> str:
    """Describe the best camera position for the style, with the lamp at its best position."""
    lens = result.lens
    if lens is None:
        return ""
    if isinstance(lens.shortfall, LensShortfall):
        return f"{reason_sentence(lens.shortfall)}."
    words = upper_first(lit_aside_words(lens.yaw_deg, lens.lighting)) or tr("Face to the lens")
    there = tr("The lamp is in place.")
    return f"{there} " + tr("{aside}: match {match}.", aside=words, match=whole_of(lens.match))


def detail_of(result: LampResult) -> LampDetailState:
    """Describe the selected style with the lamp at its current position."""
    one, view, position, kind = result.one, result.view, result.position, kind_of(result.answers)
    pack = result.answers.hand.head.pack
    style = pack.styles[pack.index(one.name)]
    powers = powers_for(result.answers)
    stops = stops_down(position.power, kind) if result.dims else ""
    numbers = (
        (tr("Turn"), turn_words(one.turn_refined_deg)),
        (tr("Lamp azimuth"), signed(position.azimuth_deg)),
        (tr("Lamp altitude"), signed(position.altitude_deg)),
    )
    state = LampDetailState(
        key=one.name,
        title=style.title,
        side=light_words(style.side, style.place) or tr("Painted"),
        without_tag=tr("Without it, at {turn}", turn=signed(one.before.turn_refined_deg)),
        before=str(whole_of(one.before.match)),
        best_title=tr("Best place: {match}", match=whole_of(one.match)),
        best_line=_lens(result) if result.at_best else move_words(position, best_held(one), kind),
        at_best=result.at_best,
        numbers=numbers,
        power=", ".join(filter(None, (power_share(position.power, kind), stops)))
        if result.dims
        else "",
        weaker=position.power > powers[-1],
        stronger=position.power < powers[0],
    )
    if view is None:
        return replace(state, stale=True)
    # At the best position, show the same numbers as the list.
    source: LampPlacement | LampView = one if result.at_best else view
    match, strength = source.match, source.strength
    verdict, words = verdict_at(match, strength)
    if source.grade is not None:
        verdict, words = ("in" if source.attainable else "out"), _GRADED[source.grade]
    if verdict == "in" and not source.change.visible:
        # The picture without the lamp looks the same, so the verdict on that one stands.
        verdict = "in" if one.before.attainable else "out"
        words = lower_first(HARDLY_CHANGES)
    return replace(
        state,
        numbers=(*numbers, (tr("Contrast"), contrast_words(strength))),
        target=view.target,
        with_lamp=view.with_lamp,
        without=view.without,
        after=str(whole_of(match)),
        verdict=verdict,
        verdict_words=words,
        stale=view.position != position,
    )


_GRADED: Final = {
    "yes": tr("in reach"),
    "soft": tr("in reach, soft"),
    "no": tr("out of reach"),
}


def verdict_at(match: float, strength: float) -> tuple[Verdict, str]:
    """Return the verdict for a match and a strength, and the text that states the verdict."""
    if match < LIMITS.match:
        return "out", tr("out of reach, under {limit:.0f}", limit=LIMITS.match)
    if strength < LIMITS.strength:
        return "out", tr(
            "too soft: contrast {strength}%, needs {least:.0f}%",
            strength=whole_of(strength),
            least=LIMITS.strength,
        )
    return "in", tr("in reach, over {limit:.0f}", limit=LIMITS.match)
