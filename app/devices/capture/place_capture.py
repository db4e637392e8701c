"""A capture for a place: its folder, the camera, the capture itself and its progress.

The capture runs on the caller's thread and puts its progress into a mailbox, from which a screen
reads the latest state.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal

from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.imaging.images import write_exr
from app.core.base.progress import PhraseReport, Token
from app.core.localization.recapture_registration import Registration, register_again
from app.core.measure.options import MeasureOptions
from app.core.measure.plan.planner import PlannedShot
from app.core.measure.single.preview import RoughAnswer, answers_of
from app.core.measure.ways import measure
from app.core.places.files.frames import small_picture
from app.core.places.journal import SessionJournal
from app.core.places.place import Place
from app.core.places.place_folder import create_place, new_capture_folder, read_place
from app.core.places.place_measurement import NamePlace, place_of_capture
from app.core.places.resume import drop_empty_place
from app.core.solver.place_light import PlaceLight
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.core.text import tr
from app.devices.capture.capture_steps import ENVIRONMENT, Capture, CaptureResult
from app.devices.capture.session import Session
from app.devices.capture.status import Status
from app.devices.capture.unrestored_settings import FILE as OWED
from app.devices.capture.unrestored_settings import Debts
from app.devices.clock import Clock
from app.devices.latest_frame import Mailbox
from app.devices.mjpeg import decode
from app.devices.passwords import Credentials
from app.devices.protocol_profiles import profile_for
from app.devices.theta.camera_identity import FoundCamera, described
from app.devices.theta.client import OscClient
from app.devices.theta.endpoint import ACCESS_POINT
from app.devices.theta.link import Link
from app.devices.theta.messages import Info


@dataclass(frozen=True, slots=True, eq=False)
class CaptureOrder:
    """The parameters of a capture.

    Attributes:
        camera: The camera, or None to merge only the frames on disk.
        naming: Function that creates a name for a place that has none.
        pack: Head and styles to use, or None for the generic head.
        first: (h, 2 h, 3) uint8 or None. Earlier display panorama of a place that is being captured
            again, with which the new panorama is aligned.
    """

    places: Path
    made_at: datetime
    camera: FoundCamera | None
    naming: NamePlace
    credentials: Credentials | None = None
    plan: Literal["paper", "full"] = "paper"
    delay_s: int = 0
    pack: StylePack | None = field(default=None, repr=False)
    name: str = ""
    spot: str = ""
    first: Bytes | None = field(default=None, repr=False)
    folder: Path | None = None
    session: Path | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CaptureProgress:
    """The progress of a capture at one moment.

    Attributes:
        pictures: Tuple of ((h, 2 h, 3) uint8 or None), sRGB. Thumbnails of the frames in shooting
            order.
        metered: (h, 2 h, 3) uint8 or None, sRGB. Thumbnail of the metering photo.
    """

    status: Status
    shots: tuple[PlannedShot, ...] = ()
    pictures: tuple[Bytes | None, ...] = field(default=(), repr=False)
    metered: Bytes | None = field(default=None, repr=False)
    rough: tuple[RoughAnswer, ...] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CapturedPlace:
    """The place of a finished capture.

    Attributes:
        registration: Alignment with the earlier panorama of the same place, or None if the two were
            not aligned.
    """

    folder: Path
    place: Place
    light: PlaceLight = field(repr=False)
    result: CaptureResult
    registration: Registration | None = None


class Recording:
    """The state of a capture, updated by the capture thread and kept even after a failure."""

    def __init__(self, order: CaptureOrder) -> None:
        self.box: Mailbox[CaptureProgress] = Mailbox()
        self.order = order
        self.began = order.folder is None
        self.folder = order.folder
        self.session = order.session
        self.capture: CapturedPlace | None = None
        self.journal: SessionJournal | None = None
        self._pack: StylePack | None = None
        self._open: Session | None = None
        self._pictures: dict[Path, Bytes | None] = {}
        self._metered: Bytes | None = None
        self._rough: tuple[RoughAnswer, ...] | None = None

    def watch(self, session: Session, pack: StylePack) -> None:
        """Start reporting the progress of this session."""
        self._open, self._pack = session, pack

    def show(self, status: Status) -> None:
        """Put a status into the mailbox. This is called on the capture thread."""
        session = self._open
        if session is None:
            return
        self.journal = session.journal
        plan = self.journal.plan
        if self._metered is None and status.metered and self._pack is not None:
            self._metered = decode(status.metered)
            self._rough = answers_of(self._metered, self._pack)
        pictures = tuple(
            None if frame.thumbnail is None else self._picture(frame.thumbnail)
            for frame in status.frames
        )
        shots = () if plan is None else plan.shots
        self.box.put(CaptureProgress(status, shots, pictures, self._metered, self._rough))

    def _picture(self, path: Path) -> Bytes | None:
        if path not in self._pictures:
            self._pictures[path] = small_picture(path)
        return self._pictures[path]


def capture(
    order: CaptureOrder,
    recording: Recording,
    connect: Callable[[FoundCamera, Credentials | None], Link],
    clock: Clock,
    token: Token,
    report: PhraseReport,
) -> CapturedPlace:
    """Shoot a bracket and merge it.

    Raises:
        DeviceError: If the camera or the connection fails.
        CoreError: If the files cannot be written or merged.
        Cancelled: If the token is cancelled.
    """
    pack = order.pack or load_named_pack("generic")
    folder, name, session = _begin(order, recording)
    recording.watch(session, pack)

    def on_status(status: Status) -> None:
        recording.show(status)
        report(status.fraction, status.message)

    camera = order.camera or described(ACCESS_POINT, "access point", Info(""))
    with contextlib.closing(connect(camera, order.credentials)) as link:
        result = Capture(
            OscClient(link, clock),
            session,
            clock,
            plan=order.plan,
            pack=pack,
            delay_s=order.delay_s,
            on_status=on_status,
            token=token,
            debts=Debts(order.places.with_name(OWED)),
        ).run()
    return _finish(order, recording, folder, name, result)


def merge_kept(
    order: CaptureOrder, recording: Recording, token: Token, report: PhraseReport
) -> CapturedPlace:
    """Merge the frames that an unfinished session has on disk, without using the camera.

    Raises:
        CoreError: If there are too few frames, or they cannot be merged.
        Cancelled: If the token is cancelled.
    """
    pack = order.pack or load_named_pack("generic")
    folder, name, session = _begin(order, recording)
    journal = session.journal
    paths = tuple(session.path_of(frame) for frame in journal.frames if frame.done)
    if journal.plan is None or len(paths) < 2:
        raise CoreError(tr("There are not enough frames to merge."), tr("Capture again."))
    options = MeasureOptions(pack=pack)
    probe = measure("bracket", paths, options, token, report)
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
    return _finish(order, recording, folder, name, result)


def _begin(order: CaptureOrder, recording: Recording) -> tuple[Path, str, Session]:
    """Create the folders, or open those of an interrupted capture."""
    if order.folder is not None and order.session is not None:
        return order.folder, read_place(order.folder).name, Session.open(order.session)
    name = order.name or order.naming(order.made_at, "", ())
    folder = create_place(order.places, name, order.made_at, spot=order.spot)
    recording.folder = folder
    session = Session.open_or_create(new_capture_folder(folder))
    recording.session = session.folder
    return folder, name, session


def _finish(
    order: CaptureOrder, recording: Recording, folder: Path, name: str, result: CaptureResult
) -> CapturedPlace:
    registration = None
    if order.first is not None and result.probe.bracket.panorama:
        with contextlib.suppress(ValueError):
            registration = register_again(order.first, result.probe.display)
    camera, plan = result.profile.title, result.plan.kind
    place, light = place_of_capture(
        folder, order.places, name, result.probe, camera, plan, order.naming
    )
    recording.capture = CapturedPlace(folder, place, light, result, registration)
    return recording.capture


def tidy(recording: Recording, *, given_up: bool = False) -> bool:
    """Remove a capture's folder if it contains no photos and this capture created it."""
    folder, session = recording.folder, recording.session
    if not recording.began or folder is None or session is None:
        return False
    return drop_empty_place(folder, session, given_up=given_up)
