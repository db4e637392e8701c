"""Several places side by side for one style: which spot is best."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.progress import Token
from app.core.painting.user_style import UserStyle
from app.core.solver.best_spot import rank_spots
from app.core.solver.place_light import pictures_at, turned
from app.core.solver.portraits import framing, greyed, portraits, skin_gains
from app.core.solver.solve import StyleResult, proposal
from app.core.storage.settings import Settings
from app.core.text import tr
from app.core.text.quantities import listed, time_words
from app.core.text.turns import leeway_words, turn_words
from app.ui.presenters.heads import Head, load_head
from app.ui.presenters.place_controller import solve_place
from app.ui.presenters.place_loader import read_kept
from app.ui.presenters.services import Presenter, Services, View

if TYPE_CHECKING:
    from app.core.storage.places.place import Place
    from app.ui.presenters.place_controller import PlaceController

_JOB: Final = "spots"
_SIZE: Final = (320, 400)  # of a picture, rows and columns
_GRADES: Final = {
    "yes": tr("In reach, match {match}, {leeway}"),
    "nearly": tr("Nearly, match {match}, {leeway}"),
    "no": tr("Out of reach, match {match}"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """One of the places, answered for the head that is lit now.

    `pictures`: By style, (h, w, 3) sRGB, at its best turn.
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
    """What is shown of one place.

    `told`: Grade, match and leeway in words; `why`: what is wrong with it, or "".
    """

    folder: Path
    name: str
    time: str
    turn: str = ""
    told: str = ""
    why: str = ""
    match: float | None = None
    best: bool = False
    picture: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class SpotsState:
    """What the comparison shows.

    `styles`: Key, title, and where each is in reach.
    """

    cards: tuple[SpotCard, ...] = ()
    styles: tuple[tuple[str, str, str], ...] = ()
    style: str = ""
    verdict: str = ""
    anywhere: str = ""
    busy: str = ""


class SpotsPresenter(Presenter[View]):
    """Reads the places one after the other; then the best for the style stands first."""

    def __init__(
        self, services: Services, desk: PlaceController, folders: Sequence[tuple[Path, str]]
    ) -> None:
        super().__init__(services)
        self._desk, self._folders = desk, tuple(folders)
        self._spots: tuple[Spot, ...] = ()
        self._style = services.model.chosen or ""

    def attach(self, view: View) -> None:
        """Show the comparison in `view` from now on, and begin to read."""
        super().attach(view)
        self._read_next()

    def detach(self) -> None:
        """Show nothing any more, and read no further."""
        super().detach()
        self._services.runner.cancel(_JOB)

    def choose(self, style: str) -> None:
        """Compare the places for another style."""
        self._style = style
        self._refresh()

    def open(self, folder: Path) -> None:
        """Open one of the places, with the style that is compared."""
        self._desk.open_place(folder, self.resolve().style)

    def resolve(self) -> SpotsState:
        """Work out what the comparison shows now."""
        read, every = len(self._spots), len(self._folders)
        told = {"number": read + 1, "every": every}
        busy = tr("Reading spot {number} of {every}…", **told) if read < every else ""
        answered = [spot for spot in self._spots if spot.results]
        every_one = [spot.results.keys() for spot in answered]
        names = (
            [name for name in every_one[0] if all(name in one for one in every_one)]
            if answered
            else []
        )
        style = self._style if self._style in names else ""
        style = style or proposal([one for spot in answered for one in spot.results.values()]) or ""
        order = [answered[each] for each in rank_spots([one.results[style] for one in answered])]
        best = order[0] if order and not busy else None
        rest = [spot for spot in self._spots if not spot.results]
        spots = self._spots if busy else (*order, *rest)
        waiting = (SpotCard(folder, name, "") for folder, name in self._folders[read:])
        within = {
            name: [spot.name for spot in answered if spot.results[name].attainable]
            for name in names
        }
        return SpotsState(
            (*(_card(spot, style, spot is best) for spot in spots), *waiting),
            tuple((name, answered[0].titles[name], _where(within[name])) for name in names),
            style,
            "" if best is None else _verdict(best, style),
            "" if best is None else tr(
                "{count} of {every} styles are in reach at one spot or another.",
                count=sum(map(bool, within.values())), every=len(names),
            ),
            busy,
        )  # fmt: skip

    def _read_next(self) -> None:
        self._refresh()
        if self._view is None or len(self._spots) == len(self._folders):
            return
        (folder, name), model = self._folders[len(self._spots)], self._services.model
        unkept, today = self._desk.saving.unkept(folder), self._services.today()
        head, settings, styles = model.head, model.settings, model.user_styles

        def done(spot: Spot) -> None:
            self._spots = (*self._spots, spot)
            self._read_next()

        self._services.runner.submit(
            _JOB,
            lambda token, report: _read(
                folder, unkept, head or load_head(settings.head), settings, styles, token
            ),
            title=tr("Reading {name}", name=name),
            done=lambda read: done(Spot(folder, read[0].name, time_words(read[0].made_at, today),
                                        *read[1:])),
            failed=lambda error: done(Spot(folder, name, trouble=_words_of(error))),
            cancelled=lambda: done(Spot(folder, name, trouble=tr("Not read."))),
        )  # fmt: skip


def _words_of(error: Exception) -> str:
    return error.message if isinstance(error, CoreError) else tr("This place cannot be read.")


def _read(
    folder: Path,
    unkept: Place | None,
    head: Head,
    settings: Settings,
    styles: Sequence[UserStyle],
    token: Token,
) -> tuple[Place, dict[str, StyleResult], dict[str, Bytes], dict[str, str]]:
    """Answer one place, and light the head there at the best turn of every style."""
    opened = read_kept(folder, unkept)
    token.check()
    front, light = opened.place.front_deg, opened.light
    results = solve_place(head, light, styles, settings, front)
    token.check()
    turns = [wrap(one.turn_refined_deg + front) for one in results]
    linear = pictures_at(head.transport, light, turns)
    gains = skin_gains(head.transport, [partial(turned, light, turn) for turn in turns])
    coverage = head.pack.coverage.astype(np.float32)
    shown = portraits(linear, coverage, framing(head.transport.size, _SIZE), gains)
    pictures = {
        one.name: picture if one.attainable else greyed(picture)
        for one, picture in zip(results, shown, strict=True)
    }
    every = (*head.pack.styles, *(one.style for one in styles))
    titles = {style.name: style.full_title for style in every}
    return opened.place, {one.name: one for one in results}, pictures, titles


def _where(names: Sequence[str]) -> str:
    if not names:
        return tr("out of reach at these spots")
    return tr("in reach at {names}", names=listed(names, 2))


def _told(result: StyleResult) -> str:
    grade = (result.grade or "yes") if result.attainable else "no"
    leeway = leeway_words(result.arc_deg)
    return _GRADES[grade].format(match=max(math.floor(result.match), 0), leeway=leeway)


def _card(spot: Spot, style: str, best: bool) -> SpotCard:
    result = spot.results.get(style)
    if result is None:
        return SpotCard(spot.folder, spot.name, spot.time, why=spot.trouble)
    return SpotCard(
        spot.folder,
        spot.name,
        spot.time,
        turn_words(result.turn_refined_deg),
        _told(result),
        result.reason or result.shortfall or "",
        result.match,
        best and result.attainable,
        spot.pictures[style],
    )


def _verdict(best: Spot, style: str) -> str:
    result = best.results[style]
    told = {"style": best.titles[style], "name": best.name, "why": _told(result)}
    if result.attainable:
        return tr("Best spot for {style}: {name}. {why}.", **told)
    told["why"] = result.reason or told["why"]
    return tr("No spot here gives {style}. {name} comes nearest: {why}.", **told)
