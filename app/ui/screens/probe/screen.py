"""The probe: from a camera, files or a folder to the light of a place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.findings import Findings
from app.core.places.files.frames import frame_pictures
from app.core.places.place import Place
from app.core.portrait.age import Age, Kind, light_age
from app.core.solver.place_light import PlaceLight
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.lamps_here import lamps_here
from app.ui.presenters.model import Step
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.places_list import PlacesListPresenter, PlacesListRow, PlacesListState
from app.ui.presenters.services import Presenter, Services
from app.ui.screens.probe.cameras import CameraFinder, Watching
from app.ui.screens.probe.capture import CaptureControl
from app.ui.screens.probe.filming import Filming
from app.ui.screens.probe.live import LivePreview
from app.ui.screens.probe.notices import (
    advice_notice,
    frames_note,
    lamp_rows,
    metered_of,
    plan_parts,
    tile_of,
)
from app.ui.screens.probe.state import (
    CameraBlock,
    ChoiceRow,
    FrameTile,
    Notice,
    ProbeState,
    ProbeView,
)
from app.words.portrait.age import age_words

BEAT_MS: Final = 100
"""How often a capture that is seen is asked for what it has to show."""
SLOW_BEAT_MS: Final = 1000
"""How often a view should call `ProbePresenter.tick`."""

_AGE_S: Final = 15.0
_RECENT: Final = 4
_TIMERS: Final = (0, 2, 5, 10)
_WINDOWS: Final = 0.1
_MARKERS: Final = {"walk": tr("Photographer stands here"), "selfie": tr("You face this way now")}
_FIELDS: Final = frozenset(
    {"place", "place_folder", "light", "opening", "front_deg", "camera", "settings", "head"}
)


class ProbePresenter(Presenter[ProbeView]):
    """Measures the light of a place."""

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._light: PlaceLight | None = None
        self._findings: Findings | None = None
        self._picture: NDArray[np.uint8] | None = None
        self._exposure = self._target_ev = 0.0
        self._exposing = False
        self._frames: tuple[NDArray[np.uint8] | None, ...] = ()
        self._layers = ProbeState().layers
        self._ticked: frozenset[str] = frozenset()
        self._age_at = services.clock.now()
        self._watched = ""
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
        self._take_light()

    # -- screen --------------------------------------------------------------------------------

    def enter(self) -> None:
        """Look for cameras, and for what was interrupted."""
        if not self.taking.active:
            self.cameras.begin()
            self.taking.look_for_unfinished()
        self._watch_as_set()
        self._look_for_places()
        self._refresh()

    def leave(self) -> None:
        """Stop searching, and the preview; a capture continues."""
        self.cameras.pause()
        self.live.stop()
        self.filming.stop()

    def tick(self) -> None:
        """Take what a capture has to show, and say how old the light is; called by the view."""
        now = self._services.clock.now()
        self.live.tick()
        self.filming.tick()
        if self.taking.tick() or now - self._age_at >= _AGE_S:
            self._age_at = now
            self._refresh()

    def actions(self) -> Sequence[Action]:
        """Give what can be done here."""

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
        """Make an action of the view's, which does nothing while none is attached."""
        return lambda: None if self._view is None else act(self._view)

    # -- state ---------------------------------------------------------------------------------

    def resolve(self) -> ProbeState:
        """Work out what the screen shows now."""
        model = self._services.model
        place, light, settings = model.place, model.light, model.settings
        block = self.cameras.block()
        plans = plan_parts(model.camera, metered_of(None if place is None else place.capture))
        running = self.taking.running()
        age = self._age()
        findings = self._findings
        rough = place is not None and place.capture is not None and place.capture.plan == "rough"
        why_not = tr("The camera asks for a password.") if block.asks_password else ""
        why_not = tr("There is no camera yet.") if block.missing else why_not
        # Files can always be asked for.
        why_not = why_not if settings.measure_with == "camera" else ""
        lamps_note = ""
        if light is not None and findings is None:
            lamps_note = tr("Looking for lamps…")
        elif findings is not None and not findings.lamps:
            lamps_note = tr("No lamp stands out: the light comes from everywhere.")
        return ProbeState(
            picture=self._picture,
            findings=findings,
            front_deg=model.front_deg,
            marker_words=_MARKERS.get(settings.mode, _MARKERS["walk"]),
            exposure_ev=self._target_ev,
            layers=self._layers,
            lamps=() if findings is None else lamp_rows(findings, model.front_deg, rough=rough),
            lamps_note=lamps_note,
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
        return advice_notice(place, self._findings, full, block)

    def _tiles(self, place: Place | None) -> tuple[FrameTile, ...]:
        facts = () if place is None or place.capture is None else place.capture.frames
        pictures = (*self._frames, *(None for _ in facts))
        values = [(one.ev, one.shutter_s, one.clipped_share) for one in facts]
        return tuple(tile_of(*one, picture) for one, picture in zip(values, pictures, strict=False))

    def _age(self) -> Age | None:
        place = self._services.model.place
        if place is None or place.measured_at is None or self._services.model.light is None:
            return None
        # It is unknown when a panorama from a file was measured.
        if place.capture is not None and place.capture.plan == "panorama":
            return None
        return light_age(
            place.measured_at,
            self._services.today(),
            _kind(place, self._findings),
            place.location.sun_elevation_deg,
        )

    # -- what the user does --------------------------------------------------------------------

    def main(self) -> None:
        """Do what the amber button says."""
        if self._services.model.light is not None and not self.taking.active:
            self.see_styles()
        elif self.resolve().can_capture or self.taking.active:
            self.capture()
        else:
            self.open_demo()

    def see_styles(self) -> None:
        """Continue to the styles."""
        self._services.model.update(step=Step.STYLES, painting=None)

    def capture(self) -> None:
        """Capture with the chosen plan, or ask for what was taken in another way."""
        settings = self._services.model.settings
        if settings.measure_with != "camera" and not self.taking.active:
            self._on_view(lambda view: view.ask_measured(settings.measure_with))()
            return
        self.taking.start(settings.plan, self.resolve().timer_s)

    def preview(self) -> None:
        """Open what the camera sees, or close it; for a film, begin it or end it."""
        if self._services.model.settings.measure_with == "film" or self.filming.live is not None:
            self.filming.toggle()
        else:
            self.live.toggle()

    def press(self, key: str) -> None:
        """Do what a button of the notice says."""
        settings = self._services.model.settings
        if key == "capture-full":
            self.taking.start("full", self.resolve().timer_s)
        elif key == "search":
            self.cameras.search()
        else:
            self.taking.press(key, settings.plan, self.resolve().timer_s)

    def set(self, key: str, value: object) -> None:
        """Change a setting, such as the plan; it stays chosen."""
        self._services.model.set(key, value)

    def set_timer(self, seconds: int) -> None:
        """Change the self-timer."""
        self.set("self_timer_s", seconds)

    def tick_off(self, key: str) -> None:
        """Mark a line of the list as done, or take that back."""
        self._ticked = self._ticked ^ {key}
        self._refresh()

    def expose(self, stops: float) -> None:
        """Show the panorama brighter or darker by so many stops."""
        self._target_ev = stops
        self._expose()
        self._refresh()

    def show_layer(self, name: str, on: bool) -> None:
        """Show or hide ``clipped``, ``lamps`` or ``grid``."""
        self._layers = self._layers | {name} if on else self._layers - {name}
        self._refresh()

    # -- inside --------------------------------------------------------------------------------

    def _watch_as_set(self) -> None:
        """Begin to watch the folder of the settings, once for each that is set."""
        folder = self._services.model.settings.watch_folder
        if folder and folder != self._watched:
            self._watched = folder
            if self.watching.folder is None:
                self.watching.start(Path(folder).expanduser())

    def _model_changed(self, names: frozenset[str]) -> None:
        if "light" in names:
            self.live.stop()
            self._take_light()
        if self._services.model.recapture:
            self._services.model.update(recapture=False)
            self.taking.start("full", self.resolve().timer_s, back=True)
        if names & _FIELDS:
            self._refresh()

    def show_state(self, state: PlacesListState) -> None:
        """Take the list of places."""
        del state
        self._refresh()

    def _look_for_places(self) -> None:
        """Read which places can be opened, while none is."""
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

    def _take_light(self) -> None:
        """Begin with another light: its lamps and frames are looked for."""
        model = self._services.model
        light, place, folder = model.light, model.place, model.place_folder
        self._light = light
        self._findings, self._frames = None, ()
        self._exposure = self._target_ev = 0.0
        self._picture = None if light is None else light.display
        if light is None:
            self._look_for_places()
            return
        facts = None if place is None else place.capture
        self._services.runner.submit(
            "findings",
            lambda *_: lamps_here(light, facts),
            done=lambda findings: self._take_findings(light, findings),
            failed=lambda error: self._services.notify.tell_error(error),
        )
        if facts is not None and facts.frames:
            self._services.runner.submit(
                "frame-pictures",
                lambda *_: frame_pictures(folder, facts, light.environment.radiance),
                done=lambda pictures: self._pictured(light, pictures),
                failed=lambda error: None,
            )

    def _take_findings(self, light: PlaceLight, findings: Findings) -> None:
        if light is self._light:
            self._findings = findings
            self._refresh()

    def _pictured(self, light: PlaceLight, pictures: tuple[NDArray[np.uint8] | None, ...]) -> None:
        if light is self._light:
            self._frames = pictures
            self._refresh()

    def _expose(self) -> None:
        """Make the picture at the wanted exposure; one at a time, the newest wish next."""
        light, stops = self._light, self._target_ev
        if light is None or self._exposing or stops == self._exposure:
            return
        if stops == 0.0:
            self._exposure, self._picture = 0.0, light.display
            return
        self._exposing = True
        radiance, width = light.environment.radiance, light.display.shape[1]
        self._services.runner.submit(
            "exposure",
            lambda *_: display_panorama(radiance, stops, width),
            done=lambda picture: self._exposed(light, stops, picture),
            failed=lambda error: self._exposed(light, stops, light.display),
            cancelled=lambda: self._exposed(light, stops, light.display),
        )

    def _exposed(self, light: PlaceLight, stops: float, picture: NDArray[np.uint8]) -> None:
        self._exposing = False
        if light is self._light:
            self._exposure, self._picture = stops, picture
        self._expose()
        self._refresh()


def _kind(place: Place, findings: Findings | None) -> Kind:
    """Say what lights a place, for how soon that changes; nothing where it is not certain."""
    location = place.location
    if location.sun:
        return "sun"
    if location.kind == "outdoor":
        return "sky"
    if findings is None or location.kind != "indoor":
        return "unknown"
    shares = [lamp.share for lamp in findings.lamps if lamp.kind != "lamp"]
    return "windows" if any(share >= _WINDOWS for share in shares) else "unknown"
