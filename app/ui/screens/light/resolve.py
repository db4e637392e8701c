"""From what has been worked out to what the Light screen shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from app.core.base.angles import direction_of, whole, wrap
from app.core.base.arrays import Bytes
from app.core.second_light.captured import CapturedLamp
from app.core.second_light.lamp_presets import (
    NumbersLamp,
    part_of,
)
from app.core.second_light.placements import direction
from app.core.second_light.search import LampPlacement
from app.core.solver.place_light import main_light
from app.core.solver.shortfall import Cause, LensShortfall, LightShortfall
from app.core.solver.turn_choice import LIMITS
from app.core.styles.styles import Style
from app.core.text import tr
from app.ui.screens.light.pictures import (
    Answers,
    Lamp,
    LampPosition,
    LampView,
    Nearer,
    best_held,
    powers_for,
    sky_of,
)
from app.ui.screens.light.state import (
    HeadsState,
    HoldState,
    LampDetailState,
    RowState,
    Section,
    SkyState,
    Verdict,
)
from app.ui.screens.styles.cards import side_line
from app.ui.screens.styles.gallery import ValueCache
from app.words.lamps import lamp_title, power_share, power_words, stops_down
from app.words.phrases.directions import lens_words, light_words, lit_aside_words, placement_words
from app.words.phrases.quantities import contrast_words, metres, upper_first
from app.words.phrases.turns import signed, turn_words
from app.words.shortfall import reason_line, reason_sentence, too_soft_words
from app.words.verdict import whole_of

GAIN: Final = 10
"""By so much a style in reach has to gain for the lamp to be worth while."""

_FRONT_DEG: Final = 20.0
_SAME_DEG: Final = 1
_AT_BEST_DEG: Final = 0.5

# Keyed by whether it moves around the head, whether it rises (1) or sinks (-1), and whether its
# power changes.
_MOVES: Final = {
    (False, 0, False): tr("The lamp is there."),
    (False, 1, False): tr("Raise the lamp by {up}."),
    (False, -1, False): tr("Lower the lamp by {up}."),
    (False, 0, True): tr("Set the lamp to {power}."),
    (False, 1, True): tr("Raise the lamp by {up} and set it to {power}."),
    (False, -1, True): tr("Lower the lamp by {up} and set it to {power}."),
    (True, 0, False): tr("Move the lamp {across} {way}."),
    (True, 1, False): tr("Move the lamp {across} {way} and raise it by {up}."),
    (True, -1, False): tr("Move the lamp {across} {way} and lower it by {up}."),
    (True, 0, True): tr("Move the lamp {across} {way} and set it to {power}."),
    (True, 1, True): tr("Move the lamp {across} {way}, raise it by {up} and set it to {power}."),
    (True, -1, True): tr("Move the lamp {across} {way}, lower it by {up} and set it to {power}."),
}


def lamp_words(title: str) -> str:
    """Name a lamp within a sentence.

    Examples:
        >>> lamp_words("Phone screen"), lamp_words("LED panel")
        ('phone screen', 'LED panel')
    """
    return title if title[1:2].isupper() else title[:1].lower() + title[1:]


def lamp_name(lamp: Lamp) -> str:
    """Name the lamp in hand within a sentence: "the LED panel", or its own name."""
    if isinstance(lamp, CapturedLamp):
        return f"“{lamp.title}”"
    return tr("the {lamp}", lamp=lamp_words(lamp_title(lamp.kind)))


def turn_title(turn_deg: float) -> str:
    """Write the first step: "Turn 56° counter-clockwise"."""
    if whole(turn_deg) == 0:
        return tr("No turn needed")
    return tr("Turn {turn}", turn=turn_words(turn_deg))


def go_words(turn_deg: float) -> str:
    """Write what the button does that leads on: there may be no turn to make."""
    return tr("Hold it now") if whole(turn_deg) == 0 else tr("Turn first")


def way_icon(turn_deg: float) -> str:
    """Give the icon that shows which way round a turn goes."""
    return {"clockwise": "clockwise", "counter-clockwise": "counterclockwise"}.get(
        direction_of(turn_deg), "bulb"
    )


def place_words(azimuth_deg: float | None) -> str:
    """Say from where the place lights the face after the turn.

    `azimuth_deg`: relative to the face, positive toward the sitter's left; None for all around.
    """
    if azimuth_deg is None:
        return tr("The light of the place then comes from all around.")
    away = abs(azimuth_deg)
    if away < _FRONT_DEG:
        return tr("The place then lights the face from in front.")
    if away > 180.0 - _FRONT_DEG:
        return tr("The place then lights the sitter from behind.")
    if azimuth_deg > 0:
        return tr("The place then lights the sitter’s left (camera right).")
    return tr("The place then lights the sitter’s right (camera left).")


def move_words(now: LampPosition, best: LampPosition, kind: str = "") -> str:
    """Say how the lamp gets from where it is held to its best place and power.

    Args:
        now, best: Azimuth toward the sitter's left and altitude, deg, and power.

    Examples:
        >>> from app.ui.screens.light.pictures import Held, Lamp
        >>> move_words(Held(107.0, 20.0), Held(107.2, 0.0))
        'Lower the lamp by 20°.'
        >>> move_words(Held(107.0, 0.0, 1.0), Held(80.0, 5.0, 0.5))
        'Move the lamp 27° toward the camera, raise it by 5° and set it to half power.'
    """
    across = whole(wrap(best.azimuth_deg - now.azimuth_deg))
    up = whole(best.altitude_deg) - whole(now.altitude_deg)
    power = tr("{share} power", share=power_share(best.power, kind))
    if part_of(best.power, kind) == 2:
        power = tr("half power")
    return _MOVES[across != 0, (up > 0) - (up < 0), now.power != best.power].format(
        across=f"{abs(across)}°",
        way=_way(now.azimuth_deg, best.azimuth_deg),
        up=f"{abs(up)}°",
        power=power,
    )


def _way(now_deg: float, best_deg: float) -> str:
    """Name the way around the head: forward or back, or to the other side."""
    if now_deg * best_deg < 0 or abs(now_deg) < _SAME_DEG:
        if best_deg > 0:
            return tr("to the sitter’s left (camera right)")
        return tr("to the sitter’s right (camera left)")
    return tr("toward the camera") if abs(best_deg) < abs(now_deg) else tr("toward the back")


@dataclass(frozen=True, slots=True, eq=False)
class LampResult:
    """What is in front: a style, and the lamp where it is held."""

    answers: Answers
    one: LampPlacement
    position: LampPosition
    distance_m: float
    newest: LampView | None = None
    lens: LampPlacement | None = None

    @property
    def at_best(self) -> bool:
        """Whether the lamp is at its best place and power, as far as whole degrees show."""
        best, position = best_held(self.one), self.position
        across = abs(wrap(position.azimuth_deg - best.azimuth_deg))
        near = (
            across < _AT_BEST_DEG and abs(position.altitude_deg - best.altitude_deg) < _AT_BEST_DEG
        )
        return near and position.power == best.power

    @property
    def view(self) -> LampView | None:
        """The newest pictures, where they are of this style and of these answers."""
        view = self.newest
        is_current = (
            view is not None and view.answers is self.answers and view.name == self.one.name
        )
        return view if is_current else None

    @property
    def match(self) -> float | None:
        """Match with the lamp where it is held; None while that is worked out."""
        if self.at_best:
            return self.one.match
        view = self.view
        return view.match if view is not None and view.position == self.position else None

    @property
    def dims(self) -> bool:
        """Whether the lamp has more than one power."""
        return len(powers_for(self.answers)) > 1

    @property
    def spot(self) -> tuple[str, str, str]:
        """Where the lamp is held: direction in words, distance from head and from skin."""
        place = direction(*self.position[:2]) * self.distance_m
        skin = self.answers.hand.shape.distance_to_skin(place)
        azimuth, altitude = (float(whole(angle)) for angle in self.position[:2])
        where = placement_words(azimuth, altitude)
        return where, metres(self.distance_m), metres(skin, rough=True)


def rescued(placements: Sequence[LampPlacement]) -> tuple[LampPlacement, ...]:
    """Give the styles that only the lamp brings within reach, the best first."""
    winners = [one for one in placements if one.attainable and not one.before.attainable]
    return tuple(sorted(winners, key=lambda one: -one.match))


def better(placements: Sequence[LampPlacement]) -> tuple[LampPlacement, ...]:
    """Give the styles in reach that the lamp makes clearly better, the best gain first."""
    winners = [one for one in placements if one.before.attainable and _gain(one) >= GAIN]
    return tuple(sorted(winners, key=lambda one: (-_gain(one), -one.match)))


def _gain(one: LampPlacement) -> int:
    return whole_of(one.match) - whole_of(one.before.match)


def front_of(answers: Answers, style_name: str | None) -> LampPlacement | None:
    """Give the style to show: the chosen one, unless a lamp has more to say about another."""
    candidates = (*rescued(answers.placements), *better(answers.placements))
    one = answers.of(style_name)
    if one is not None and (not one.before.attainable or one in candidates):
        return one
    return candidates[0] if candidates else one or next(iter(answers.placements), None)


class Resolver:
    """Makes the parts of the state; keeps what does not depend on where the lamp is held."""

    def __init__(self) -> None:
        self._cache = ValueCache()

    def sections(
        self, result: LampResult, pictures: Mapping[str, Bytes], version: int
    ) -> tuple[Section, ...]:
        """Make the list; parts without any style are left out, but for the first."""
        answers, front = result.answers, result.one.name
        return self._cache.once(
            "sections",
            (front, version),
            answers,
            lambda: _sections(answers, front, pictures, version),
        )

    def sky(self, result: LampResult) -> SkyState:
        """Make the map of the style in front."""
        question = result.answers.question
        limit = LIMITS.match if question.objective == "picture" else None
        one = result.one
        return self._cache.once(
            "sky", one.name, result.answers, lambda: sky_of(one.map, limit, result.answers.is_open)
        )

    def heads(self, result: LampResult) -> HeadsState:
        """Draw the lamp around the head."""
        question, one = result.answers.question, result.one
        facing = wrap(one.turn_refined_deg + question.front_deg)
        coming = self._cache.once(
            "coming", facing, question.light, lambda: main_light(question.light, facing)
        )
        where, far, skin = result.spot
        return HeadsState(
            shape=result.answers.hand.shape,
            distance_m=result.distance_m,
            azimuth_deg=result.position.azimuth_deg,
            altitude_deg=result.position.altitude_deg,
            best=best_held(one)[:2],
            place_light_deg=coming,
            spoken=tr(
                "{where}, {distance} from the middle of the head, about {skin} from the skin",
                where=where,
                distance=far,
                skin=skin,
            ),
        )


def _sections(
    answers: Answers, front: str | None, pictures: Mapping[str, Bytes], version: int
) -> tuple[Section, ...]:
    placements = answers.placements
    styles = {style.name: style for style in answers.hand.head.pack.styles}
    out = sum(not one.before.attainable for one in placements)
    rescues, gains = rescued(placements), better(placements)
    hopeless = (one for one in placements if not (one.before.attainable or one.attainable))
    rest = sorted(hopeless, key=lambda one: -one.match)
    parts = (
        (tr("Now possible with this lamp"), tr("now possible with this lamp"), rescues, out),
        (tr("Better with it"), tr("better with this lamp"), gains, len(placements) - out),
        (tr("Still out of reach"), tr("still out of reach"), rest, out),
    )

    def row(one: LampPlacement, how: str) -> RowState:
        state = _row(one, styles[one.name], how, answers)
        picture = pictures.get(one.name)
        return replace(state, version=version, picture=picture, chosen=one.name == front)

    return tuple(
        Section(
            title,
            tr("{number} of {count}", number=len(members), count=count),
            tuple(row(one, how) for one in members),
        )
        for number, (title, how, members, count) in enumerate(parts)
        if members or (out and not number)
    )


def _row(one: LampPlacement, style: Style, how: str, answers: Answers) -> RowState:
    kind = _kind(answers)
    before, after = whole_of(one.before.match), whole_of(one.match)
    side = side_line(style)
    why = "" if one.attainable else reason_line(one.shortfall)
    if isinstance(one.shortfall, LightShortfall) and one.shortfall.cause is Cause.WEAK_LAMP:
        # Said once for all; but a match that is enough must not stand here without a word.
        soft = too_soft_words(one.strength, LIMITS.strength)
        why = soft if one.grade is None and one.match >= LIMITS.match else ""
    dims = kind and len(powers_for(answers)) > 1
    power = tr("{share} power", share=power_share(one.power, kind)) if dims else ""
    values = {
        "title": style.title,
        "side": side,
        "before": before,
        "after": after,
        "power": power,
        "how": how,
    }
    return RowState(
        key=one.name,
        title=style.title,
        line=why or side,
        before=before,
        after=after,
        limit=LIMITS.match,
        power=power,
        spoken=tr(
            "{title}, {side}, match {before} without the lamp, {after} with it at {power}, {how}",
            **values,
        )
        if power
        else tr(
            "{title}, {side}, match {before} without the lamp, {after} with it, {how}", **values
        ),
    )


def hold_of(result: LampResult, heads: HeadsState) -> HoldState:
    """Write the two steps."""
    turn, kind = result.one.turn_refined_deg, _kind(result.answers)
    name = lamp_name(result.answers.hand.lamp)
    where, far, skin = result.spot
    hold = tr("Hold {lamp} {where}", lamp=name, where=where)
    if result.dims:
        power = power_words(result.position.power, kind)
        hold = tr("Hold {lamp} {where}, {power}", lamp=name, where=where, power=power)
    map_title = tr("Where this lamp works at this turn")
    if result.position.power != result.one.power:
        # The map is of another power than the lamp is held at.
        power = power_words(result.one.power, kind)
        map_title = tr("Where this lamp works at this turn {at_power}", at_power=power)
    line = tr(
        "{distance} from the middle of the head, about {skin} from the skin.",
        distance=far,
        skin=skin,
    )
    if result.lens is not None and result.lens.yaw_deg:
        line = f"{line} {lens_words(result.lens.yaw_deg)}."
    return HoldState(
        turn=turn_title(turn),
        turn_line=place_words(heads.place_light_deg),
        turn_works=True,
        go=go_words(turn),
        go_icon=way_icon(turn),
        hold=hold,
        hold_line=line,
        map_title=map_title,
    )


def _lens(result: LampResult) -> str:
    """Say from where the lens sees the style best with the lamp at its best place."""
    lens = result.lens
    if lens is None:
        return ""
    if isinstance(lens.shortfall, LensShortfall):
        return f"{reason_sentence(lens.shortfall)}."
    words = upper_first(lit_aside_words(lens.yaw_deg, lens.lighting)) or tr("Face to the lens")
    there = tr("The lamp is there.")
    return f"{there} " + tr("{aside}: match {match}.", aside=words, match=whole_of(lens.match))


def detail_of(result: LampResult) -> LampDetailState:
    """Show the style in front with the lamp where it is held."""
    one, view, position, kind = result.one, result.view, result.position, _kind(result.answers)
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
    # At the best place, the numbers of the list.
    source: LampPlacement | LampView = one if result.at_best else view
    match, strength = source.match, source.strength
    verdict, words = verdict_at(match, strength)
    if source.grade is not None:
        verdict, words = ("in" if source.attainable else "out"), _GRADED[source.grade]
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
    "nearly": tr("nearly in reach"),
    "no": tr("out of reach"),
}


def verdict_at(match: float, strength: float) -> tuple[Verdict, str]:
    """Say whether a style is in reach at a match and a strength."""
    if match < LIMITS.match:
        return "out", tr("out of reach, under {limit:.0f}", limit=LIMITS.match)
    if strength < LIMITS.strength:
        return "out", tr(
            "too soft: strength {strength}, needs {least:.0f}",
            strength=whole_of(strength),
            least=LIMITS.strength,
        )
    return "in", tr("in reach, over {limit:.0f}", limit=LIMITS.match)


def note_of(
    answers: Answers, distance_m: float, busy: bool, coming_closer: bool, nearer: Nearer | None
) -> tuple[str, str]:
    """Say what the list alone does not: sentences, and the words of a button; maybe empty."""
    if all(one.before.attainable for one in answers.placements):
        return tr("Every style is in reach here. A lamp can still make some better."), ""
    if rescued(answers.placements) or busy:
        return "", ""
    if not answers.is_open.all():
        return tr("No style becomes possible from where you can hold it. Allow more places."), ""
    weak = tr("This lamp is too weak at {distance}.", distance=metres(distance_m))
    if coming_closer:
        return weak, ""
    if nearer is None:
        return " ".join((weak, tr("Try a stronger one."))), ""
    name, match = lamp_words(nearer.one.title), whole_of(nearer.one.match)
    near = metres(nearer.distance_m)
    values = {"near": near, "style": name, "match": match}
    if nearer.one.attainable:
        brings = tr("At {near} it brings {style} to {match}.", **values)
        return f"{weak} {brings}", tr("Hold it at {near}", near=near)
    beyond = tr("{style} is out of reach even at {near}.", **values)
    return f"{weak} {beyond}", ""


def _kind(answers: Answers) -> str:
    lamp = answers.hand.lamp
    return lamp.kind if isinstance(lamp, NumbersLamp) else ""
