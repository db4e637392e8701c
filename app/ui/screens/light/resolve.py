"""From what has been worked out to what the Light screen shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.second_light.lamp_presets import NumbersLamp, power_share, power_words, stops_words
from app.core.second_light.placements import (
    ALTITUDES_DEG,
    AZIMUTHS_DEG,
    direction,
    metres,
    placement_words,
)
from app.core.solver.reach import Limits
from app.core.text.turns import side_words, signed, turn_words, whole
from app.ui.screens.light.state import DetailState, HeadsState, HoldState, Section, SkyState
from app.ui.screens.light.words import (
    better,
    go_words,
    lamp_name,
    move_words,
    place_words,
    rescued,
    sections_of,
    turn_title,
    verdict_at,
    way_icon,
    weak_words,
    without_tag,
)
from app.ui.screens.light.work import best_held, main_light, powers_for
from app.ui.screens.styles.gallery import whole_of

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping

    from app.core.second_light.search import Placed
    from app.core.solver.reach import Limits
    from app.ui.screens.light.jobs import LightWork
    from app.ui.screens.light.pictures import View
    from app.ui.screens.light.state import Bytes
    from app.ui.screens.light.work import Answers, Held


Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_FINER: Final = 4
_DARKEST: Final = 28  # tones of the map, sRGB
_BRIGHTEST: Final = 242
_CURVE: Final = 1.4  # so that the best places stand out
_ROWS: Final = len(ALTITUDES_DEG)
_COLUMNS: Final = len(AZIMUTHS_DEG)


def sky_of(
    values: NDArray[np.floating[Any]],
    limit: float | None,
    allowed: NDArray[np.bool_] | None = None,
) -> SkyState:
    """Draw up the map.

    Parameters
    ----------
    values : (9, 64) float
        Objective at one turn: altitudes upward, azimuths from in front toward the sitter's left.
    limit : float or None
        Where the line runs; None for no line.
    allowed : (576,) bool or None, optional
        Placements that can be reached.
    """
    # Left to right −180 to 180: the sitter's right, in front, the sitter's left.
    around = np.roll(np.asarray(values, np.float64), _COLUMNS // 2, axis=1)
    fine, azimuths, altitudes = _finer(around)
    low = max(float(around.min()), 0.0)
    high = max(float(around.max()), low + 1e-9, limit or 0.0)
    share = np.clip((fine - low) / (high - low), 0.0, 1.0) ** _CURVE
    tones = (_DARKEST + share * (_BRIGHTEST - _DARKEST) + 0.5).astype(np.uint8)
    line = np.zeros((0, 4), np.float32)
    if limit is not None:
        line = _line(fine - limit, azimuths, altitudes)
    closed = None
    if allowed is not None and not allowed.all():
        shut = np.roll(~allowed.reshape(_ROWS, _COLUMNS), _COLUMNS // 2, axis=1)
        # Texels of a placement lie around it: half of the first column is at the right end.
        closed = np.ascontiguousarray(np.roll(np.repeat(shut, 2, axis=1), -1, axis=1)[::-1])
    words = "brighter is better" if limit is None else "brighter is a better match"
    if limit is not None:
        words += f", the line is {limit:.0f}"
    if closed is not None:
        words += ", hatched is out of reach"
    half = float(ALTITUDES_DEG[-1]) + float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0]) / 2.0
    return SkyState(np.ascontiguousarray(tones[::-1]), closed, line, half, words)


def _finer(values: Float64) -> tuple[Float64, Float64, Float64]:
    """Read the map between placements: texels' azimuths from −180 on, altitudes upward, deg."""
    step, rise = 360.0 / _COLUMNS, float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0])
    fine_columns = _FINER * 2 * _COLUMNS
    azimuths = -180.0 + (np.arange(fine_columns) + 0.5) * 360.0 / fine_columns
    across = (azimuths + 180.0) / step
    fine_rows = _FINER * 2 * _ROWS
    lowest = float(ALTITUDES_DEG[0]) - rise / 2.0
    altitudes = lowest + (np.arange(fine_rows) + 0.5) * rise * _ROWS / fine_rows
    up = np.clip((altitudes - float(ALTITUDES_DEG[0])) / rise, 0.0, _ROWS - 1.0)
    wrapped = _cubic(np.concatenate([values[:, -1:], values, values[:, :2]], axis=1).T, across + 1)
    held = np.concatenate([wrapped[:, :1], wrapped, wrapped[:, -1:]], axis=1)
    return _cubic(held.T, up + 1.0), azimuths, altitudes


def _cubic(values: Float64, places: Float64) -> Float64:
    """Read (n, m) along its first axis at places in [1, n - 2], by Catmull-Rom's curve."""
    first = np.clip(np.floor(places).astype(np.intp), 1, len(values) - 3)
    t = (places - first)[:, None]
    a, b, c, d = (values[first + offset] for offset in (-1, 0, 1, 2))
    curved: Float64 = b + 0.5 * t * (
        c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))
    )
    return curved


def _line(over: Float64, azimuths: Float64, altitudes: Float64) -> Float32:
    """Pieces of the line where a map is 0: two triangles to each cell, one piece to each."""
    x, y = np.meshgrid(azimuths, altitudes)
    corners = [
        tuple(part[rows, columns].ravel() for part in (x, y, over))
        for rows, columns in (
            (slice(None, -1), slice(None, -1)),
            (slice(None, -1), slice(1, None)),
            (slice(1, None), slice(1, None)),
            (slice(1, None), slice(None, -1)),
        )
    ]
    pieces = [
        _through(corners[0], corners[1], corners[2]),
        _through(corners[0], corners[2], corners[3]),
    ]
    return np.concatenate(pieces).astype(np.float32)


def _through(*corners: tuple[Float64, ...]) -> Float64:
    """Cut triangles, each corner (x, y, value): (n, 4) pieces where the value is 0."""
    above = np.stack([corner[2] >= 0 for corner in corners])
    count = above.sum(axis=0)
    cut = np.flatnonzero((count == 1) | (count == 2))
    # The corner that stands alone is joined to both others.
    alone = np.argmax(np.where(count[cut] == 1, above[:, cut], ~above[:, cut]), axis=0)
    values = np.stack([np.stack(corner) for corner in corners])[:, :, cut]
    index = np.arange(len(cut))
    start = values[alone, :, index]
    ends = []
    for step in (1, 2):
        stop = values[(alone + step) % 3, :, index]
        share = start[:, 2] / (start[:, 2] - stop[:, 2])
        ends.append(start[:, :2] + (stop[:, :2] - start[:, :2]) * share[:, None])
    return np.concatenate(ends, axis=1)


T = TypeVar("T")

_SAME_DEG: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """What is in front."""

    answers: Answers
    one: Placed
    held: Held
    distance_m: float
    view: View | None = None

    @property
    def at_best(self) -> bool:
        """Whether the lamp is at its best place and power, as far as whole degrees show."""
        best, held = best_held(self.one), self.held
        across = abs(wrap(held.azimuth_deg - best.azimuth_deg))
        near = across < _SAME_DEG and abs(held.altitude_deg - best.altitude_deg) < _SAME_DEG
        return near and held.power == best.power


def front_of(answers: Answers, chosen: str | None) -> Placed | None:
    """Give the style to show: the chosen one, unless a lamp has more to say about another."""
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
                answers.placed,
                styles,
                pictures,
                limits_of(answers),
                front,
                version,
                _power_of_rows(answers),
            ),
        )

    def sky(self, shown: Shown) -> SkyState:
        """Make the map of the style in front."""
        question = shown.answers.question
        limit = question.limits.match if question.objective == "picture" else None
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
            azimuth_deg=shown.held.azimuth_deg,
            altitude_deg=shown.held.altitude_deg,
            best=best_held(one)[:2],
            place_light_deg=coming,
            spoken=hold_words(shown),
        )

    def hold(self, shown: Shown, heads: HeadsState) -> HoldState:
        """Write the two steps."""
        turn = shown.one.turn_refined_deg
        name = lamp_name(shown.answers.hand.lamp)
        *where, far, skin = heads.spoken.split(", ")
        return HoldState(
            turn=turn_title(turn),
            turn_line=place_words(heads.place_light_deg),
            turn_works=True,
            go=go_words(turn),
            go_icon=way_icon(turn),
            hold=f"Hold {name} {', '.join(where)}{_power_words(shown)}",
            hold_line=f"{far[:1].upper()}{far[1:]}, {skin}.",
            map_title=f"Where this lamp works at this turn{_map_power(shown)}",
        )

    def detail(self, shown: Shown) -> DetailState:
        """Show the style in front with the lamp where it is held."""
        one, view = shown.one, shown.view
        style = shown.answers.hand.head.pack.styles[shown.answers.hand.head.pack.index(one.name)]
        best = best_held(one)
        powers = powers_for(shown.answers)
        state = DetailState(
            key=one.name,
            title=style.title,
            side=side_words(style.side, style.place) or "Painted",
            without_tag=without_tag(one.before.turn_refined_deg),
            before=str(whole_of(one.before.match)),
            best_title=f"Best place: {whole_of(one.match)}",
            best_line="" if shown.at_best else move_words(shown.held, best, _kind(shown)),
            at_best=shown.at_best,
            numbers=self._numbers(shown),
            power=_power_line(shown),
            weaker=shown.held.power > powers[-1],
            stronger=shown.held.power < powers[0],
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
            stale=view.held != shown.held,
        )

    def match(self, shown: Shown) -> float | None:
        """Give the match with the lamp where it is held; None while that is worked out."""
        view = shown.view
        known = view is not None and view.answers is shown.answers and view.name == shown.one.name
        if shown.at_best:
            return shown.one.match
        return view.match if view is not None and known and view.held == shown.held else None

    def _numbers(self, shown: Shown) -> tuple[tuple[str, str], ...]:
        one, view = shown.one, shown.view
        rows = [
            ("Turn", turn_words(one.turn_refined_deg)),
            ("Lamp azimuth", signed(shown.held.azimuth_deg)),
            ("Lamp altitude", signed(shown.held.altitude_deg)),
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
    place = direction(*shown.held[:2]) * shown.distance_m
    skin = shown.answers.hand.shape.distance_to_skin(place)
    azimuth, altitude = (float(whole(angle)) for angle in shown.held[:2])
    words = placement_words(azimuth, altitude, shown.distance_m, skin)
    return words.replace("'", "’")


def note_of(answers: Answers, work: LightWork, distance_m: float) -> tuple[str, str]:
    """Say what the list alone does not.

    Returns
    -------
    str, str
        Sentences, and the words of a button; both may be empty.
    """
    if all(one.before.attainable for one in answers.placed):
        return "Every style is in reach here. A lamp can still make some better.", ""
    if rescued(answers.placed) or work.busy:
        return "", ""
    if not answers.allowed.all():
        return "Nothing is rescued from where you can hold it. Allow more places.", ""
    if work.coming_closer:
        return f"This lamp is too weak at {metres(distance_m)}.", ""
    known = work.nearer
    if known is None:
        return weak_words(distance_m, None, 0.0)
    return weak_words(distance_m, known.one, known.distance_m)


def limits_of(answers: Answers) -> Limits:
    """Give the limits of reach that answers were asked with."""
    return answers.question.limits


def _reading(shown: Shown, view: View) -> tuple[float, float]:
    """Match and strength where the lamp is; at the best place those of the list."""
    one = shown.one
    return (one.match, one.strength) if shown.at_best else (view.match, view.strength)


def _kind(shown: Shown) -> str:
    lamp = shown.answers.hand.lamp
    return lamp.kind if isinstance(lamp, NumbersLamp) else ""


def _power_words(shown: Shown) -> str:
    """How far the lamp is turned down, for the end of a sentence; empty where it cannot be."""
    if len(powers_for(shown.answers)) < 2:
        return ""
    return f", {power_words(shown.held.power, _kind(shown))}"


def _map_power(shown: Shown) -> str:
    """Power that the map is of; said where the lamp is held at another."""
    if shown.held.power == shown.one.power:
        return ""
    return f" {power_words(shown.one.power, _kind(shown))}"


def _power_line(shown: Shown) -> str:
    if len(powers_for(shown.answers)) < 2:
        return ""
    share, stops = (tell(shown.held.power, _kind(shown)) for tell in (power_share, stops_words))
    return f"{share}, {stops}" if stops else share


def _power_of_rows(answers: Answers) -> Callable[[Placed], str]:
    """Give the function that writes the power of each row."""
    lamp = answers.hand.lamp
    if len(powers_for(answers)) < 2 or not isinstance(lamp, NumbersLamp):
        return lambda one: ""
    kind = lamp.kind
    return lambda one: f"{power_share(one.power, kind)} power"
