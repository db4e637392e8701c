"""The verdict about a place, in words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from app.core.places.place_verdict import PlaceVerdict
from app.core.portrait.ratio_and_glare import Flow, Hardness
from app.core.solver.style_result import StyleAnswer
from app.core.styles.styles import NAMES
from app.core.text import tr
from app.words.phrases.directions import direction_words
from app.words.phrases.quantities import lower_first

_MOST: Final = 3
_LIGHT: Final = {
    Hardness.HARD: tr("Hard light {where}."),
    Hardness.STRONG: tr("Strong light {where}."),
    Hardness.SOFT: tr("Soft light {where}."),
    Hardness.EVEN: tr("Nearly even light from all around."),
}
_PROPER: Final = frozenset({"left-rembrandt", "right-rembrandt"})
"""Styles whose titles keep their capital within a sentence."""


def place_verdict_words(verdict: PlaceVerdict, results: Iterable[StyleAnswer]) -> str:
    """Describe the light at a place, if it is known, and the place's best styles, at most three.

    Directions are those in the panorama with the photographer at its centre.

    Args:
        results: Results from which the verdict was made, for the titles of the styles.
    """
    titles = {one.name: style_within_sentence(one) for one in results}
    sentences = [] if verdict.flow is None else [light_sentence(verdict.flow)]
    if not verdict.yes and not verdict.soft:
        sentences.append(tr("Nothing here yet. Look for one strong light, or bring a lamp."))
        return " ".join(sentences)
    best = verdict.yes[:_MOST]
    softly = verdict.soft[: _MOST - len(best)]
    if best:
        sentences.append(tr("Best: {styles}.", styles=", ".join(titles[one] for one in best)))
    if softly:
        sentences.append(tr("Softly: {styles}.", styles=", ".join(titles[one] for one in softly)))
    if not verdict.deep_shadows:
        sentences.append(tr("No deep shadows."))
    return " ".join(sentences)


def style_within_sentence(result: StyleAnswer) -> str:
    """Return a style's title for use within a sentence. Titles of the user's styles are kept."""
    return title_within_sentence(result.name, result.title or result.name)


def title_within_sentence(name: str, title: str) -> str:
    """Return the title of the style with this name, for use within a sentence."""
    return lower_first(title) if name in NAMES and name not in _PROPER else title


def light_sentence(flow: Flow) -> str:
    """Describe the light of a place as seen in the panorama from the photographer's position."""
    where = direction_words(-flow.azimuth_deg, flow.elevation_deg)
    return _LIGHT[flow.hardness].format(where=where)
