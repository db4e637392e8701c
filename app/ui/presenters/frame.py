"""The frame around the screens: place, sitter, camera, what is done and what can be undone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from app.ui.presenters.model import Step
from app.ui.presenters.services import sound_words

if TYPE_CHECKING:
    from datetime import datetime

    from app.ui.presenters.model import CameraSeen, Model
    from app.ui.presenters.services import Services

_LOW_BATTERY: Final = 0.15
_LOW_SPACE: Final = 200_000_000
_SHOWN: Final = frozenset(
    {
        "step",
        "place",
        "light",
        "unkept",
        "head",
        "camera",
        "results",
        "chosen",
        "goal_deg",
        "plan",
        "painting",
        "settings",
    }
)
_LEAVES: Final = frozenset({"step", "painting", "place_folder"})
_MONTHS: Final = tuple(  # of English, whatever the system speaks
    "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()  # noqa: SIM905
)


@dataclass(frozen=True, slots=True)
class FrameState:
    """What the frame shows."""

    step: str = Step.PROBE
    place: str = "No place yet"
    time: str = ""
    sitter: str = ""
    camera: str = "No camera"
    camera_short: str = ""
    camera_warning: str = ""
    undo: str = ""
    redo: str = ""
    status: str = ""
    status_icon: str = "check"


class FrameView(Protocol):
    """Shows a `FrameState`."""

    def show_state(self, state: FrameState) -> None:
        """Show it."""


class FramePresenter:
    """Resolves what the frame shows whenever something of it changed."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._view: FrameView | None = None
        services.model.changed.connect(self._model_changed)
        services.undo.changed.connect(lambda: self._undone(""))
        services.undo.told.connect(self._undone)
        self._said = ""

    def attach(self, view: FrameView) -> None:
        """Show everything in `view` from now on."""
        self._view = view
        self._refresh()

    def resolve(self) -> FrameState:
        """Work out what the frame shows now."""
        model, undo = self._services.model, self._services.undo
        camera = model.camera
        place = model.place
        status, icon = (self._said, "undo") if self._said else self._status(model)
        return FrameState(
            step=model.step,
            place=place.name if place is not None else "No place yet",
            time=time_words(place.made_at, self._services.today()) if place is not None else "",
            sitter=model.head.title if model.head is not None else "",
            camera=camera_words(camera) if camera is not None else "No camera",
            camera_short=_percent(camera.battery) if camera is not None else "",
            camera_warning=camera_warning(camera),
            undo=undo.undo_words,
            redo=undo.redo_words,
            status=status,
            status_icon=icon,
        )

    def _status(self, model: Model) -> tuple[str, str]:
        if model.step == Step.TURN:
            return sound_words(model.settings.sounds, self._services.sounds)
        return _status(model)

    def _model_changed(self, names: frozenset[str]) -> None:
        if names & _LEAVES:
            self._said = ""
        if names & _SHOWN:
            self._refresh()

    def _undone(self, sentence: str) -> None:
        """Say at the foot what was undone, until something else is done or comes to the front."""
        self._said = sentence
        self._refresh()

    def _refresh(self) -> None:
        if self._view is not None:
            self._view.show_state(self.resolve())


def time_words(moment: datetime, today: datetime) -> str:
    """Say when something was: "21 Nov, 14:05", with the year when it is another one."""
    local = moment.astimezone(today.tzinfo)
    year = f" {local.year}" if local.year != today.year else ""
    return f"{local.day} {_MONTHS[local.month - 1]}{year}, {local:%H:%M}"


def camera_words(camera: CameraSeen) -> str:
    """Say which camera it is: "THETA V, 82 %, 1.9 GB free"."""
    name = camera.found.model.removeprefix("RICOH ") or camera.found.name
    parts = [name, _percent(camera.battery)]
    if camera.free_bytes is not None:
        parts.append(f"{camera.free_bytes / 1e9:.1f} GB free")
    return ", ".join(part for part in parts if part)


def _status(model: Model) -> tuple[str, str]:
    """Say what is to be known on this screen while nothing runs, and with which icon."""
    if model.step == Step.STYLES and model.painting is not None:
        return "Every stroke is kept. Leave at any time.", "check"
    if model.light is None or not model.results:
        return "", "check"
    if model.step == Step.PROBE and model.unkept:
        return f"This place is not saved: {model.unkept}.", "warning"
    if model.step == Step.PROBE and model.place is not None and not model.place.environment:
        return "Saving this place…", "clock"
    if model.step == Step.PROBE:
        return "The place is kept with its answers.", "check"
    out = sum(not result.attainable for result in model.results)
    solved = f"All {len(model.results)} styles solved for this place."
    if out == 0:
        return f"{solved} Every one is in reach.", "check"
    are = "1 is" if out == 1 else f"{out} are"
    return f"{solved} {are} out of reach and say{'s' if out == 1 else ''} why.", "check"


def _percent(share: float | None) -> str:
    return "" if share is None else f"{round(100 * share)} %"


def camera_warning(camera: CameraSeen | None) -> str:
    """Say what is about to run out; empty while nothing is."""
    if camera is None:
        return ""
    if camera.battery is not None and camera.battery < _LOW_BATTERY:
        return "Battery low"
    if camera.free_bytes is not None and camera.free_bytes < _LOW_SPACE:
        return "Card almost full"
    return ""
