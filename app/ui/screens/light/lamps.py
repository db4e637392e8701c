"""Lamps to choose from: kinds known by their numbers, and those of the user's own library."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token
from app.core.second_light.captured import CapturedLamp
from app.core.second_light.lamp_presets import KINDS, Kind
from app.core.second_light.library import (
    MAX_TITLE,
    LampEntry,
    add_lamp,
    capture_lamp,
    check_distance,
    delete_lamp,
    list_lamps,
    read_lamp,
    rename_lamp,
    restate_lamp,
    restore_lamp,
    update_lamp,
)
from app.core.second_light.place_brightness import read_lux
from app.core.storage.library import TrashedItem
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.file_changes import FileChange, delete_with_undo, told_beside
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Action as Answer
from app.ui.presenters.services import Folders, Services
from app.ui.screens.light.mask import MaskEdit, MaskLook, look_at_mask
from app.ui.screens.light.state import DISTANCES_M, CaptureAsk, LightView, WordsAsk, WordsWish
from app.words.lamps import GUIDE, lamp_title, mask_warnings
from app.words.phrases.quantities import metres, read_metres
from app.words.remarks import sentences

_QUESTIONS: Final[dict[WordsWish, tuple[str, str, str, str]]] = {
    "rename": (tr("Rename the lamp"), tr("Name"), tr("Rename"), tr("My panel")),
    "distance": (
        tr("Distance of the lamp"),
        tr("From the camera to the lamp, as it was captured"),
        tr("Correct"),
        "40 cm",
    ),
    "lux": (
        tr("Brightness of the lamp"),
        tr("Light meter where the camera stood, facing the lamp, lux"),
        tr("Set"),
        "640",
    ),
}


class LampActions:
    """Changes the files of the lamp in hand; files are changed one after the other."""

    def __init__(
        self, services: Services, place_controller: PlaceController, lamps: LampList
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._lamps = lamps
        self._trouble = ("", "")

    @property
    def trouble(self) -> str:
        """What was wrong with the last answer that was given for the lamp in hand."""
        about, sentence = self._trouble
        own = self._lamps.own
        return sentence if own is not None and own.name == about else ""

    def actions(self) -> Sequence[Action]:
        """List what can be done with a lamp of the user's own."""
        own = self._has_own
        return (
            Action("lamp-rename", tr("Rename the lamp…"), lambda: self.ask("rename"),
                   "edit", "", own),
            Action("lamp-distance", tr("Correct its distance…"), lambda: self.ask("distance"),
                   "lamp", "", own),
            Action("lamp-lux", tr("Correct its brightness…"), lambda: self.ask("lux"),
                   "sun", "", own),
            Action("lamp-mask", tr("Paint where the lamp is…"), self.ask_mask, "brush", "", own),
            Action("lamp-delete", tr("Delete the lamp"), self.delete, "trash", "", own),
        )  # fmt: skip

    def _has_own(self) -> bool:
        return self._lamps.own is not None

    # -- a line --------------------------------------------------------------------------------

    def ask(self, wish: WordsWish) -> None:
        """Ask for another name, distance or brightness of the lamp in hand."""
        lamp = self._lamps.own
        view = self._lamps.view
        if lamp is None or view is None:
            return
        title, label, button, example = _QUESTIONS[wish]
        text = lamp.title
        if wish == "distance":
            text = "" if lamp.distance_m is None else metres(lamp.distance_m)
        elif wish == "lux":
            text = "" if lamp.lux is None else f"{lamp.lux:.3g}"
        view.ask_words(WordsAsk(wish, title, label, button, text, example))

    def answer(self, wish: WordsWish, text: str) -> None:
        """Take the line; what is wrong with it is said beside it."""
        lamp, folder = self._lamps.own, self._lamps.folder
        if lamp is None:
            return
        try:
            if wish == "rename":
                self._change(
                    lamp,
                    tr("rename {lamp}", lamp=lamp.title),
                    lambda: rename_lamp(folder, lamp.name, text),
                )
            elif wish == "distance":
                far = check_distance(read_metres(text))
                make = partial(restate_lamp, folder, lamp.name, distance_m=far)
                self._change(lamp, tr("correct the distance of {lamp}", lamp=lamp.title), make)
            else:
                lux = read_lux(text)
                make = partial(restate_lamp, folder, lamp.name, lux=lux)
                self._change(lamp, tr("correct the brightness of {lamp}", lamp=lamp.title), make)
        except CoreError as error:
            self._say(str(error))

    def _change(self, lamp: CapturedLamp, what: str, make: Callable[[], object]) -> None:
        def done(_: object) -> None:
            self._say("")
            self._lamps.read_again(lamp.name)

        FileChange(
            self._place_controller.file_work,
            what,
            make,
            lambda _: update_lamp(self._lamps.folder, lamp),
            on_apply=done,
            undone=done,
            failed=told_beside(self._services, self._say),
        ).begin()

    def _say(self, sentence: str) -> None:
        own = self._lamps.own
        self._trouble = ("" if own is None else own.name, sentence)
        if self._lamps.view is not None:
            self._lamps.view.say(sentence)
        self._lamps.changed()

    # -- all of it -----------------------------------------------------------------------------

    def ask_mask(self) -> None:
        """Let the user paint where the lamp is."""
        lamp, lamps = self._lamps.own, self._lamps
        if lamp is None:
            return
        name = lamp.name

        def ready(look: MaskLook) -> None:
            if lamps.view is not None and lamps.own is lamp:
                arguments = (self._services, self._place_controller, lamps.folder, lamp, look)
                lamps.view.ask_mask(MaskEdit(*arguments, partial(lamps.read_again, name)))

        self._services.runner.submit("light-mask-look", lambda *_: look_at_mask(lamp), done=ready)

    def delete(self) -> None:
        """Put the lamp in hand away; undo, or the message that tells so, brings it back."""
        lamp, lamps = self._lamps.own, self._lamps
        if lamp is None:
            return
        folder, name = lamps.folder, lamp.name

        def message(trashed: TrashedItem) -> str:
            lamps.forget(trashed.name)
            return trashed.title

        def returned(back: CapturedLamp) -> str:
            nonlocal name
            name = back.name
            lamps.take_own(name)
            return back.title

        delete_with_undo(
            self._place_controller.file_work,
            lamp.title,
            lambda: delete_lamp(folder, name),
            lambda trashed: restore_lamp(folder, trashed),
            message=message,
            returned=returned,
        )


Source: TypeAlias = Literal["files", "place"]
"""What a lamp is made of: pictures, or the place that is open."""

_OWN: Final = "own:"
_FOLDER: Final = "lamps"
_READ: Final = "light-own"
_LIST: Final = "light-library"
_TAKE: Final = "light-capture"
_PLACE: Final = tr(
    "With a camera that Turnlight knows, capture the dark room in the Probe "
    "step, come back here and take the place that is open."
)
_FIXED: Final = tr("A captured lamp holds for the distance that it was captured at.")


def nearest_stop(distance_m: float) -> int:
    """Give the stop of the distance slider nearest to a distance.

    Examples:
        >>> DISTANCES_M[nearest_stop(0.31)]
        0.3
    """
    return min(range(len(DISTANCES_M)), key=lambda stop: abs(DISTANCES_M[stop] - distance_m))


def lamps_of(folders: Folders) -> Path:
    """Where the user's lamps are kept."""
    return folders.home / _FOLDER


def own_key(name: str) -> str:
    """Key of a captured lamp in the list, by its name in the library."""
    return f"{_OWN}{name}"


class LampList:
    """The lamps, and which of them is in hand."""

    def __init__(
        self, services: Services, changed: Callable[[], None], on_new: Callable[[str], None]
    ) -> None:
        self._services = services
        self.changed = changed
        self._on_new = on_new
        self.view: LightView | None = None
        self.key = ""
        self.own: CapturedLamp | None = None
        self._entries: tuple[LampEntry, ...] = ()
        self.folder = lamps_of(services.folders)
        self.capturing = False
        self._request: tuple[str, float | None] = ("", None)

    @property
    def items(self) -> tuple[tuple[str, str, str, str], ...]:
        """Key, title, what it is, and icon of each lamp."""
        owned = tuple(
            (f"{_OWN}{one.name}", one.title, _captured(one), "lamp") for one in self._entries
        )
        kinds = tuple(
            (kind.name, lamp_title(kind.name), _what(kind), "bulb") for kind in KINDS.values()
        )
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
        self._on_new(f"{_OWN}{name}")

    def read_again(self, name: str) -> None:
        """Show a lamp whose files have changed."""
        self.refresh()
        if self.key == f"{_OWN}{name}":
            self._read(self.key)

    def forget(self, name: str) -> None:
        """Forget a lamp that was put away."""
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
        """List the library again."""
        self._services.runner.submit(
            _LIST, lambda *_: list_lamps(self.folder)[0], done=self._listed
        )

    def _listed(self, entries: tuple[LampEntry, ...]) -> None:
        self._entries = entries
        self.changed()

    # -- a lamp of one's own -------------------------------------------------------------------

    def begin(self) -> None:
        """Say how a lamp is captured, and ask for what there is of it."""
        if self.view is None or self.capturing:
            return
        place = self._services.model.place
        words = ""
        if place is not None and self._place_file():
            words = tr("Take the place “{name}”", name=place.name)
        self.view.ask_capture(CaptureAsk(GUIDE, _PLACE, words))

    def capture(self, source: Source, title: str, distance: str) -> None:
        """Make a lamp of pictures that are asked for next, or of the open place."""
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
        """Panorama of the open place."""
        model = self._services.model
        if model.place is None or model.place_folder is None or not model.place.environment:
            return None
        return model.place_folder / model.place.environment

    def take(self, paths: Sequence[Path]) -> None:
        """Make a lamp of pictures from a dark room, keep it, and take it in hand.

        `paths`: exposures, or one linear panorama.
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
            title=tr("Finding the lamp in its pictures"),
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
