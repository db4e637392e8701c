"""Lamps to choose from: kinds known by their numbers, and those of the user's own library."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.second_light.dark_room import GUIDE, capture_lamp
from app.core.second_light.lamp_presets import KINDS
from app.core.second_light.library import MAX_TITLE, add_lamp, check_distance, list_lamps, read_lamp
from app.core.second_light.placements import metres, read_metres
from app.ui.screens.light.state import DISTANCES_M, CaptureAsk, CapturingState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from app.core.base.progress import Report, Token
    from app.core.second_light.captured import CapturedLamp
    from app.core.second_light.lamp_presets import Kind
    from app.core.second_light.library import LampEntry
    from app.ui.presenters.services import Action, Folders, Services
    from app.ui.screens.light.state import LightView

Source: TypeAlias = Literal["files", "place"]
"""What a lamp is made of: pictures, or the place that is open."""

_OWN: Final = "own:"
_FOLDER: Final = "lamps"
_READ: Final = "light-own"
_LIST: Final = "light-library"
_TAKE: Final = "light-capture"
_PLACE: Final = (
    "With a camera that Turnlight knows, capture the dark room in the Probe step, come back here "
    "and take the place that is open."
)
_FIXED: Final = "A captured lamp holds for the distance that it was captured at."


def nearest_stop(distance_m: float) -> int:
    """Give the stop of the distance slider nearest to a distance.

    Examples
    --------
    >>> DISTANCES_M[nearest_stop(0.31)]
    0.3
    """
    return min(range(len(DISTANCES_M)), key=lambda stop: abs(DISTANCES_M[stop] - distance_m))


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What is said of a lamp before its pictures are chosen."""

    title: str = ""
    distance_m: float | None = None


def lamps_of(folders: Folders) -> Path:
    """Where the user's lamps are kept."""
    return folders.home / _FOLDER


def own_key(name: str) -> str:
    """Key of a captured lamp in the list, by its name in the library."""
    return f"{_OWN}{name}"


class LampList:
    """The lamps, and which of them is in hand."""

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
        self.folder = lamps_of(services.folders)
        self.capturing = CapturingState()
        self._wanted = _Wanted()

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

    def choose(self, key: str) -> None:
        """Take a lamp in hand; a captured one is read first."""
        self.key, self.own = key, None
        if key.startswith(_OWN):
            self._read(key)

    def take_own(self, name: str) -> None:
        """Take a captured lamp in hand that has just come into the library."""
        self.refresh()
        self._taken(f"{_OWN}{name}")

    def read_again(self, name: str) -> None:
        """Show a lamp whose files have changed."""
        self.refresh()
        if self.key == f"{_OWN}{name}":
            self._read(self.key)

    def gone(self, name: str) -> None:
        """Forget a lamp that was put away."""
        if self.key == f"{_OWN}{name}":
            self.key, self.own = "", None
        self._entries = tuple(one for one in self._entries if one.name != name)
        self._changed()

    def tell(self) -> None:
        """Show what was said."""
        self._changed()

    def _read(self, key: str) -> None:
        name = key.removeprefix(_OWN)

        def done(lamp: CapturedLamp) -> None:
            if self.key == key:
                self.own = lamp
                self._changed()

        self._services.runner.submit(
            _READ,
            lambda token, report: read_lamp(self.folder, name),
            done=done,
            failed=self._failed,
        )

    def refresh(self) -> None:
        """List the library again."""
        self._services.runner.submit(
            _LIST, lambda token, report: list_lamps(self.folder)[0], done=self._listed
        )

    def _listed(self, entries: tuple[LampEntry, ...]) -> None:
        self._entries = entries
        self._changed()

    # -- a lamp of one's own -------------------------------------------------------------------

    def begin(self) -> None:
        """Say how a lamp is captured, and ask for what there is of it."""
        if self._view is None or self.capturing.busy:
            return
        place = self._services.model.place
        words = f"Take the place “{place.name}”" if self._place_file() and place else ""
        self._view.ask_capture(CaptureAsk(GUIDE, _PLACE, words))

    def capture(self, source: Source, title: str, distance: str) -> None:
        """Make a lamp of pictures that are asked for next, or of the open place."""
        if self._view is None:
            return
        try:
            far = check_distance(read_metres(distance)) if distance.strip() else None
        except CoreError as error:
            self._view.say_capture(str(error))
            return
        self._wanted = _Wanted(title.strip(), far)
        path = self._place_file()
        if source == "files":
            self._view.ask_pictures()
        elif path is not None:
            self.take((path,))

    def _place_file(self) -> Path | None:
        """Panorama of the open place."""
        model = self._services.model
        if model.place is None or model.place_folder is None or not model.place.environment:
            return None
        return model.place_folder / model.place.environment

    def take(self, paths: Sequence[Path]) -> None:
        """Make a lamp of pictures from a dark room, keep it, and take it in hand.

        Parameters
        ----------
        paths : sequence of Path
            Exposures, or one linear panorama.
        """
        head, place = self._services.model.head, self._services.model.place
        if head is None or not paths:
            return
        if self._view is not None:
            self._view.say_capture("")
        folder, given, wanted = self.folder, tuple(paths), self._wanted
        self._wanted = _Wanted()
        facts = place.capture if place is not None and given == (self._place_file(),) else None
        named = given[0].stem if len(given) == 1 else given[0].parent.name
        title = wanted.title or (place.name if place and facts else named)[:MAX_TITLE]

        def work(
            token: Token, report: Report
        ) -> tuple[str, tuple[LampEntry, ...], tuple[str, ...]]:
            found = capture_lamp(
                given,
                head.pack,
                title=title,
                distance_m=wanted.distance_m,
                token=token,
                report=report,
            )
            lamp = found.lamp
            if facts is not None:
                white = lamp.white_cd_m2 or facts.white_cd_m2
                lamp = replace(lamp, camera=facts.camera, white_cd_m2=white)
            kept = add_lamp(folder, lamp)
            return kept.name, list_lamps(folder)[0], found.warnings

        def done(found: tuple[str, tuple[LampEntry, ...], tuple[str, ...]]) -> None:
            name, self._entries, said = found
            self.capturing = CapturingState()
            for words in said:
                self._services.notify.tell(words, kind="warning")
            self._services.notify.mended(_TAKE)
            self._taken(f"{_OWN}{name}")

        def again() -> None:
            self._wanted = wanted
            self.take(given)

        self.capturing = CapturingState(busy=True)
        self._services.runner.submit(
            _TAKE,
            work,
            title="Finding the lamp in its pictures",
            done=done,
            failed=lambda error: self._failed(error, [("Try again", again)]),
            cancelled=lambda: self._failed(None),
        )
        self._changed()

    def _failed(self, error: Exception | None, actions: Sequence[Action] = ()) -> None:
        self.capturing = CapturingState()
        if error is not None:
            self._services.notify.tell_error(error, actions=actions, about=_TAKE)
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
