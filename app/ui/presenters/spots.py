"""The comparison of several places for one style, to find the best spot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Final

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.phrases import listed
from app.core.painting.user_style import UserStyle
from app.core.places.best_spot import rank_spots
from app.core.places.load_saved import load_place
from app.core.places.place import Place
from app.core.places.solve_place import solve_place
from app.core.portrait.gallery_portraits import greyed
from app.core.portrait.head import Head, load_head
from app.core.solver.place_light import Facing, pictures_at
from app.core.solver.solve import proposal
from app.core.solver.style_result import StyleResult
from app.core.storage.settings import Settings
from app.core.text import tr
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Presenter, Services, View
from app.words.phrases.quantities import time_words
from app.words.phrases.turns import leeway_words, turn_words
from app.words.styles import full_title
from app.words.why_out_of_reach import reason_sentence

NONE_READ: Final = tr("None of these places can be read.")
_JOB: Final = "spots"
_SIZE: Final = (256, 320)  # rows and columns of a picture; all the styles take half a second
_GRADES: Final = {
    "yes": tr("Within reach, match {match}, {leeway}"),
    "soft": tr("Soft, match {match}, {leeway}"),
    "no": tr("Out of reach, match {match}"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """A place, solved for the current head.

    Attributes:
        trouble: Reason why the place could not be read, or an empty string if it could.
        pictures: Portrait at the best turn of each style, (h, w, 3) uint8 sRGB.
    """

    folder: Path
    name: str
    time: str = ""
    results: Mapping[str, StyleResult] = field(default_factory=dict)
    pictures: Mapping[str, Bytes] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    trouble: str = ""


@dataclass(frozen=True, slots=True)
class SpotCard:
    """A spot in the comparison.

    Attributes:
        grade_words: Grade, match and leeway.
        why: Reason why the style is out of reach or why the place could not be read.
    """

    folder: Path
    name: str
    time: str
    turn: str = ""
    grade_words: str = ""
    why: str = ""
    match: float = 0.0
    best: bool = False
    picture: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class SpotsState:
    """The compared spots, best first.

    Attributes:
        styles: For each style, its key, its title and the number of places where it is within
            reach.
    """

    cards: tuple[SpotCard, ...] = ()
    styles: tuple[tuple[str, str, str], ...] = ()
    style: str = ""
    verdict: str = ""
    anywhere: str = ""


class SpotsPresenter(Presenter[View]):
    """Reads the places and ranks them for the selected style."""

    def __init__(
        self, services: Services, place_controller: PlaceController, folders: Sequence[Path]
    ) -> None:
        super().__init__(services)
        self._place_controller, self._folders = place_controller, tuple(folders)
        self._spots: tuple[Spot, ...] = ()
        self._style = services.model.chosen or ""

    def attach(self, view: View) -> None:
        """Show the comparison in `view`, and start to read the places."""
        super().attach(view)
        self._read_next()

    def detach(self) -> None:
        """Stop showing the comparison, and stop reading the places."""
        super().detach()
        self._services.runner.cancel(_JOB)

    def choose(self, style: str) -> None:
        """Compare the places for another style."""
        self._style = style
        self._refresh()

    def open(self, folder: Path) -> None:
        """Open one of the places with the style under comparison."""
        self._place_controller.open_place(folder, self.resolve().style)

    def resolve(self) -> SpotsState:
        """Return the state of the comparison."""
        values = {"number": len(self._spots) + 1, "every": len(self._folders)}
        if values["number"] <= values["every"]:
            return SpotsState(verdict=tr("Reading place {number} of {every}…", **values))
        read = [spot for spot in self._spots if spot.results]
        rest = [_card(spot, "", False) for spot in self._spots if not spot.results]
        if not read:
            return SpotsState(tuple(rest), verdict=NONE_READ)
        titles = read[0].titles
        within = {
            name: [spot.name for spot in read if spot.results[name].attainable] for name in titles
        }
        every = [one for spot in read for one in spot.results.values()]
        style = self._style if self._style in titles else proposal(every) or ""
        best, *others = (read[each] for each in rank_spots([one.results[style] for one in read]))
        return SpotsState(
            (_card(best, style, True), *(_card(spot, style, False) for spot in others), *rest),
            tuple((name, title, _where(within[name])) for name, title in titles.items()),
            style,
            _verdict(best, style),
            tr("{count} of {every} styles are within reach at one or more of these spots.",
               count=sum(map(bool, within.values())), every=len(titles)),
        )  # fmt: skip

    def _read_next(self, *read: Spot) -> None:
        self._spots = (*self._spots, *read)
        self._refresh()
        if self._view is None or len(self._spots) == len(self._folders):
            return
        folder, model = self._folders[len(self._spots)], self._services.model
        unkept, today = self._place_controller.saving.unkept(folder), self._services.today()
        head, own, settings = model.head, model.user_styles, model.settings
        self._services.runner.submit(
            _JOB,
            lambda *_: _answer(head, own, settings, today, folder, unkept),
            title=tr("Comparing spots"),
            done=self._read_next,
        )


def _answer(
    open_head: Head | None,
    own: Sequence[UserStyle],
    settings: Settings,
    today: datetime,
    folder: Path,
    unkept: Place | None,
) -> Spot:
    """Solve one place, and render the head at that place for the best turn of every style."""
    try:
        spot_place, head = (
            load_place(folder, unkept),
            open_head or load_head(settings.head, *settings.looks),
        )
    except CoreError as error:
        return Spot(folder, folder.name, trouble=error.message)
    place, light = spot_place.place, spot_place.light
    results = solve_place(head, light, own, settings, place.front_deg, place.lens)
    turns = [wrap(one.turn_refined_deg + place.front_deg) for one in results]
    origins = {one.name: one.origin for one in own}
    lights = [
        Facing(light, turn, head.expose_of(origins.get(one.name, one.name)))
        for one, turn in zip(results, turns, strict=True)
    ]
    portraits = head.portraits(pictures_at(head.transport, light, turns), _SIZE, lights)
    pictures = {
        one.name: picture if one.attainable else greyed(picture)
        for one, picture in zip(results, portraits, strict=True)
    }
    styles = {style.name: style for style in (*head.pack.styles, *(each.style for each in own))}
    titles = {one.name: full_title(styles[one.name]) for one in results}
    by_name = {one.name: one for one in results}
    return Spot(folder, place.name, time_words(place.made_at, today), by_name, pictures, titles)


def _where(names: Sequence[str]) -> str:
    if not names:
        return tr("out of reach at these spots")
    return tr("within reach at {names}", names=listed(names, 2))


def _result_words(result: StyleResult) -> str:
    grade = (result.grade or "yes") if result.attainable else "no"
    match, leeway = max(math.floor(result.match), 0), leeway_words(result.arc_deg)
    return _GRADES[grade].format(match=match, leeway=leeway)


def _card(spot: Spot, style: str, best: bool) -> SpotCard:
    result = spot.results.get(style)
    if result is None:
        return SpotCard(spot.folder, spot.name, spot.time, why=spot.trouble)
    return SpotCard(
        spot.folder, spot.name, spot.time, turn_words(result.turn_refined_deg),
        _result_words(result),
        reason_sentence(result.shortfall), result.match, best and result.attainable,
        spot.pictures[style],
    )  # fmt: skip


def _verdict(best: Spot, style: str) -> str:
    result = best.results[style]
    values = {"style": best.titles[style], "name": best.name, "why": _result_words(result)}
    if result.attainable:
        return tr("Best spot for {style}: {name}. {why}.", **values)
    values["why"] = reason_sentence(result.shortfall) or values["why"]
    return tr("No spot here works for {style}. {name} comes closest: {why}.", **values)
