"""From what has been worked out to what the Light screen shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, TypeVar

from app.core.angles import wrap
from app.core.reasons import Limits
from app.core.second_light.captured import CapturedLamp
from app.core.second_light.placements import direction
from app.core.second_light.words import placement_words
from app.core.turning.words import side_words, signed, turn_words, whole
from app.ui.presenters.light_sky import sky_of
from app.ui.presenters.light_state import DetailState, HeadsState, HoldState, Section, SkyState
from app.ui.presenters.light_words import (
    better,
    lamp_words,
    move_words,
    place_words,
    rescued,
    sections_of,
    turn_title,
    verdict_at,
    without_tag,
)
from app.ui.presenters.light_work import best_spot, main_light
from app.ui.presenters.styles_gallery import whole_of

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping

    from app.core.second_light.search import Placed
    from app.ui.presenters.light_pictures import View
    from app.ui.presenters.light_state import Bytes
    from app.ui.presenters.light_work import Answers, Spot

__all__ = ["Resolver", "Shown", "front_of"]

T = TypeVar("T")

_SAME_DEG: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """What is in front.

    Attributes
    ----------
    answers : Answers
        For the lamp in hand.
    one : Placed
        Of the style in front.
    spot : Spot
        Where the lamp is held.
    distance_m : float
        Where it is held, as the slider has it by now.
    view : View or None
        The newest pictures, maybe of another spot or style.
    """

    answers: Answers
    one: Placed
    spot: Spot
    distance_m: float
    view: View | None = None

    @property
    def at_best(self) -> bool:
        """Whether the lamp is at its best place, as far as whole degrees show."""
        best = best_spot(self.one)
        across = abs(wrap(self.spot[0] - best[0]))
        return across < _SAME_DEG and abs(self.spot[1] - best[1]) < _SAME_DEG


def front_of(answers: Answers, chosen: str | None) -> Placed | None:
    """Give the style to show: the chosen one, unless a lamp has more to say about another.

    Parameters
    ----------
    answers : Answers
        For all styles.
    chosen : str or None
        The style in front on every screen.
    """
    listed = (*rescued(answers.placed), *better(answers.placed))
    one = answers.of(chosen)
    if one is not None and (not one.before.attainable or one in listed):
        return one
    return listed[0] if listed else one or next(iter(answers.placed), None)


class Resolver:
    """Makes the parts of the state; keeps what does not depend on where the lamp is held."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[Hashable, object, Any]] = {}

    def sections(
        self, answers: Answers, front: str | None, pictures: Mapping[str, Bytes], version: int
    ) -> tuple[Section, ...]:
        """Make the list."""
        styles = {style.name: style for style in answers.hand.head.pack.styles}
        return self._once(
            "sections",
            (front, version),
            answers,
            lambda: sections_of(
                answers.placed, styles, pictures, limits_of(answers), front, version
            ),
        )

    def sky(self, shown: Shown) -> SkyState:
        """Make the map of the style in front."""
        question = shown.answers.question
        limit = question.epsilon if question.objective == "picture" else None
        one = shown.one
        return self._once(
            "sky", one.name, shown.answers, lambda: sky_of(one.map, limit, shown.answers.allowed)
        )

    def heads(self, shown: Shown) -> HeadsState:
        """Draw the lamp around the head."""
        question, one = shown.answers.question, shown.one
        facing = wrap(one.turn_refined_deg + question.front_deg)
        coming = self._once(
            "coming", facing, question.light, lambda: main_light(question.light, facing)
        )
        return HeadsState(
            shape=shown.answers.hand.shape,
            distance_m=shown.distance_m,
            azimuth_deg=shown.spot[0],
            altitude_deg=shown.spot[1],
            best=best_spot(one),
            place_light_deg=coming,
            spoken=hold_words(shown),
        )

    def hold(self, shown: Shown, heads: HeadsState) -> HoldState:
        """Write the two steps."""
        turn = shown.one.turn_refined_deg
        lamp = shown.answers.hand.lamp
        own = isinstance(lamp, CapturedLamp)
        name = f"“{lamp.title}”" if own else f"the {lamp_words(lamp.title)}"
        *where, far, skin = heads.spoken.split(", ")
        return HoldState(
            turn=turn_title(turn),
            turn_line=place_words(heads.place_light_deg),
            turn_works=True,
            hold=f"Hold {name} {', '.join(where)}",
            hold_line=f"{far[:1].upper()}{far[1:]}, {skin}.",
        )

    def detail(self, shown: Shown) -> DetailState:
        """Show the style in front with the lamp where it is held."""
        one, view = shown.one, shown.view
        style = shown.answers.hand.head.pack.styles[shown.answers.hand.head.pack.index(one.name)]
        best = best_spot(one)
        state = DetailState(
            key=one.name,
            title=style.title,
            side=side_words(style.side, style.place) or "Painted",
            without_tag=without_tag(one.before.turn_refined_deg),
            before=str(whole_of(one.before.match)),
            best_title=f"Best place: {whole_of(one.match)}",
            best_line="" if shown.at_best else move_words(shown.spot, best),
            at_best=shown.at_best,
            numbers=self._numbers(shown),
        )
        if view is None or view.answers is not shown.answers or view.name != one.name:
            return replace(state, stale=True)
        match, strength = _reading(shown, view)
        verdict, words = verdict_at(match, strength, limits_of(shown.answers))
        return replace(
            state,
            target=view.target,
            with_lamp=view.with_lamp,
            without=view.without,
            after=str(whole_of(match)),
            verdict=verdict,
            verdict_words=words,
            stale=view.spot != shown.spot,
        )

    def _numbers(self, shown: Shown) -> tuple[tuple[str, str], ...]:
        one, view = shown.one, shown.view
        rows = [
            ("Turn", turn_words(one.turn_refined_deg)),
            ("Lamp azimuth", signed(shown.spot[0])),
            ("Lamp altitude", signed(shown.spot[1])),
        ]
        if view is not None and view.answers is shown.answers and view.name == one.name:
            rows.append(("Strength", str(whole_of(_reading(shown, view)[1]))))
        return tuple(rows)

    def _once(self, what: str, key: Hashable, owner: object, make: Callable[[], T]) -> T:
        known = self._kept.get(what)
        if known is None or known[0] != key or known[1] is not owner:
            known = (key, owner, make())
            self._kept[what] = known
        made: T = known[2]
        return made


def hold_words(shown: Shown) -> str:
    """Write where the lamp is held."""
    place = direction(*shown.spot) * shown.distance_m
    skin = shown.answers.hand.shape.distance_to_skin(place)
    azimuth, altitude = (float(whole(angle)) for angle in shown.spot)
    words = placement_words(azimuth, altitude, shown.distance_m, skin)
    return words.replace("'", "’")


def limits_of(answers: Answers) -> Limits:
    """Give the limits of reach that answers were asked with."""
    return Limits(answers.question.epsilon, answers.question.min_strength)


def _reading(shown: Shown, view: View) -> tuple[float, float]:
    """Match and strength where the lamp is; at the best place those of the list."""
    one = shown.one
    return (one.match, one.strength) if shown.at_best else (view.match, view.strength)
