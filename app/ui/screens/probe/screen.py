"""The Probe screen, which measures the light at a place with a camera, files or a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from app.core.measure.finish.findings import Findings
from app.core.places.place import Place
from app.core.places.place_verdict import place_verdict
from app.core.portrait.age import Age, Kind, light_age
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.places_list import PlacesListPresenter, PlacesListRow, PlacesListState
from app.ui.presenters.services import Presenter, Services
from app.ui.presenters.window_model import Step
from app.ui.screens.probe.capture.camera import CameraBlock, CameraFinder
from app.ui.screens.probe.capture.capture import CaptureControl, Running
from app.ui.screens.probe.capture.checklist import ChoiceRow
from app.ui.screens.probe.capture.frames import FrameTile, frames_note, tile_of
from app.ui.screens.probe.capture.notice import Notice, advice_notice
from app.ui.screens.probe.capture.plans import metered_of, plan_parts
from app.ui.screens.probe.filming import Filming
from app.ui.screens.probe.lamps import LampRow, lamp_rows
from app.ui.screens.probe.live import Live, LivePreview
from app.ui.screens.probe.panorama import LAYERS, PlacePanorama
from app.ui.screens.probe.watching import Watching
from app.words.phrases.place_verdict import place_verdict_words
from app.words.portrait.age import age_words


@dataclass(frozen=True, slots=True, eq=False)
class ProbeState:
    """The state of the whole screen.

    Attributes:
        picture: Panorama at the chosen exposure, (h, 2 h, 3) uint8 sRGB, or None if there is none.
        findings: Lamps and clip mask, or None until they have been computed.
        front_deg: Azimuth at which the photographer stands, in degrees.
        exposure_ev: Exposure of the picture, in stops.
        verdict: The verdict about the place, or "" until the results are there.
    """

    picture: NDArray[np.uint8] | None = field(default=None, repr=False)
    findings: Findings | None = None
    front_deg: float = 0.0
    marker_words: str = tr("Photographer stands here")
    exposure_ev: float = 0.0
    layers: frozenset[str] = LAYERS - {"grid"}
    lamps: tuple[LampRow, ...] = ()
    lamps_note: str = ""
    verdict: str = ""
    opening: str = ""
    recent: tuple[PlacesListRow, ...] = ()
    age: str = ""
    age_old: bool = False
    way: str = "camera"
    mirrored: bool = False
    watching: str = ""
    camera: CameraBlock = field(default_factory=CameraBlock)
    plans: tuple[ChoiceRow, ...] = ()
    plan: str = "paper"
    timer_s: int = 0
    ticked: frozenset[str] = frozenset()
    frames: tuple[FrameTile, ...] = ()
    frames_note: str = ""
    running: Running | None = None
    live: Live | None = None
    notice: Notice | None = None
    has_place: bool = False
    can_capture: bool = False
    why_not: str = ""


class ProbeView(Protocol):
    """A view that shows a `ProbeState`."""

    def show_state(self, state: ProbeState) -> None:
        """Show the state, updating only the parts that have changed."""

    def zoom_by(self, steps: float) -> None:
        """Zoom the panorama by a number of steps. A positive number zooms in."""

    def take_marker(self) -> None:
        """Give the marker the keyboard focus."""

    def ask_folder(self) -> None:
        """Ask for the folder to watch."""

    def ask_measured(self, way: str) -> None:
        """Ask for the files needed for one of the `WAYS`."""


BEAT_MS: Final = 100
"""Interval between calls of `ProbePresenter.tick` while the camera is busy, in milliseconds."""

SLOW_BEAT_MS: Final = 1000
"""Interval between calls of `ProbePresenter.tick` at other times, in milliseconds."""

_AGE_S: Final = 15.0

_RECENT: Final = 4

_TIMERS: Final = (0, 2, 5, 10)

_WINDOWS: Final = 0.1

NO_CAMERA_YET: Final = tr("There is no camera yet.")
MARKERS: Final = {"walk": tr("Photographer stands here"), "selfie": tr("You face this way now")}

_FIELDS: Final = frozenset(
    {
        "place",
        "place_folder",
        "light",
        "opening",
        "front_deg",
        "camera",
        "settings",
        "head",
        "results",
        "answered",
    }
)


class ProbePresenter(Presenter[ProbeView]):
    """Measures the light at a place."""

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._ticked: frozenset[str] = frozenset()
        self._age_at = services.clock.now()
        self._watched = ""
        self.panorama = PlacePanorama(services, self._refresh)
        self.cameras = CameraFinder(services, self._refresh)
        self.live = LivePreview(services, self.cameras, self._refresh)
        self.filming = Filming(services, place_controller, self._refresh)
        self.taking = CaptureControl(
            services, place_controller, self.cameras, self.live.stop, self._refresh
        )
        self.watching = Watching(services, place_controller, self._refresh)
        self.places = PlacesListPresenter(services, place_controller, _RECENT, "recent")
        self.open_files, self.open_demo = place_controller.open_paths, place_controller.open_demo
        self.move_marker = place_controller.move_front
        services.model.changed.connect(self._model_changed)
        self._show_light()

    # -- screen --------------------------------------------------------------------------------

    def enter(self) -> None:
        """Look for cameras and interrupted captures."""
        if not self.taking.active:
            self.cameras.begin()
            self.taking.look_for_unfinished()
        self._watch_as_set()
        self._look_for_places()
        self._refresh()

    def leave(self) -> None:
        """Stop the search and the preview, but let a running capture continue."""
        self.cameras.pause()
        self.live.stop()
        self.filming.stop()

    def tick(self) -> None:
        """Update the preview, the capture's progress and the age of the light measurement."""
        now = self._services.clock.now()
        self.live.tick()
        self.filming.tick()
        if self.taking.tick() or now - self._age_at >= _AGE_S:
            self._age_at = now
            self._refresh()

    def actions(self) -> Sequence[Action]:
        """Return the actions of this screen."""

        def has_light() -> bool:
            return self._services.model.light is not None

        return (
            Action("probe-main", tr("Continue"), self.main, "chevron-right", "Return; Enter"),
            Action("capture", tr("Capture"), self.capture, "camera", "Space",
                   lambda: self.resolve().can_capture, hint=tr("capture")),
            Action("live-preview", tr("Live preview"), self.preview, "eye", "L",
                   lambda: self.resolve().live is not None or self.resolve().can_capture),
            Action("zoom-in", tr("Zoom in"), self._on_view(lambda view: view.zoom_by(1)), "plus",
                   "+; =", has_light),
            Action("zoom-out", tr("Zoom out"), self._on_view(lambda view: view.zoom_by(-1)),
                   "minus", "-", has_light, hint=tr("zoom"), keys="+ −"),
            Action("marker", tr("Move the marker"), self._on_view(lambda view: view.take_marker()),
                   "person", "M", has_light, hint=tr("move marker")),
            Action("search-cameras", tr("Look for cameras"), self.cameras.search, "refresh"),
            Action("watch", tr("Watch a folder…"), self._on_view(lambda view: view.ask_folder()),
                   "folder"),
            Action("cancel-capture", tr("Stop the capture"), self.taking.cancel, "cancel", "Esc",
                   lambda: self.taking.active),
        )  # fmt: skip

    def _on_view(self, act: Callable[[ProbeView], None]) -> Callable[[], None]:
        """Return a function that calls `act` with the view, or does nothing if none is attached."""
        return lambda: None if self._view is None else act(self._view)

    # -- state ---------------------------------------------------------------------------------

    def resolve(self) -> ProbeState:
        """Return the state of the screen."""
        model = self._services.model
        place, light, settings = model.place, model.light, model.settings
        block = self.cameras.block()
        plans = plan_parts(model.camera, metered_of(None if place is None else place.capture))
        running = self.taking.running()
        age = self._age()
        findings = self.panorama.findings
        rough = place is not None and place.capture is not None and place.capture.plan == "rough"
        why_not = tr("The camera asks for a password.") if block.asks_password else ""
        why_not = NO_CAMERA_YET if block.missing else why_not
        # Files can be opened at any time.
        why_not = why_not if settings.measure_with == "camera" else ""
        lamps_note = ""
        if light is not None and findings is None:
            lamps_note = tr("Looking for lamps…")
        elif findings is not None and not findings.lamps:
            lamps_note = tr("No lamp stands out: the light comes from everywhere.")
        return ProbeState(
            picture=self.panorama.picture,
            findings=findings,
            front_deg=model.front_deg,
            marker_words=MARKERS.get(settings.mode, MARKERS["walk"]),
            exposure_ev=self.panorama.target_ev,
            layers=self.panorama.layers,
            lamps=() if findings is None else lamp_rows(findings, model.front_deg, rough=rough),
            lamps_note=lamps_note,
            verdict=self._verdict(),
            opening=model.opening,
            recent=self._recent(),
            age="" if age is None else age_words(age),
            age_old=age is not None and age.state == "old",
            watching="" if self.watching.folder is None else self.watching.folder.name,
            way=settings.measure_with,
            mirrored=settings.mirrored,
            camera=block,
            plans=plans,
            plan=settings.plan,
            timer_s=min(_TIMERS, key=lambda each: abs(each - settings.self_timer_s)),
            ticked=self._ticked,
            frames=self.taking.tiles() if running is not None else self._tiles(place),
            frames_note=frames_note(place, self._services.today())
            if running is None and place is not None
            else "",
            running=running,
            live=self.live.live or self.filming.live,
            notice=None if running is not None else self._notice(place, block, plans),
            has_place=light is not None,
            can_capture=running is None and not why_not,
            why_not=why_not,
        )

    def _notice(
        self, place: Place | None, block: CameraBlock, plans: Sequence[ChoiceRow]
    ) -> Notice | None:
        if self.taking.notice is not None:
            return self.taking.notice
        full = next((part for part in plans if part.key == "full" and part.second), None)
        return advice_notice(place, self.panorama.findings, full, block)

    def _tiles(self, place: Place | None) -> tuple[FrameTile, ...]:
        facts = () if place is None or place.capture is None else place.capture.frames
        pictures = (*self.panorama.frames, *(None for _ in facts))
        values = [(one.ev, one.shutter_s, one.clipped_share) for one in facts]
        return tuple(tile_of(*one, picture) for one, picture in zip(values, pictures, strict=False))

    def _verdict(self) -> str:
        model = self._services.model
        if model.light is None or model.computing:
            return ""
        verdict = place_verdict(model.results, model.light.searched, model.front_deg)
        return "" if verdict is None else place_verdict_words(verdict, model.results)

    def _age(self) -> Age | None:
        place = self._services.model.place
        if place is None or place.measured_at is None or self._services.model.light is None:
            return None
        # The capture time of a panorama from a file is unknown.
        if place.capture is not None and place.capture.plan == "panorama":
            return None
        return light_age(
            place.measured_at,
            self._services.today(),
            _kind(place, self.panorama.findings),
            place.location.sun_elevation_deg,
        )

    # -- user actions --------------------------------------------------------------------------

    def main(self) -> None:
        """Perform the action of the amber button."""
        if self._services.model.light is not None and not self.taking.active:
            self.see_styles()
        elif self.resolve().can_capture or self.taking.active:
            self.capture()
        else:
            self.open_demo()

    def see_styles(self) -> None:
        """Continue to the Styles screen."""
        self._services.model.update(step=Step.STYLES, painting=None)

    def capture(self) -> None:
        """Start a capture with the chosen plan, or ask for the files that the chosen way needs."""
        settings = self._services.model.settings
        if settings.measure_with != "camera" and not self.taking.active:
            self._on_view(lambda view: view.ask_measured(settings.measure_with))()
            return
        self.taking.start(settings.plan, self.resolve().timer_s)

    def preview(self) -> None:
        """Start or stop the live preview, or start or finish filming a turn."""
        if self._services.model.settings.measure_with == "film" or self.filming.live is not None:
            self.filming.toggle()
        else:
            self.live.toggle()

    def press(self, key: str) -> None:
        """Perform the action of a button on the notice."""
        settings = self._services.model.settings
        if key == "capture-full":
            self.taking.start("full", self.resolve().timer_s)
        elif key == "search":
            self.cameras.search()
        else:
            self.taking.press(key, settings.plan, self.resolve().timer_s)

    def set(self, key: str, value: object) -> None:
        """Change and save a setting, such as the plan."""
        self._services.model.set(key, value)

    def set_timer(self, seconds: int) -> None:
        """Set the self-timer."""
        self.set("self_timer_s", seconds)

    def tick_off(self, key: str) -> None:
        """Tick or untick an item of the checklist."""
        self._ticked = self._ticked ^ {key}
        self._refresh()

    def show_state(self, state: PlacesListState) -> None:
        """Show the changed list of recent places."""
        del state
        self._refresh()

    # -- internal ------------------------------------------------------------------------------

    def _watch_as_set(self) -> None:
        """Watch the folder named in the settings, starting only once for each new folder."""
        folder = self._services.model.settings.watch_folder
        if folder and folder != self._watched:
            self._watched = folder
            if self.watching.folder is None:
                self.watching.start(Path(folder).expanduser())

    def _model_changed(self, names: frozenset[str]) -> None:
        if "light" in names:
            self.live.stop()
            self._show_light()
        if self._services.model.recapture:
            self._services.model.update(recapture=False)
            self.taking.start("full", self.resolve().timer_s, back=True)
        if names & _FIELDS:
            self._refresh()

    def _look_for_places(self) -> None:
        """While no place is open, list the places that can be opened."""
        if self._services.model.light is None:
            self.places.attach(self)

    def _recent(self) -> tuple[PlacesListRow, ...]:
        model = self._services.model
        if model.light is not None or model.opening or self.taking.active:
            return ()
        rows = self.places.resolve().rows
        return tuple(row for row in rows if row.unfinished is None or row.unfinished.can_finish)[
            :_RECENT
        ]

    def _show_light(self) -> None:
        self.panorama.show_light()
        self._look_for_places()


def _kind(place: Place, findings: Findings | None) -> Kind:
    """Return the kind of light at the place. It determines how soon the light is out of date."""
    location = place.location
    if location.sun:
        return "sun"
    if location.kind == "outdoor":
        return "sky"
    if findings is None or location.kind != "indoor":
        return "unknown"
    shares = [lamp.share for lamp in findings.lamps if lamp.kind != "lamp"]
    return "windows" if any(share >= _WINDOWS for share in shares) else "unknown"
