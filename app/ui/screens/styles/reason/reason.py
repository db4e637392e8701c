"""The reason why a style is soft or out of reach: the light in the way, and the areas on the face.

The reason is that at the best turn, to which the grade applies.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TypeAlias

from app.core.base.arrays import Float64
from app.core.measure.finish.findings import Findings
from app.core.portrait.head import Head
from app.core.reasons.area_outlines import AreaOutline, area_outlines
from app.core.reasons.diagnosis import Diagnosis, diagnose, solver_of
from app.core.reasons.light_in_the_way import LampLights, lamp_lights
from app.core.solver.lens.lens_wish import STRAIGHT
from app.core.solver.place_light import PlaceLight
from app.core.solver.shortfall import AreaShortfall
from app.core.solver.style_result import StyleResult
from app.ui.screens.styles.gallery import Size, Snapshot
from app.words.phrases.light_in_the_way import area_labels, help_words, needs_label

Elsewhere: TypeAlias = Callable[[str], Mapping[str, StyleResult]]
"""Results at other spots by their names, for the style with a given name in the pack."""


@dataclass(frozen=True, slots=True, eq=False)
class AreaMark:
    """An area of the face in a portrait.

    Attributes:
        loops: (n, 2) float64 each. Closed outlines, as fractions of the portrait's width and
            height.
        label: Brightness relative to the other area, in stops, such as "+0.4" or "0".
        helps: Whether more light on this area would help, or less.
    """

    loops: tuple[Float64, ...] = field(repr=False)
    label: str
    helps: bool


@dataclass(frozen=True, slots=True, eq=False)
class ReasonState:
    """The reason why a style is soft or out of reach. Empty text is hidden.

    Attributes:
        words: Sentences on the light in the way and on what would help.
        needs: Display text such as "Has 0.4, needs 1.1", or "" at any other turn than the
            best. The labels of the areas are shown together with it.
        marks: The two areas that are compared, or none if they are not on the face.
    """

    words: str = ""
    needs: str = ""
    marks: tuple[AreaMark, ...] = ()


NO_REASON = ReasonState()
"""The state of a style that needs no reason, or has none that compares areas."""


@dataclass(frozen=True, slots=True, eq=False)
class AreaReason:
    """The reason for one style, for portraits of any size.

    Attributes:
        head: The head as the lens sees it, or None if there is no reason.
        labels, outlines: Those of the bright area and of the dark area, in the words of
            `AreaShortfall`.
        below: Whether the bright area is too dark, or too bright.
    """

    head: Head | None = None
    words: str = ""
    needs: str = ""
    labels: tuple[str, ...] = ()
    outlines: tuple[AreaOutline, ...] = ()
    below: bool = True

    def state(self, size: Size, *, at_best: bool) -> ReasonState:
        """Return the state for a portrait.

        Args:
            size: Rows and columns of the portrait.
            at_best: Whether the portrait is at the best turn.
        """
        if self.head is None:
            return NO_REASON
        marks = tuple(
            AreaMark(outline.in_portrait(self.head, size), label, helps)
            for outline, label, helps in zip(
                self.outlines, self.labels, (self.below, not self.below), strict=True
            )
            if outline.loops
        )
        return ReasonState(self.words, self.needs if at_best else "", marks)


def find_reason(snapshot: Snapshot, name: str, elsewhere: Elsewhere) -> AreaReason:
    """Find the reason for a style. This takes too long for the window's thread."""
    result = snapshot.results.get(name)
    if result is None or snapshot.paper or not isinstance(result.shortfall, AreaShortfall):
        return AreaReason()
    shortfall, head = result.shortfall, snapshot.head_for(name)
    return AreaReason(
        head,
        help_words(_diagnosis(snapshot, result, elsewhere), result),
        needs_label(shortfall),
        area_labels(shortfall),
        area_outlines(head, (shortfall.bright, shortfall.dark)),
        shortfall.value_stops < shortfall.limit_stops,
    )


def _diagnosis(snapshot: Snapshot, result: StyleResult, elsewhere: Elsewhere) -> Diagnosis:
    question = snapshot.question
    light, head, selection = question.light, question.head, question.selection
    assert light is not None
    # An unpainted copy is solved as the style that it copies.
    source = snapshot.source(result.name)
    wish = STRAIGHT
    if selection is not None and selection.lens != STRAIGHT and head.views:
        wish = selection.lens.moved(question.front_deg)
    views = [] if wish == STRAIGHT else head.views
    solve = solver_of(head.pack, views, wish, "picture", [source], question.front_deg)
    lights = _lamps_of(light, question.findings())
    own = replace(result, name=source)
    return diagnose(head.pack, lights, [own], solve, elsewhere(source)).get(source, Diagnosis())


@lru_cache(maxsize=1)
def _lamps_of(light: PlaceLight, findings: Findings) -> LampLights:
    """Return the light of each lamp, which is the same for all styles at a place."""
    return lamp_lights(light.environment, findings, light.searched_by("picture"))
