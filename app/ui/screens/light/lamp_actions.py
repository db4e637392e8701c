"""What is done with the user's own lamps: renamed, corrected, put away and brought back."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.core.second_light.library import (
    check_distance,
    delete_lamp,
    rename_lamp,
    restate_lamp,
    restore_lamp,
    update_lamp,
)
from app.core.second_light.placements import metres, read_metres
from app.core.second_light.scale import read_lux
from app.ui.presenters.actions import Action
from app.ui.presenters.file_changes import FileChange
from app.ui.screens.light.mask import MaskEdit, MaskLook, look_at_mask
from app.ui.screens.light.state import WordsAsk

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from app.core.second_light.captured import CapturedLamp
    from app.core.storage.library import Trashed
    from app.ui.presenters.place_controller import PlaceController
    from app.ui.presenters.services import Services
    from app.ui.screens.light.lamps import LampList
    from app.ui.screens.light.state import LightView, WordsWish

_ASKED: Final[dict[WordsWish, tuple[str, str, str, str]]] = {
    "rename": ("Rename the lamp", "Name", "Rename", "My panel"),
    "distance": (
        "Distance of the lamp",
        "From the camera to the lamp, as it was captured",
        "Correct",
        "40 cm",
    ),
    "lux": (
        "Brightness of the lamp",
        "Light meter where the camera stood, facing the lamp, lux",
        "Set",
        "640",
    ),
}


class LampKeeping:
    """Changes the files of the lamp in hand; files are changed one after the other."""

    def __init__(self, services: Services, desk: PlaceController, shelf: LampList) -> None:
        self._services = services
        self._desk = desk
        self._shelf = shelf
        self._view: LightView | None = None
        self._trouble = ("", "")

    @property
    def trouble(self) -> str:
        """What was wrong with the last answer that was given for the lamp in hand."""
        about, sentence = self._trouble
        own = self._shelf.own
        return sentence if own is not None and own.name == about else ""

    def attach(self, view: LightView | None) -> None:
        """Ask `view` from now on."""
        self._view = view

    def actions(self) -> Sequence[Action]:
        """List what can be done with a lamp of the user's own."""
        own = self._has_own
        return (
            Action("lamp-rename", "Rename the lamp…", lambda: self.ask("rename"), "edit", "", own),
            Action("lamp-distance", "Correct its distance…", lambda: self.ask("distance"),
                   "lamp", "", own),
            Action("lamp-lux", "Correct its brightness…", lambda: self.ask("lux"), "sun", "", own),
            Action("lamp-mask", "Paint where the lamp is…", self.ask_mask, "brush", "", own),
            Action("lamp-delete", "Delete the lamp", self.delete, "trash", "", own),
        )  # fmt: skip

    def _has_own(self) -> bool:
        return self._shelf.own is not None

    # -- a line --------------------------------------------------------------------------------

    def ask(self, wish: WordsWish) -> None:
        """Ask for another name, distance or brightness of the lamp in hand."""
        lamp = self._shelf.own
        if lamp is None or self._view is None:
            return
        title, label, button, example = _ASKED[wish]
        text = lamp.title
        if wish == "distance":
            text = "" if lamp.distance_m is None else metres(lamp.distance_m)
        elif wish == "lux":
            text = "" if lamp.lux is None else f"{lamp.lux:.3g}"
        self._view.ask_words(WordsAsk(wish, title, label, button, text, example))

    def answer(self, wish: WordsWish, text: str) -> None:
        """Take the line; what is wrong with it is said beside it."""
        lamp, folder = self._shelf.own, self._shelf.folder
        if lamp is None:
            return
        try:
            if wish == "rename":
                self._change(lamp, "rename", lambda: rename_lamp(folder, lamp.name, text))
            elif wish == "distance":
                far = check_distance(read_metres(text))
                make = partial(restate_lamp, folder, lamp.name, distance_m=far)
                self._change(lamp, "correct the distance of", make)
            else:
                lux = read_lux(text)
                make = partial(restate_lamp, folder, lamp.name, lux=lux)
                self._change(lamp, "correct the brightness of", make)
        except CoreError as error:
            self._say(str(error))

    def _change(self, lamp: CapturedLamp, what: str, make: Callable[[], object]) -> None:
        def done(_: object) -> None:
            self._say("")
            self._shelf.read_again(lamp.name)

        def failed(error: Exception) -> None:
            if isinstance(error, CoreError):
                self._say(str(error))
            else:
                self._services.notify.tell_error(error)

        FileChange(
            self._services.undo,
            self._desk.file_work,
            f"{what} {lamp.title}",
            make,
            lambda _: update_lamp(self._shelf.folder, lamp),
            made=done,
            undone=done,
            failed=failed,
        ).begin()

    def _say(self, sentence: str) -> None:
        own = self._shelf.own
        self._trouble = ("" if own is None else own.name, sentence)
        if self._view is not None:
            self._view.say_words(sentence)
        self._shelf.tell()

    # -- all of it -----------------------------------------------------------------------------

    def ask_mask(self) -> None:
        """Let the user paint where the lamp is."""
        lamp, shelf = self._shelf.own, self._shelf
        if lamp is None or self._view is None:
            return
        name = lamp.name

        def ready(look: MaskLook) -> None:
            if self._view is None or shelf.own is not lamp:
                return
            services, desk = self._services, self._desk
            again = partial(shelf.read_again, name)
            self._view.ask_mask(MaskEdit(services, desk, shelf.folder, lamp, look, again))

        self._services.runner.submit(
            "light-mask-look", lambda token, report: look_at_mask(lamp), done=ready
        )

    def delete(self) -> None:
        """Put the lamp in hand away; undo, or the message that tells so, brings it back."""
        lamp, shelf = self._shelf.own, self._shelf
        if lamp is None:
            return
        folder, tell, name = shelf.folder, self._services.notify.tell, lamp.name

        def deleted(trashed: Trashed) -> None:
            shelf.gone(trashed.name)
            tell(f"{trashed.title} deleted", kind="done", actions=(("Undo", change.take_back),))

        def returned(back: CapturedLamp) -> None:
            nonlocal name
            name = back.name
            shelf.take_own(name)
            tell(f"{back.title} is back.", kind="done")

        change = FileChange(
            self._services.undo,
            self._desk.file_work,
            f"delete {lamp.title}",
            lambda: delete_lamp(folder, name),
            lambda trashed: restore_lamp(folder, trashed),
            made=deleted,
            undone=returned,
            failed=self._services.notify.tell_error,
        )
        change.begin()
