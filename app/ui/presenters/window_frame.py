"""The frame around the screens: the place, the sitter, the camera, the completed steps and undo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.core.base.phrases import percent
from app.core.places.offers import offers
from app.core.text import tr
from app.ui.presenters.services import Presenter, Services, View, sound_words
from app.ui.presenters.window_model import COMPUTING, CameraSeen, Step
from app.words.phrases.quantities import time_words

WHAT_TO_DROP: Final = tr("Drop a panorama, photos, a film or a folder")
"""Text for drop areas, and for the window while files are being dragged over it."""

NOT_SAVED: Final = tr("This place is not saved: {reason}.")
STROKES_KEPT: Final = tr("Every stroke is saved. You can leave at any time.")
_LOW_BATTERY: Final = 0.15
_LOW_SPACE: Final = 200_000_000
_FIELDS: Final = frozenset(
    {
        "step",
        "place",
        "light",
        "unkept",
        "head",
        "head_name",
        "camera",
        "results",
        "answered",
        "front_deg",
        "user_styles",
        "chosen",
        "goal_deg",
        "reached",
        "plan",
        "painting",
        "settings",
    }
)
_LEAVES: Final = frozenset({"step", "painting", "place_folder"})


@dataclass(frozen=True, slots=True)
class FrameState:
    """The contents of the frame."""

    step: str = Step.PROBE
    place: str = tr("No place yet")
    time: str = ""
    sitter: str = ""
    camera: str = tr("No camera")
    camera_short: str = ""
    camera_warning: str = ""
    undo: str = ""
    redo: str = ""
    status: str = ""
    status_icon: str = "check"


class FramePresenter(Presenter[View]):
    """Updates the frame after every change to the model or the undo stack."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        services.model.changed.connect(self._model_changed)
        services.undo.changed.connect(lambda: self._undone(""))
        services.undo.reported.connect(self._undone)
        self._message = ""

    def resolve(self) -> FrameState:
        """Return the state of the frame."""
        model, undo = self._services.model, self._services.undo
        camera = model.camera
        place = model.place
        status, icon = (self._message, "undo") if self._message else _status(self._services)
        return FrameState(
            step=model.step,
            place=place.name if place is not None else tr("No place yet"),
            time=time_words(place.made_at, self._services.today()) if place is not None else "",
            sitter=model.sitter,
            camera=camera_words(camera) if camera is not None else tr("No camera"),
            camera_short=battery_words(camera),
            camera_warning=camera_warning(camera),
            undo=undo.undo_words,
            redo=undo.redo_words,
            status=status,
            status_icon=icon,
        )

    def _model_changed(self, names: frozenset[str]) -> None:
        if names & _LEAVES:
            self._message = ""
        if names & _FIELDS:
            self._refresh()

    def _undone(self, sentence: str) -> None:
        """Show a sentence about undo or redo at the foot of the window until the next change."""
        self._message = sentence
        self._refresh()


def camera_words(camera: CameraSeen) -> str:
    """Return the camera's status, such as "THETA V, 82%, 1.9 GB free"."""
    name = camera.device.model.removeprefix("RICOH ") or camera.device.name
    parts = [name, battery_words(camera)]
    if camera.free_bytes is not None:
        parts.append(tr("{size:.1f} GB free", size=camera.free_bytes / 1e9))
    return ", ".join(part for part in parts if part)


def _status(services: Services) -> tuple[str, str]:
    """Return the message for the foot of the window while no job is running, with its icon."""
    model = services.model
    if model.step == Step.TURN:
        return sound_words(model.settings.sounds, services.sounds)
    if model.step == Step.STYLES and model.painting is not None:
        return STROKES_KEPT, "check"
    if model.light is None or not model.results:
        return "", "check"
    if model.step == Step.PROBE and model.unkept:
        return NOT_SAVED.format(reason=model.unkept), "warning"
    if model.step == Step.PROBE and model.place is not None and not model.place.environment:
        return tr("Saving this place…"), "clock"
    if model.computing:
        return COMPUTING, "clock"
    if model.step == Step.PROBE:
        return tr("Place saved."), "check"
    if model.settings.objective == "paper":
        return tr("Paper mode is on."), "check"
    every = offers(model.results, lambda one: one.attainable)
    reach = {one.name for one in model.results if one.attainable}
    gives = sum(offer.name in reach for offer in every)
    words = tr("This place gives {count} of {all} styles.", count=gives, all=len(every))
    return words, "check"


def battery_words(camera: CameraSeen | None) -> str:
    """Return the battery level, such as "82%", or an empty string if the level is unknown."""
    return "" if camera is None or camera.battery is None else percent(camera.battery)


def camera_warning(camera: CameraSeen | None) -> str:
    """Return a warning about a low battery or low storage, or an empty string if both are fine."""
    if camera is None:
        return ""
    if camera.battery is not None and camera.battery < _LOW_BATTERY:
        return tr("Battery low")
    if camera.free_bytes is not None and camera.free_bytes < _LOW_SPACE:
        return tr("Card almost full")
    return ""
