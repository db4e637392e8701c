"""Lamps to choose from: kinds known by their numbers, and those of the user's own library."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.core.second_light.dark_room import capture_lamp
from app.core.second_light.library import add_lamp, list_lamps, read_lamp
from app.core.second_light.numbers import KINDS
from app.core.second_light.words import metres
from app.ui.presenters.light_state import DISTANCES_M, CapturingState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from app.core.progress import Report, Token
    from app.core.second_light.captured import CapturedLamp
    from app.core.second_light.library import LampEntry
    from app.core.second_light.numbers import Kind
    from app.ui.presenters.light_state import LightView
    from app.ui.presenters.services import Services

__all__ = ["Shelf", "nearest_stop"]

_OWN: Final = "own:"
_FOLDER: Final = "lamps"
_READ: Final = "light-own"
_LIST: Final = "light-library"
_TAKE: Final = "light-capture"
_FIXED: Final = "A captured lamp holds for the distance that it was captured at."


def nearest_stop(distance_m: float) -> int:
    """Give the stop of the distance slider nearest to a distance.

    Examples
    --------
    >>> DISTANCES_M[nearest_stop(0.31)]
    0.3
    """
    return min(range(len(DISTANCES_M)), key=lambda stop: abs(DISTANCES_M[stop] - distance_m))


class Shelf:
    """The lamps, and which of them is in hand.

    Parameters
    ----------
    services : Services
        The window's.
    changed : callable
        Called when there is something else to show.
    taken : callable
        Called with the key of a lamp that was read, to take it in hand.

    Attributes
    ----------
    key : str
        Of the lamp in hand; empty while there is none.
    own : CapturedLamp or None
        It, where it was captured.
    capturing : CapturingState
        A lamp that is being read.
    """

    def __init__(
        self, services: Services, changed: Callable[[], None], taken: Callable[[str], None]
    ) -> None:
        self._services = services
        self._changed = changed
        self._taken = taken
        self._view: LightView | None = None
        self.key = ""
        self.own: CapturedLamp | None = None
        self._entries: tuple[LampEntry, ...] = ()
        self._folder = services.folders.home / _FOLDER
        self.capturing = CapturingState()

    def attach(self, view: LightView | None) -> None:
        """Ask `view` for files from now on."""
        self._view = view

    @property
    def items(self) -> tuple[tuple[str, str, str, str], ...]:
        """Key, title, what it is, and icon of each lamp."""
        owned = tuple(
            (f"{_OWN}{one.name}", one.title, _captured(one), "lamp") for one in self._entries
        )
        kinds = tuple((kind.name, kind.title, _what(kind), "bulb") for kind in KINDS.values())
        return (*owned, *kinds)

    @property
    def usual_m(self) -> float | None:
        """Distance at which the lamp in hand is usually held, metres."""
        if self.own is not None:
            return self.own.distance_m
        return KINDS[self.key].distance_m if self.key in KINDS else None

    @property
    def fixed(self) -> str:
        """Why the distance cannot be changed; empty where it can."""
        return "" if self.own is None or self.own.distance_m is None else _FIXED

    @property
    def incomparable(self) -> bool:
        """Whether nobody knows how bright the lamp in hand is beside the place."""
        return self.own is not None and self.own.white_cd_m2 is None

    def choose(self, key: str) -> None:
        """Take a lamp in hand; a captured one is read first."""
        self.key, self.own = key, None
        if not key.startswith(_OWN):
            return
        name = key.removeprefix(_OWN)

        def done(lamp: CapturedLamp) -> None:
            if self.key == key:
                self.own = lamp
                self._changed()

        self._services.runner.submit(
            _READ,
            lambda token, report: read_lamp(self._folder, name),
            done=done,
            failed=self._failed,
        )

    def refresh(self) -> None:
        """List the library again."""
        self._services.runner.submit(
            _LIST, lambda token, report: list_lamps(self._folder)[0], done=self._listed
        )

    def _listed(self, entries: tuple[LampEntry, ...]) -> None:
        self._entries = entries
        self._changed()

    def begin(self) -> None:
        """Ask for the pictures of a lamp of one's own."""
        if self._view is not None and not self.capturing.busy:
            self._view.ask_pictures()

    def take(self, paths: Sequence[Path]) -> None:
        """Make a lamp of pictures from a dark room, keep it, and take it in hand.

        Parameters
        ----------
        paths : sequence of Path
            Exposures, or one linear panorama.
        """
        head = self._services.model.head
        if head is None or not paths:
            return
        folder, given = self._folder, tuple(paths)
        title = given[0].stem if len(given) == 1 else given[0].parent.name

        def work(
            token: Token, report: Report
        ) -> tuple[str, tuple[LampEntry, ...], tuple[str, ...]]:
            found = capture_lamp(given, head.pack, title=title, token=token, report=report)
            kept = add_lamp(folder, found.lamp)
            return kept.name, list_lamps(folder)[0], found.warnings

        def done(found: tuple[str, tuple[LampEntry, ...], tuple[str, ...]]) -> None:
            name, self._entries, said = found
            self.capturing = CapturingState()
            for words in said:
                self._services.notify.tell(words, kind="warning")
            self._taken(f"{_OWN}{name}")

        self.capturing = CapturingState(busy=True)
        self._services.runner.submit(
            _TAKE,
            work,
            title="Finding the lamp in its pictures",
            done=done,
            failed=self._failed,
            cancelled=lambda: self._failed(None),
        )
        self._changed()

    def _failed(self, error: Exception | None) -> None:
        self.capturing = CapturingState()
        if error is not None:
            self._services.notify.tell_error(error)
        if self.key.startswith(_OWN) and self.own is None:
            self.key = ""
        self._changed()


def _captured(lamp: LampEntry) -> str:
    where = "" if lamp.distance_m is None else f", {metres(lamp.distance_m)} away"
    return f"captured{where}"


def _what(kind: Kind) -> str:
    wide, tall = (f"{100 * side:g}" for side in kind.size_m)
    size = f"{wide} cm" if kind.round and wide == tall else f"{wide} × {tall} cm"
    return f"{size}, {kind.lux_at_1m:,.0f} lx at 1 m"
