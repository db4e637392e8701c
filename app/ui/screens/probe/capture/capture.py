"""Starts, stops and resumes captures from the screen, and repeats them at the same spot."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from app.core.base.angles import wrap
from app.core.base.errors import Cancelled
from app.core.guidance.beeps import chime
from app.core.localization.recapture_registration import Registration
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
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import Step
from app.ui.screens.probe.capture.camera import CameraFinder
from app.ui.screens.probe.capture.distant_sign import DistantSign, sign_of
from app.ui.screens.probe.capture.frames import FrameTile, tile_of
from app.ui.screens.probe.capture.notice import HowFar, Notice, offer_notice, trouble_notice
from app.words.measure.preview import rough_words
from app.words.photos import registration_words
from app.words.phrases.quantities import place_name, time_words
from app.words.remarks import remark_words


@dataclass(frozen=True, slots=True)
class Running:
    """A capture in progress.

    Attributes:
        stopping: Whether the capture has been asked to stop and is restoring the camera's
            settings.
    """

    rough: str = ""
    stopping: bool = False
    sign: DistantSign = field(default_factory=DistantSign)


KEY: Final = "capture"

_LOOKED_AT: Final = ("needle_deg", "goal_deg", "chosen")

_STOPPING: Final = tr("Restoring the camera’s settings")


@dataclass(frozen=True, slots=True)
class _CarryOver:
    """Data that a new capture at the same spot takes over from the previous capture."""

    folder: Path
    place: Place
    front_deg: float
    looked_at: dict[str, Any]
    back: bool
    registration: Registration | None = None


class CaptureControl:
    """Controls the running capture and provides the notice about the last one."""

    def __init__(
        self,
        services: Services,
        place_controller: PlaceController,
        cameras: CameraFinder,
        free_camera: Callable[[], None],
        changed: Callable[[], None],
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._cameras = cameras
        self._free_camera = free_camera
        self._changed = changed
        self._recording: Recording | None = None
        self._last: Recording | None = None
        self._progress: CaptureProgress | None = None
        self._stopping = False
        self._exposes_at = 0.0
        self._count = 0  # seconds left on the self-timer
        self._last_words = ""
        self._trouble: Notice | None = None
        self._offers: tuple[UnfinishedPlace, ...] = ()
        self._skips: set[Path] = set()
        self._carry_over: _CarryOver | None = None
        self._origin: _CarryOver | None = None
        services.model.changed.connect(self._model_changed)
        place_controller.finisher = self.finish

    # -- state ---------------------------------------------------------------------------------

    @property
    def active(self) -> bool:
        """Whether a capture is running."""
        return self._recording is not None

    @property
    def notice(self) -> Notice | None:
        """The notice about an error or a resumable capture, or None if there is neither."""
        if self._trouble is not None:
            return self._trouble
        offers = self._open_offers()
        if not offers:
            return None
        return offer_notice(offers[0], time_words(offers[0].made_at, self._services.today()))

    def _open_offers(self) -> list[UnfinishedPlace]:
        return [each for each in self._offers if (each.session or each.folder) not in self._skips]

    def running(self) -> Running | None:
        """Return the running capture, or None if there is none."""
        recording, progress = self._recording, self._progress
        if recording is None:
            return None
        status = Status() if progress is None else progress.status
        sign = sign_of(status, self._count, recording.order.delay_s)
        if self._stopping:
            sign = DistantSign(big=tr("Stopping"), caption=_STOPPING)
        return Running(
            rough="" if progress is None else rough_words(progress.rough),
            stopping=self._stopping,
            sign=replace(sign, picture=None if progress is None else progress.metered),
        )

    def tiles(self) -> tuple[FrameTile, ...]:
        """Return the frames of the running capture, brightest first."""
        progress = self._progress
        if self._recording is None or progress is None:
            return ()
        tiles = []
        for number, shot in enumerate(progress.shots):
            picture = progress.pictures[number] if number < len(progress.pictures) else None
            rows = progress.status.frames
            row = rows[number] if number < len(rows) else None
            arrived = 0.0 if row is None else 1.0 if row.done else 0.0
            if row is not None and not row.done and row.size:
                arrived = min(row.received / row.size, 1.0)
            share = None if picture is None else clipped_in(picture)
            tile = tile_of(shot.wanted_ev, shot.exposure.shutter_s, share, picture, arrived)
            tiles.append((shot.ev_offset, tile))
        return tuple(tile for _, tile in sorted(tiles, key=lambda each: -each[0]))

    # -- user actions --------------------------------------------------------------------------

    def start(self, plan: str, delay_s: int, *, back: bool = False) -> None:
        """Start a capture. If a place is open, the capture takes over its name, spot and notes.

        Args:
            plan: Key of the plan.
            delay_s: Length of the self-timer, in seconds.
            back: Whether to return to the Styles screen afterwards.
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
            self._origin = _CarryOver(folder, place, model.front_deg, looked_at, back=back)
        self._run(order)

    def cancel(self) -> None:
        """Stop the capture and restore the camera's settings."""
        if self.active:
            self._stopping = True
            self._services.runner.cancel(KEY)
            self._changed()

    def press(self, key: str, plan: str, delay_s: int) -> None:
        """Perform the action of a button on the notice."""
        if key == "again":
            self.start(plan, delay_s)
        elif key in ("resume", "merge") and self._last is not None:
            last = self._last
            if last.folder is not None and last.session is not None:
                self._go_on(last.folder, last.session, plan, merge=key == "merge")
        elif key in ("resume-offer", "merge-offer", "leave-offer"):
            self._take_offer(key)

    def finish(self, offer: UnfinishedPlace) -> None:
        """Resume a capture. If frames are missing, first offer the user a choice."""
        if self.active or offer.session is None:
            return
        self._trouble = None
        self._skips.discard(offer.session)
        others = [each for each in self._offers if each.session != offer.session]
        self._offers = (offer, *others)
        if offer.total and offer.here == offer.total:
            self._take_offer("resume-offer")
        self._changed()

    def look_for_unfinished(self) -> None:
        """Look for captures that were interrupted, for example by a crash."""
        places = self._services.folders.places
        self._services.runner.submit(
            "unfinished",
            lambda *_: list_unfinished(places),
            done=self._offer,
            failed=lambda error: None,
        )

    def tick(self) -> bool:
        """Read the capture's progress, and return whether anything has changed."""
        recording, now = self._recording, self._services.clock.now()
        if recording is None:
            return False
        progress = recording.box.get()
        if progress is not None:
            self._progress = progress
            if progress.status.timer_s:
                self._exposes_at = now + progress.status.timer_s
        count = max(math.ceil(self._exposes_at - now), 0)
        if progress is None and count == self._count:
            return False
        self._count = count
        running = self.running()
        settings, sign = (
            self._services.model.settings,
            DistantSign() if running is None else running.sign,
        )
        if sign.spoken not in ("", self._last_words):
            self._last_words = sign.spoken
            if sign.kind == "move" and settings.sounds:
                self._services.sounds.play(chime(), settings.volume / 100.0)
            if settings.voice:
                self._services.sounds.say(sign.spoken)
        return True

    # -- the job -------------------------------------------------------------------------------

    def _order(self, plan: str) -> CaptureOrder:
        model = self._services.model
        camera = None if model.camera is None else model.camera.device
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
        offer = offers[0]
        self._skips.add(offer.session or offer.folder)
        if key != "leave-offer":
            self._origin = None
            if offer.session is None:
                self._place_controller.finish(offer)
            else:
                self._go_on(offer.folder, offer.session, offer.plan, merge=key == "merge-offer")
        self._changed()

    def _run(self, order: CaptureOrder, *, merge: bool = False) -> None:
        services = self._services
        self._free_camera()
        recording = Recording(order)
        self._recording = self._last = recording
        self._progress, self._trouble = None, None
        self._stopping = False
        self._exposes_at, self._count, self._last_words = 0.0, 0, ""
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

    def _done(self, capture: CapturedPlace) -> None:
        self.tick()
        if self._recording is not None:
            # Without this, the merged panorama would stay in memory until the next capture.
            self._recording.capture = None
        self._end()
        camera = self._services.model.camera
        if camera is not None:
            self._cameras.worked(camera.device)
        if self._origin is not None:
            self._carry_over = replace(
                self._origin, folder=capture.folder, registration=capture.registration
            )
        self._origin = None
        for warning in capture.result.warnings:
            if warning not in capture.result.probe.warnings:
                self._services.notify.tell(remark_words(warning), kind="warning")
        self._place_controller.take_capture(capture)
        self._changed()

    def _failed(self, error: Exception) -> None:
        recording = self._recording
        self.tick()
        progress = self._progress
        self._end()
        if isinstance(error, Cancelled) or recording is None:
            self._changed()
            return
        if isinstance(error, PasswordNeeded):
            self._cameras.ask_password(error)
        removed = tidy(recording)
        self._trouble = trouble_notice(error, _how_far(recording, progress, removed))
        self._changed()

    def _cancelled(self) -> None:
        recording = self._recording
        if recording is not None and recording.capture is not None:
            # The capture had finished before it could be stopped.
            self._done(recording.capture)
            return
        self._end()
        if recording is not None and not tidy(recording, given_up=True):
            if recording.session is not None:
                self._skips.add(recording.session)
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

    def _offer(self, offers: tuple[UnfinishedPlace, ...]) -> None:
        last = None if self._last is None else self._last.folder
        # Leave out the failed capture, which has its own notice, and the place being saved.
        folders = {last, self._services.model.place_folder}
        self._offers = tuple(each for each in offers if each.folder not in folders)
        self._changed()

    # -- the same spot again -------------------------------------------------------------------

    def _model_changed(self, names: frozenset[str]) -> None:
        carry_over = self._carry_over
        if "place_folder" in names:
            self._trouble = None
        model = self._services.model
        if carry_over is None or model.place_folder != carry_over.folder or model.place is None:
            return
        self._carry_over = None
        registration = carry_over.registration
        if carry_over.back:
            model.update(chosen=carry_over.looked_at["chosen"], step=Step.STYLES)
        if registration is None or not registration.trusted:
            words = tr("Turns are not carried over from the last capture.")
            if registration is not None:
                words = f"{words} {registration_words(registration)}"
            self._services.notify.tell(words, kind="warning")
            return
        # Turns are relative to the photographer, who has not moved, so they stay the same.
        model.update(
            place=replace(model.place, spot=carry_over.place.spot, notes=carry_over.place.notes),
            front_deg=wrap(registration.carried(carry_over.front_deg)),
            **carry_over.looked_at,
        )
        self._services.notify.tell(registration_words(registration), kind="done")


def _stopped_words(recording: Recording) -> str:
    journal = recording.journal
    if journal is not None and journal.settings_to_restore:
        return tr(
            "Capture stopped. The camera’s own settings could not be restored: "
            "connect to the camera and resume this capture."
        )
    return tr("Capture stopped. The frames so far are saved; the camera’s settings are restored.")


def _how_far(recording: Recording, progress: CaptureProgress | None, removed: bool) -> HowFar:
    journal = recording.journal
    if removed or journal is None:
        return HowFar()
    here = sum(frame.done for frame in journal.frames)
    total = 0 if journal.plan is None else len(journal.plan.shots)
    stage = "" if progress is None else progress.status.stage
    exposing = journal.stage == Stage.EXPOSING.value or stage == Stage.EXPOSING
    return HowFar(here, total, exposing and not here, recording.session is not None)
