"""The list of lamps, both standard kinds with known specifications and captured lamps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp
from app.core.second_light.captured_lamps.lamp_capture import capture_lamp
from app.core.second_light.captured_lamps.lamp_file import MAX_TITLE
from app.core.second_light.captured_lamps.lamp_library import (
    LampEntry,
    add_lamp,
    check_distance,
    list_lamps,
    read_lamp,
)
from app.core.second_light.lamp_presets import KINDS, Kind
from app.core.text import tr
from app.ui.presenters.services import Action as Answer
from app.ui.presenters.services import Folders, Services
from app.ui.screens.light.own_lamp.sheets import CaptureAsk, LampSheets
from app.words.lamps import GUIDE, lamp_title, mask_warnings
from app.words.phrases.quantities import metres, read_metres
from app.words.remarks import sentences

Source: TypeAlias = Literal["files", "place"]
"""The source of a captured lamp: photos or the open place."""

_OWN: Final = "own:"

_FOLDER: Final = "lamps"

_READ: Final = "light-own"

_LIST: Final = "light-library"

_TAKE: Final = "light-capture"

_PLACE: Final = tr(
    "With a camera that Turnlight supports, capture the dark room in the Probe "
    "step, then come back here and use the open place."
)

_FIXED: Final = tr("A captured lamp is valid only at the distance at which it was captured.")


def lamps_of(folders: Folders) -> Path:
    """Return the folder that contains the user's lamps."""
    return folders.home / _FOLDER


def own_key(name: str) -> str:
    """Return the key in the list for a captured lamp, given the lamp's name in the library."""
    return f"{_OWN}{name}"


class LampList:
    """The list of lamps, and the lamp in use."""

    def __init__(
        self, services: Services, changed: Callable[[], None], on_new: Callable[[str], None]
    ) -> None:
        self._services = services
        self.changed = changed
        self._on_new = on_new
        self.view: LampSheets | None = None
        self.key = ""
        self.own: CapturedLamp | None = None
        self._entries: tuple[LampEntry, ...] = ()
        self.folder = lamps_of(services.folders)
        self.capturing = False
        self._request: tuple[str, float | None] = ("", None)

    @property
    def items(self) -> tuple[tuple[str, str, str, str], ...]:
        """Key, title, description and icon for each lamp."""
        owned = tuple(
            (f"{_OWN}{one.name}", one.title, _captured(one), "lamp") for one in self._entries
        )
        kinds = tuple(
            (kind.name, lamp_title(kind.name), _what(kind), "bulb") for kind in KINDS.values()
        )
        return (*owned, *kinds)

    @property
    def usual_m(self) -> float | None:
        """Usual distance of the lamp in use from the head, in metres, or None if it has none."""
        if self.own is not None:
            return self.own.distance_m
        return KINDS[self.key].distance_m if self.key in KINDS else None

    @property
    def fixed(self) -> str:
        """The reason why the distance cannot be changed, or "" if it can be changed."""
        return "" if self.own is None or self.own.distance_m is None else _FIXED

    def choose(self, key: str) -> None:
        """Select a lamp. A captured lamp is loaded first."""
        self.key, self.own = key, None
        if key.startswith(_OWN):
            self._read(key)

    def take_own(self, name: str) -> None:
        """Select a captured lamp that has just been added to the library."""
        self.refresh()
        self._on_new(f"{_OWN}{name}")

    def read_again(self, name: str) -> None:
        """Reload a lamp whose files have changed."""
        self.refresh()
        if self.key == f"{_OWN}{name}":
            self._read(self.key)

    def forget(self, name: str) -> None:
        """Remove a deleted lamp from the list."""
        if self.key == f"{_OWN}{name}":
            self.key, self.own = "", None
        self._entries = tuple(one for one in self._entries if one.name != name)
        self.changed()

    def _read(self, key: str) -> None:
        name = key.removeprefix(_OWN)

        def done(lamp: CapturedLamp) -> None:
            if self.key == key:
                self.own = lamp
                self.changed()

        self._services.runner.submit(
            _READ, lambda *_: read_lamp(self.folder, name), done=done, failed=self._failed
        )

    def refresh(self) -> None:
        """Refresh the list of captured lamps from the library."""
        self._services.runner.submit(
            _LIST, lambda *_: list_lamps(self.folder)[0], done=self._listed
        )

    def _listed(self, entries: tuple[LampEntry, ...]) -> None:
        self._entries = entries
        self.changed()

    # -- captured lamps ------------------------------------------------------------------------

    def begin(self) -> None:
        """Open the sheet that explains how to capture a lamp."""
        if self.view is None or self.capturing:
            return
        place = self._services.model.place
        words = ""
        if place is not None and self._place_file():
            words = tr("Use the place “{name}”", name=place.name)
        self.view.ask_capture(CaptureAsk(GUIDE, _PLACE, words))

    def capture(self, source: Source, title: str, distance: str) -> None:
        """Create a lamp from the open place, or ask for photos of the lamp."""
        if self.view is None:
            return
        try:
            far = check_distance(read_metres(distance)) if distance.strip() else None
        except CoreError as error:
            self.view.say(str(error))
            return
        self._request = (title.strip(), far)
        path = self._place_file()
        if source == "files":
            self.view.ask_pictures()
        elif path is not None:
            self.take((path,))

    def _place_file(self) -> Path | None:
        """Return the panorama file of the open place, or None if there is none."""
        model = self._services.model
        if model.place is None or model.place_folder is None or not model.place.environment:
            return None
        return model.place_folder / model.place.environment

    def take(self, paths: Sequence[Path]) -> None:
        """Create a lamp from photos taken in a dark room, then save and select that lamp.

        Args:
            paths: Paths of the exposures, or the path of a single linear panorama.
        """
        head, place = self._services.model.head, self._services.model.place
        if head is None or not paths:
            return
        if self.view is not None:
            self.view.say("")
        folder, files, request = self.folder, tuple(paths), self._request
        new_title, distance_m = request
        self._request = ("", None)
        facts = place.capture if place is not None and files == (self._place_file(),) else None
        named = files[0].stem if len(files) == 1 else files[0].parent.name
        title = new_title or (place.name if place and facts else named)[:MAX_TITLE]

        def work(
            token: Token, report: Report
        ) -> tuple[str, tuple[LampEntry, ...], tuple[str, ...]]:
            capture = capture_lamp(
                files,
                title=title,
                distance_m=distance_m,
                token=token,
                report=report,
            )
            lamp = capture.lamp
            warnings = (*sentences(capture.warnings), *mask_warnings(capture.mask))
            if facts is not None:
                white = lamp.white_cd_m2 or facts.white_cd_m2
                lamp = replace(lamp, camera=facts.camera, white_cd_m2=white)
            return add_lamp(folder, lamp).name, list_lamps(folder)[0], warnings

        def done(result: tuple[str, tuple[LampEntry, ...], tuple[str, ...]]) -> None:
            name, self._entries, warnings = result
            self.capturing = False
            for words in warnings:
                self._services.notify.tell(words, kind="warning")
            self._services.notify.mended(_TAKE)
            self._on_new(f"{_OWN}{name}")

        def again() -> None:
            self._request = request
            self.take(files)

        self.capturing = True
        self._services.runner.submit(
            _TAKE,
            work,
            title=tr("Finding the lamp in its photos"),
            done=done,
            failed=lambda error: self._failed(error, [(tr("Try again"), again)]),
            cancelled=lambda: self._failed(None),
        )
        self.changed()

    def _failed(self, error: Exception | None, actions: Sequence[Answer] = ()) -> None:
        self.capturing = False
        if error is not None:
            self._services.notify.tell_error(error, actions=actions, about=_TAKE)
        if self.key.startswith(_OWN) and self.own is None:
            self.key = ""
        self.changed()


def _captured(lamp: LampEntry) -> str:
    if lamp.distance_m is None:
        return tr("captured")
    return tr("captured, {distance} away", distance=metres(lamp.distance_m))


def _what(kind: Kind) -> str:
    wide, tall = (f"{100 * side:g}" for side in kind.size_m)
    size = f"{wide} cm" if kind.round and wide == tall else f"{wide} × {tall} cm"
    return tr("{size}, {lux} at 1 m", size=size, lux=f"{kind.lux_at_1m:,.0f} lx")
