"""A capture as a job: folder, camera, machine, and what is seen of it from the screens' thread.

The work runs in a thread of the runner's; what it sees is put into a mailbox, the newest in place
of the one before, and the presenter looks into it from time to time.
"""

from __future__ import annotations

import contextlib
import shutil
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Final, Literal

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage, srgb_encode, to_bytes
from app.core.base.errors import CoreError
from app.core.base.image_input import picture_bytes
from app.core.base.images import write_exr
from app.core.base.progress import Report, Token
from app.core.hdr.findings import clip_level, find
from app.core.hdr.finish import MergeOptions
from app.core.hdr.pipeline import measure
from app.core.hdr.planner import PlannedShot
from app.core.hdr.preview import rough_words
from app.core.localization.recapture_registration import Registered, register_again
from app.core.places.journal import SessionJournal, journal_in
from app.core.places.measurement import capture_facts, location_of, merged_light
from app.core.places.originals import ORIGINALS
from app.core.places.place import CaptureFacts, Place
from app.core.places.store import (
    PLACE,
    capture_folders,
    create_place,
    list_places,
    new_capture_folder,
    read_place,
)
from app.core.solver.place_light import PlaceLight
from app.core.solver.style_pack import StylePack, load_named_pack
from app.core.solver.turn_choice import LIMITS, Limits
from app.core.text import tr
from app.core.text.quantities import place_name
from app.devices.capture.machine import ENVIRONMENT, Capture, CaptureResult
from app.devices.capture.session import FILE as OWED
from app.devices.capture.session import Debts, Session
from app.devices.capture.status import Status
from app.devices.clock import Clock
from app.devices.mailbox import Mailbox
from app.devices.mjpeg import decode
from app.devices.profiles import profile_for
from app.devices.theta.client import Info, OscClient
from app.devices.theta.discovery import FoundCamera, described
from app.devices.theta.endpoint import ACCESS_POINT
from app.devices.theta.link import Credentials
from app.ui.presenters.services import Devices

_SIZE: Final = (256, 128)


def frame_pictures(
    folder: Path | None, facts: CaptureFacts, radiance: FloatImage
) -> tuple[Bytes | None, ...]:
    """Find small pictures of a place's frames.

    Args:
        radiance: NDArray[np.float32], (H, 2 H, 3). Linear Rec. 709 of the merge: where a file is
            elsewhere, what it must have looked like is made of it.

    Returns:
        tuple of ((128, w, 3) uint8 or None). SRGB, in the order of `facts.frames`.
    """
    homes = [] if folder is None else [folder, *reversed(capture_folders(folder))]
    level = clip_level([frame.ev for frame in facts.frames])
    darkest = min((frame.ev for frame in facts.frames), default=0.0)
    pictures: list[Bytes | None] = []
    for frame in facts.frames:
        paths = [home / ORIGINALS / frame.file for home in homes]
        path = next((each for each in paths if each.is_file()), None)
        picture = None if path is None else small_picture(path)
        if picture is None and level:
            picture = exposed_picture(radiance, 2.0 ** (frame.ev - darkest) / level)
        pictures.append(picture)
    return tuple(pictures)


def exposed_picture(radiance: FloatImage, gain: float) -> Bytes:
    """Expose a panorama as a camera without any tone mapping would.

    Args:
        radiance: NDArray[np.float32], (H, 2 H, 3). Linear Rec. 709.

    Returns:
        (128, 256, 3) uint8. SRGB.
    """
    small = cv2.resize(radiance, _SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(to_bytes(srgb_encode(np.clip(small * gain, 0.0, 1.0))), np.uint8)


_TILE_ROWS: Final = 128
_MOST_BYTES: Final = 256 << 20
_MOST_PIXELS: Final = 140_000_000
_CLIPPED_CODE: Final = 250


@dataclass(frozen=True, slots=True, eq=False)
class Order:
    """What is to be captured.

    Attributes:
        camera: None where only what is here is to be merged.
        pack: Head and styles; the generic one where None.
        first: (h, 2 h, 3) uint8 or None. Display panorama of the place that is captured again, to
            be laid on.
    """

    places: Path
    made_at: datetime
    camera: FoundCamera | None
    credentials: Credentials | None = None
    plan: Literal["paper", "full"] = "paper"
    delay_s: int = 0
    pack: StylePack | None = field(default=None, repr=False)
    limits: Limits = LIMITS
    name: str = ""
    spot: str = ""
    first: Bytes | None = field(default=None, repr=False)
    folder: Path | None = None
    session: Path | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What is to be seen of a capture at one moment.

    `pictures`: tuple of ((h, 2 h, 3) uint8 or None). Of the frames, small, in the order of
    shooting. `metered`: (h, 2 h, 3) uint8 or None. What was metered, small. All sRGB.
    """

    status: Status
    shots: tuple[PlannedShot, ...] = ()
    pictures: tuple[Bytes | None, ...] = field(default=(), repr=False)
    metered: Bytes | None = field(default=None, repr=False)
    rough: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Captured:
    """What came of it.

    `registered`: How it lies on the place that was captured again; None where there was none.
    """

    folder: Path
    place: Place
    light: PlaceLight = field(repr=False)
    result: CaptureResult
    registered: Registered | None = None


class Recording:
    """What a capture leaves behind, whatever happens; written by its thread."""

    def __init__(self, order: Order) -> None:
        self.box: Mailbox[Seen] = Mailbox()
        self.order = order
        self.began = order.folder is None
        self.folder = order.folder
        self.session = order.session
        self.captured: Captured | None = None
        self.journal: SessionJournal | None = None
        self._pack: StylePack | None = None
        self._open: Session | None = None
        self._pictures: dict[Path, Bytes | None] = {}
        self._metered: Bytes | None = None
        self._rough = ""

    def watch(self, session: Session, pack: StylePack) -> None:
        """Take what is seen from this session on."""
        self._open, self._pack = session, pack

    def show(self, status: Status) -> None:
        """Take a status; runs in the thread of the capture."""
        session = self._open
        if session is None:
            return
        self.journal = session.journal
        plan = self.journal.plan
        if self._metered is None and status.metered and self._pack is not None:
            self._metered = decode(status.metered)
            self._rough = rough_words(self._metered, self._pack)
        pictures = tuple(
            None if frame.thumbnail is None else self._picture(frame.thumbnail)
            for frame in status.frames
        )
        shots = () if plan is None else plan.shots
        self.box.put(Seen(status, shots, pictures, self._metered, self._rough))

    def _picture(self, path: Path) -> Bytes | None:
        if path not in self._pictures:
            self._pictures[path] = small_picture(path)
        return self._pictures[path]


def capture(
    order: Order, recording: Recording, devices: Devices, clock: Clock, token: Token, report: Report
) -> Captured:
    """Take a bracket and merge it.

    Raises:
        DeviceError: When the camera or the way to it fails.
        CoreError: When the files cannot be written or merged.
        Cancelled: When the token was cancelled.
    """
    pack = order.pack or load_named_pack("generic")
    folder, name, session = _begin(order, recording)
    recording.watch(session, pack)

    def on_status(status: Status) -> None:
        recording.show(status)
        report(status.fraction, status.message)

    camera = order.camera or described(ACCESS_POINT, "access point", Info(""))
    with contextlib.closing(devices.link(camera, order.credentials)) as link:
        result = Capture(
            OscClient(link, clock),
            session,
            clock,
            plan=order.plan,
            pack=pack,
            wishes=MergeOptions(limits=order.limits),
            delay_s=order.delay_s,
            on_status=on_status,
            token=token,
            debts=Debts(order.places.with_name(OWED)),
        ).run()
    return _finished(order, recording, folder, name, result)


def merge_kept(order: Order, recording: Recording, token: Token, report: Report) -> Captured:
    """Merge the frames of an unfinished session that are here, without the camera.

    Raises:
        CoreError: When they are too few, or cannot be merged.
        Cancelled: When the token was cancelled.
    """
    pack = order.pack or load_named_pack("generic")
    folder, name, session = _begin(order, recording)
    journal = session.journal
    paths = tuple(session.path_of(frame) for frame in journal.frames if frame.done)
    if journal.plan is None or len(paths) < 2:
        raise CoreError(tr("There are not enough frames here to merge."), tr("Capture again."))
    wishes = MergeOptions(limits=order.limits)
    probe = measure(paths, pack, wishes, token=token, report=report)
    target = session.folder / ENVIRONMENT
    merged = probe.merged
    write_exr(target, merged.radiance, merged.cd_m2)
    session.update(environment=ENVIRONMENT)
    result = CaptureResult(
        profile=profile_for(Info(journal.model)),
        info=None,
        plan=journal.plan,
        frames=paths,
        probe=probe,
        environment=target,
        warnings=tuple(dict.fromkeys((*journal.warnings, *probe.warnings))),
        seconds={},
    )
    return _finished(order, recording, folder, name, result)


def _begin(order: Order, recording: Recording) -> tuple[Path, str, Session]:
    """Make the folders, or open those that are gone on with."""
    if order.folder is not None and order.session is not None:
        return order.folder, read_place(order.folder).name, Session.open(order.session)
    name = order.name or place_name(order.made_at)
    folder = create_place(order.places, name, order.made_at, spot=order.spot)
    recording.folder = folder
    session = Session.open_or_create(new_capture_folder(folder))
    recording.session = session.folder
    return folder, name, session


def _finished(
    order: Order, recording: Recording, folder: Path, name: str, result: CaptureResult
) -> Captured:
    registered = None
    if order.first is not None and result.probe.bracket.panorama:
        with contextlib.suppress(ValueError):
            registered = register_again(order.first, result.probe.display)
    probe = result.probe
    kept = read_place(folder)
    if kept.name == place_name(kept.made_at):
        # The user has not named it yet.
        found = find(probe.merged.radiance, cd_m2=probe.merged.cd_m2)
        others = list_places(order.places)
        name = place_name(kept.made_at, found.light, [each.name for each in others])
    place = replace(
        kept,
        name=name,
        # When it was begun: one time for the head line, the list and the frames.
        measured_at=kept.made_at,
        location=location_of(probe),
        capture=capture_facts(probe, result.profile.title, result.plan.kind),
    )
    light = merged_light(probe, name)
    recording.captured = Captured(folder, place, light, result, registered)
    return recording.captured


def tidy(recording: Recording, *, given_up: bool = False) -> bool:
    """Remove the folder of a capture that took nothing.

    Only what this capture made itself is removed, and only where no picture is in it, nothing
    was exposed and the camera is owed nothing.

    `given_up`: The user stopped it: a part of a bracket stays on the camera and is not waited for.
    """
    folder, session = recording.folder, recording.session
    if not recording.began or folder is None or session is None or session.parent != folder:
        return False
    journal = journal_in(session)
    if journal is None or journal.owes or journal.exposed:
        return False
    if journal.frames and not given_up:
        return False
    with contextlib.suppress(OSError):
        if any((session / "originals").iterdir()) or capture_folders(folder) != (session,):
            return False
        if {entry.name for entry in folder.iterdir()} != {PLACE, session.name}:
            return False
        shutil.rmtree(folder)
        return True
    return False


def small_picture(path: Path) -> Bytes | None:
    """Read a small copy of a picture.

    Returns (128, w, 3) uint8 or None. SRGB; None where it cannot be read.
    """
    data = picture_bytes(path, _MOST_BYTES, _MOST_PIXELS)
    if data is None:
        return None
    try:
        found = cv2.imdecode(data, cv2.IMREAD_REDUCED_COLOR_8)
        if found is not None and found.shape[0] < _TILE_ROWS:
            found = cv2.imdecode(data, cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    if found is None or found.shape[0] < 2:
        return None
    columns = max(round(found.shape[1] * _TILE_ROWS / found.shape[0]), 1)
    small = cv2.resize(found, (columns, _TILE_ROWS), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.asarray(small, np.uint8)[..., ::-1])


def clipped_in(picture: Bytes) -> float:
    """Share of a small sRGB picture whose brightest channel is at its end, 0 to 1."""
    return float((picture.max(axis=2) >= _CLIPPED_CODE).mean())
