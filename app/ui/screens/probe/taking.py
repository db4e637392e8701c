"""Captures from the screen's side: started, stopped, gone on with, and laid on the last."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from app.core.base.angles import wrap
from app.core.base.errors import Cancelled
from app.core.guidance.tones import chime
from app.core.localization.recapture_registration import Registered
from app.core.places.files.frames import clipped_in
from app.core.places.place import Place
from app.core.places.resume import UnfinishedPlace, list_unfinished
from app.core.text import tr
from app.devices.capture.place_capture import (
    CapturedPlace,
    CaptureOrder,
    CaptureProgress,
    Recording,
    capture,
    merge_kept,
    tidy,
)
from app.devices.capture.status import Stage, Status
from app.devices.errors import PasswordNeeded
from app.ui.presenters.model import Step
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.screens.probe.cameras import CameraFinder
from app.ui.screens.probe.notices import (
    HowFar,
    offer_notice,
    sign_of,
    tile_of,
    trouble_notice,
)
from app.ui.screens.probe.state import FrameTile, Notice, Running, Sign
from app.words.measure.preview import rough_words
from app.words.photos import registration_words
from app.words.phrases.quantities import place_name, time_words
from app.words.remarks import remark_words

KEY: Final = "capture"

_LOOKED_AT: Final = ("needle_deg", "goal_deg", "chosen")
_STOPPING: Final = tr("Giving the camera its settings back")


@dataclass(frozen=True, slots=True)
class _Carried:
    """What a new capture of a spot takes over from the one before."""

    folder: Path
    place: Place
    front_deg: float
    looked_at: dict[str, Any]
    back: bool
    registered: Registered | None = None


class Taking:
    """The capture that runs, and what is to be said of the last one."""

    def __init__(
        self,
        services: Services,
        desk: PlaceController,
        cameras: CameraFinder,
        free_camera: Callable[[], None],
        changed: Callable[[], None],
    ) -> None:
        self._services = services
        self._desk = desk
        self._cameras = cameras
        self._free_camera = free_camera
        self._changed = changed
        self._recording: Recording | None = None
        self._last: Recording | None = None
        self._seen: CaptureProgress | None = None
        self._stopping = False
        self._exposes_at = 0.0
        self._count = 0  # seconds of the self-timer that are still to go
        self._said = ""
        self._trouble: Notice | None = None
        self._offers: tuple[UnfinishedPlace, ...] = ()
        self._left: set[Path] = set()
        self._carried: _Carried | None = None
        self._origin: _Carried | None = None
        services.model.changed.connect(self._model_changed)
        desk.finisher = self.finish

    # -- what is shown -------------------------------------------------------------------------

    @property
    def active(self) -> bool:
        """Whether a capture runs."""
        return self._recording is not None

    @property
    def notice(self) -> Notice | None:
        """What went wrong, or which capture can be gone on with."""
        if self._trouble is not None:
            return self._trouble
        offers = self._open_offers()
        if not offers:
            return None
        return offer_notice(offers[0], time_words(offers[0].made_at, self._services.today()))

    def _open_offers(self) -> list[UnfinishedPlace]:
        return [each for each in self._offers if (each.session or each.folder) not in self._left]

    def running(self) -> Running | None:
        """Say how far the capture is; None while none runs."""
        recording, seen = self._recording, self._seen
        if recording is None:
            return None
        status = Status() if seen is None else seen.status
        sign = sign_of(status, self._count, recording.order.delay_s)
        if self._stopping:
            sign = Sign(big=tr("Stopping"), caption=_STOPPING)
        return Running(
            rough="" if seen is None else rough_words(seen.rough),
            stopping=self._stopping,
            sign=replace(sign, picture=None if seen is None else seen.metered),
        )

    def tiles(self) -> tuple[FrameTile, ...]:
        """Describe the frames of the running capture, brightest first."""
        seen = self._seen
        if self._recording is None or seen is None:
            return ()
        tiles = []
        for number, shot in enumerate(seen.shots):
            picture = seen.pictures[number] if number < len(seen.pictures) else None
            rows = seen.status.frames
            row = rows[number] if number < len(rows) else None
            arrived = 0.0 if row is None else 1.0 if row.done else 0.0
            if row is not None and not row.done and row.size:
                arrived = min(row.received / row.size, 1.0)
            share = None if picture is None else clipped_in(picture)
            tile = tile_of(shot.wanted_ev, shot.exposure.shutter_s, share, picture, arrived)
            tiles.append((shot.ev_offset, tile))
        return tuple(tile for _, tile in sorted(tiles, key=lambda each: -each[0]))

    # -- what the user does --------------------------------------------------------------------

    def start(self, plan: str, delay_s: int, *, back: bool = False) -> None:
        """Capture here, again if there is a place; what is known of it is carried over.

        `back`: lead to the styles again afterwards.
        """
        model = self._services.model
        if self.active or model.camera is None:
            return
        order = replace(self._order(plan), delay_s=delay_s)
        place, light, folder = model.place, model.light, model.place_folder
        self._origin = None
        if place is not None and light is not None and folder is not None:
            order = replace(order, name=place.name, spot=place.spot, first=light.display)
            looked_at = {name: getattr(model, name) for name in _LOOKED_AT}
            self._origin = _Carried(folder, place, model.front_deg, looked_at, back=back)
        self._run(order)

    def cancel(self) -> None:
        """Stop it; the camera gets its settings back."""
        if self.active:
            self._stopping = True
            self._services.runner.cancel(KEY)
            self._changed()

    def press(self, key: str, plan: str, delay_s: int) -> None:
        """Do what a button of `notice` says."""
        if key == "again":
            self.start(plan, delay_s)
        elif key in ("resume", "merge") and self._last is not None:
            last = self._last
            if last.folder is not None and last.session is not None:
                self._go_on(last.folder, last.session, plan, merge=key == "merge")
        elif key in ("resume-offer", "merge-offer", "leave-offer"):
            self._take_offer(key)

    def finish(self, found: UnfinishedPlace) -> None:
        """Resume a capture; where frames are missing, say first what can be done."""
        if self.active or found.session is None:
            return
        self._trouble = None
        self._left.discard(found.session)
        others = [each for each in self._offers if each.session != found.session]
        self._offers = (found, *others)
        if found.total and found.here == found.total:
            self._take_offer("resume-offer")
        self._changed()

    def look_for_unfinished(self) -> None:
        """Look whether a capture was interrupted, by a crash for instance."""
        places = self._services.folders.places
        self._services.runner.submit(
            "unfinished",
            lambda *_: list_unfinished(places),
            done=self._offer,
            failed=lambda error: None,
        )

    def tick(self) -> bool:
        """Take the newest that is to be seen; whether there was anything."""
        recording, now = self._recording, self._services.clock.now()
        if recording is None:
            return False
        seen = recording.box.get()
        if seen is not None:
            self._seen = seen
            if seen.status.timer_s:
                self._exposes_at = now + seen.status.timer_s
        count = max(math.ceil(self._exposes_at - now), 0)
        if seen is None and count == self._count:
            return False
        self._count = count
        running = self.running()
        settings, sign = self._services.model.settings, Sign() if running is None else running.sign
        if sign.spoken not in ("", self._said):
            self._said = sign.spoken
            if sign.kind == "move" and settings.sounds:
                self._services.sounds.play(chime(), settings.volume / 100.0)
            if settings.voice:
                self._services.sounds.say(sign.spoken)
        return True

    # -- the job -------------------------------------------------------------------------------

    def _order(self, plan: str) -> CaptureOrder:
        model = self._services.model
        camera = None if model.camera is None else model.camera.found
        return CaptureOrder(
            places=self._services.folders.places,
            made_at=self._services.today(),
            camera=camera,
            naming=place_name,
            credentials=None if camera is None else self._cameras.credentials(camera),
            plan="full" if plan == "full" else "paper",
            pack=None if model.head is None else model.head.pack,
        )

    def _go_on(self, folder: Path, session: Path, plan: str, *, merge: bool = False) -> None:
        model = self._services.model
        if self.active:
            return
        order = replace(self._order(plan), folder=folder, session=session)
        if self._origin is not None and model.light is not None:
            order = replace(order, first=model.light.display)
        self._run(order, merge=merge)

    def _take_offer(self, key: str) -> None:
        offers = self._open_offers()
        if not offers:
            return
        chosen = offers[0]
        self._left.add(chosen.session or chosen.folder)
        if key != "leave-offer":
            self._origin = None
            if chosen.session is None:
                self._desk.finish(chosen)
            else:
                self._go_on(chosen.folder, chosen.session, chosen.plan, merge=key == "merge-offer")
        self._changed()

    def _run(self, order: CaptureOrder, *, merge: bool = False) -> None:
        services = self._services
        self._free_camera()
        recording = Recording(order)
        self._recording = self._last = recording
        self._seen, self._trouble = None, None
        self._stopping = False
        self._exposes_at, self._count, self._said = 0.0, 0, ""
        self._set_busy(True)
        services.runner.submit(
            KEY,
            lambda token, report: (
                merge_kept(order, recording, token, report)
                if merge
                else capture(order, recording, services.devices.link, services.clock, token, report)
            ),
            title=tr("Merging the frames") if merge else tr("Capturing"),
            done=self._done,
            failed=self._failed,
            cancelled=self._cancelled,
        )
        self._changed()

    def _done(self, captured: CapturedPlace) -> None:
        self.tick()
        if self._recording is not None:
            # Else what was merged would stay in memory until the next capture.
            self._recording.captured = None
        self._end()
        camera = self._services.model.camera
        if camera is not None:
            self._cameras.worked(camera.found)
        if self._origin is not None:
            self._carried = replace(
                self._origin, folder=captured.folder, registered=captured.registered
            )
        self._origin = None
        for warning in captured.result.warnings:
            if warning not in captured.result.probe.warnings:
                self._services.notify.tell(remark_words(warning), kind="warning")
        self._desk.take_capture(captured)
        self._changed()

    def _failed(self, error: Exception) -> None:
        recording = self._recording
        self.tick()
        seen = self._seen
        self._end()
        if isinstance(error, Cancelled) or recording is None:
            self._changed()
            return
        if isinstance(error, PasswordNeeded):
            self._cameras.ask_password(error)
        removed = tidy(recording)
        self._trouble = trouble_notice(error, _how_far(recording, seen, removed))
        self._changed()

    def _cancelled(self) -> None:
        recording = self._recording
        if recording is not None and recording.captured is not None:
            # It had ended already when it was to stop.
            self._done(recording.captured)
            return
        self._end()
        if recording is not None and not tidy(recording, given_up=True):
            if recording.session is not None:
                self._left.add(recording.session)
            self._services.notify.tell(_stopped_words(recording))
        self._origin = None
        self._changed()

    def _end(self) -> None:
        self._recording = None
        self._stopping = False
        self._set_busy(False)
        self._cameras.refresh()

    def _set_busy(self, busy: bool) -> None:
        model = self._services.model
        if model.camera is not None:
            model.update(camera=replace(model.camera, busy=busy))

    def _offer(self, found: tuple[UnfinishedPlace, ...]) -> None:
        last = None if self._last is None else self._last.folder
        # What is said in its own words already is not offered a second time, nor what is shown
        # and just being kept.
        known = {last, self._services.model.place_folder}
        self._offers = tuple(each for each in found if each.folder not in known)
        self._changed()

    # -- the same spot again -------------------------------------------------------------------

    def _model_changed(self, names: frozenset[str]) -> None:
        carried = self._carried
        if "place_folder" in names:
            self._trouble = None
        model = self._services.model
        if carried is None or model.place_folder != carried.folder or model.place is None:
            return
        self._carried = None
        registered = carried.registered
        if carried.back:
            model.update(chosen=carried.looked_at["chosen"], step=Step.STYLES)
        if registered is None or not registered.trusted:
            words = tr("This capture starts afresh.")
            if registered is not None:
                words = f"{words} {registration_words(registered)}"
            self._services.notify.tell(words, kind="warning")
            return
        # Turns count from the photographer, who stands where they stood: they stay as they are.
        model.update(
            place=replace(model.place, spot=carried.place.spot, notes=carried.place.notes),
            front_deg=wrap(registered.carried(carried.front_deg)),
            **carried.looked_at,
        )
        self._services.notify.tell(registration_words(registered), kind="done")


def _stopped_words(recording: Recording) -> str:
    journal = recording.journal
    if journal is not None and journal.settings_to_restore:
        return tr(
            "Capture stopped. The camera could not be given its own settings back: "
            "connect to it and resume this capture."
        )
    return tr("Capture stopped. What was taken is kept; the camera has its own settings back.")


def _how_far(recording: Recording, seen: CaptureProgress | None, removed: bool) -> HowFar:
    journal = recording.journal
    if removed or journal is None:
        return HowFar()
    here = sum(frame.done for frame in journal.frames)
    total = 0 if journal.plan is None else len(journal.plan.shots)
    stage = "" if seen is None else seen.status.stage
    exposing = journal.stage == Stage.EXPOSING.value or stage == Stage.EXPOSING
    return HowFar(here, total, exposing and not here, recording.session is not None)
