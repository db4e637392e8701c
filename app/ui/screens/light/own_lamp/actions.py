"""The actions for a captured lamp: rename it, correct its values, paint its mask and delete it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from app.core.base.errors import CoreError
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp
from app.core.second_light.captured_lamps.lamp_library import (
    check_distance,
    delete_lamp,
    rename_lamp,
    restate_lamp,
    restore_lamp,
    update_lamp,
)
from app.core.second_light.place_brightness import read_lux
from app.core.storage.item_library import TrashedItem
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.file_changes import FileChange, delete_with_undo, told_beside
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.screens.light.lamp_list import LampList
from app.ui.screens.light.own_lamp.mask import MaskEdit, MaskLook, look_at_mask
from app.ui.screens.light.own_lamp.sheets import WordsAsk, WordsWish
from app.words.phrases.quantities import metres, read_metres

_QUESTIONS: Final[dict[WordsWish, tuple[str, str, str, str]]] = {
    "rename": (tr("Rename the lamp"), tr("Name"), tr("Rename"), tr("My panel")),
    "distance": (
        tr("Distance of the lamp"),
        tr("Distance from the camera to the lamp during the capture"),
        tr("Correct"),
        "40 cm",
    ),
    "lux": (
        tr("Brightness of the lamp"),
        tr("Light meter at the camera’s position, facing the lamp, in lux"),
        tr("Set"),
        "640",
    ),
}


class LampActions:
    """Changes the files of the lamp in use, one change at a time."""

    def __init__(
        self, services: Services, place_controller: PlaceController, lamps: LampList
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._lamps = lamps
        self._trouble = ("", "")

    @property
    def trouble(self) -> str:
        """The error in the latest answer about the lamp in use, or an empty string."""
        about, sentence = self._trouble
        own = self._lamps.own
        return sentence if own is not None and own.name == about else ""

    def actions(self) -> Sequence[Action]:
        """Return the actions for a captured lamp."""
        own = self._has_own
        return (
            Action("lamp-rename", tr("Rename the lamp…"), lambda: self.ask("rename"),
                   "edit", "", own),
            Action("lamp-distance", tr("Correct the distance…"), lambda: self.ask("distance"),
                   "lamp", "", own),
            Action("lamp-lux", tr("Correct the brightness…"), lambda: self.ask("lux"),
                   "sun", "", own),
            Action("lamp-mask", tr("Paint where the lamp is…"), self.ask_mask, "brush", "", own),
            Action("lamp-delete", tr("Delete the lamp"), self.delete, "trash", "", own),
        )  # fmt: skip

    def _has_own(self) -> bool:
        return self._lamps.own is not None

    # -- edits of one value --------------------------------------------------------------------

    def ask(self, wish: WordsWish) -> None:
        """Ask for a new name, a new distance or a new brightness for the lamp in use."""
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
        """Apply the typed text, or show an error beside the field if the text is invalid."""
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

    # -- mask and deletion ---------------------------------------------------------------------

    def ask_mask(self) -> None:
        """Open the sheet for painting the mask."""
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
        """Delete the lamp in use. Undo can restore it."""
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
