"""A capture from the first request to the environment on disk.

    connecting -> metering -> exposing -> downloading -> merging -> done / cancelled / failed

Each step is a function in another module. This module defines the order of the steps, the steps
that an interrupted session still needs, and the cleanup at the end of a capture, however it ends.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Final, Literal

from app.core.base.errors import Cancelled, CoreError
from app.core.base.imaging.images import write_exr
from app.core.base.progress import Progress, Token, span
from app.core.base.remarks import Remark
from app.core.measure.bracket.incoming_frames import ArrivingFrames
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.plan.planner import Plan
from app.core.styles.style_pack import StylePack
from app.core.text import tr
from app.devices.capture import (
    camera_settings,
    fetching,
    file_integrity,
    readiness,
)
from app.devices.capture.capture_job import CaptureJob
from app.devices.capture.exposures import bracket, metering, surplus_pictures
from app.devices.capture.reconnection import Contact
from app.devices.capture.session import Session
from app.devices.capture.status import Board, Stage, Status
from app.devices.capture.unrestored_settings import Debts
from app.devices.clock import Clock
from app.devices.errors import CaptureFailed, DeviceError
from app.devices.protocol_profiles import ModelProfile, profile_named
from app.devices.theta.client import OscClient
from app.devices.theta.messages import Info

ENVIRONMENT: Final = "environment.exr"
"""Name of the environment in the session's folder."""

_LAST_REJOIN_S: Final = 20.0
_IDLE_S: Final = 30.0


@dataclass(frozen=True, slots=True)
class CaptureResult:
    """The result of a capture.

    Attributes:
        info: The camera's description of itself, or None if the session was finished without the
            camera.
        seconds: Durations, in seconds, of "metering", "exposing", "download" and "merge".
    """

    profile: ModelProfile
    info: Info | None
    plan: Plan
    frames: tuple[Path, ...]
    probe: Measurement
    environment: Path
    warnings: tuple[Remark, ...]
    seconds: Mapping[str, float]


class Capture:
    """One capture, which runs on the caller's thread.

    It resumes an interrupted session without repeating downloads or shots.
    """

    def __init__(
        self,
        client: OscClient,
        session: Session,
        clock: Clock,
        *,
        plan: Literal["paper", "full"],
        pack: StylePack,
        wishes: MeasureOptions | None = None,
        delay_s: int = 0,
        on_status: Callable[[Status], None],
        token: Token,
        debts: Debts | None = None,
    ) -> None:
        board = Board(on_status)
        contact = Contact(client, clock, token, board.say)
        contact.serial = session.journal.serial  # Never apply these settings to another camera.
        self._job = CaptureJob(
            client=client,
            session=session,
            clock=clock,
            token=token,
            board=board,
            contact=contact,
            kind=plan,
            pack=pack,
            wishes=wishes or MeasureOptions(),
            delay_s=min(max(int(delay_s), 0), 10),
            arriving=ArrivingFrames(),
            profile=profile_named("generic"),
            debts=debts,
        )

    def run(self) -> CaptureResult:
        """Run the remaining steps. This may be called only once.

        Raises:
            DeviceError: If the camera or the connection fails. Any complete files stay in the
                session.
            CoreError: If the files cannot be written or merged.
            Cancelled: If the token is cancelled.
        """
        job = self._job
        with job.arriving:
            try:
                for stage in _stages(job):
                    job.token.check()
                    stage(job)
            except Cancelled as error:
                _stop(job)
                _end(job, Stage.CANCELLED, error)
                raise
            except DeviceError as error:
                reason = readiness.explain_error(job, error)
                _end(job, Stage.FAILED, reason)
                if reason is error:
                    raise
                raise reason from error
            except CoreError as error:
                _end(job, Stage.FAILED, error)
                raise
            except BaseException:
                _give_back(job)
                raise
            _end(job, Stage.DONE)
        return _result(job)

    def give_back(self) -> str:
        """Restore the settings that an earlier capture could not restore, and do nothing else.

        Returns:
            A sentence about settings that the camera refused, or "" if there are none.

        Raises:
            DeviceError: If the camera does not answer or is busy, or if another camera answers. In
                that case the settings still have to be restored.
            Cancelled: If the token is cancelled.
        """
        job = self._job
        with job.arriving:
            readiness.connect(job)
            readiness.wait_until_idle(job, _IDLE_S)
            untaken = camera_settings.restore(job.contact, job.session)
            surplus_pictures.delete_pictures(job.contact, job.session)
            _settle(job, job.session)
            return camera_settings.untaken_words(untaken)


def _stages(job: CaptureJob) -> tuple[Callable[[CaptureJob], None], ...]:
    """Return the steps that a session still needs, without the camera if all files are complete."""
    journal = job.session.journal
    if job.session.complete:
        return (_take_stock, _merge)
    if journal.plan is not None and (journal.exposed or journal.stage == Stage.EXPOSING.value):
        return (_connect, _find_again, _download, _merge)
    return (_connect, _restore_first, _meter, _expose, _download, _merge)


def _connect(job: CaptureJob) -> None:
    with job.timed("metering"):
        readiness.connect(job)


def _restore_first(job: CaptureJob) -> None:
    """Restore the settings of interrupted captures before they are mistaken for the user's own."""
    others = [] if job.debts is None else job.debts.of(job.contact.serial, job.session)
    for session in (*others, job.session):
        if session.owes:
            readiness.wait_until_idle(job, _IDLE_S)
            job.warn(camera_settings.restore_or_say(job.contact, session))
            surplus_pictures.delete_pictures(job.contact, session)
            _settle(job, session)
    if job.debts is not None:
        job.debts.note(job.session)


def _settle(job: CaptureJob, session: Session) -> None:
    if job.debts is not None:
        job.debts.settle(session)


def _meter(job: CaptureJob) -> None:
    with job.timed("metering"):
        job.session.update(stage=Stage.METERING.value, plan=None, frames=(), exposed=False)
        readiness.check_ready(job)
        metering.make_plan(job)


def _expose(job: CaptureJob) -> None:
    # Prepare now, while the camera shoots, since the user has to wait for the merge.
    job.arriving.prepare(job.pack)
    with job.timed("exposing"):
        bracket.expose(job)


def _find_again(job: CaptureJob) -> None:
    """Find the frames of an interrupted bracket on the camera, or shoot the bracket again."""
    now = job.clock.now()
    bracket.watch_if_busy(job, bracket.Run(now, now + bracket.deadline_s(job.plan, job.delay_s)))
    _restore_first(job)
    if job.session.journal.exposed:
        return
    frames = job.session.journal.frames
    try:
        with job.timed("exposing"):
            bracket.gather(job, least=len(job.plan.shots))
    except CaptureFailed:
        surplus_pictures.set_aside(job.contact, job.session, frames)
        job.warn(tr("The interrupted bracket was incomplete, so it was shot again."))
        _meter(job)
        _expose(job)


def _download(job: CaptureJob) -> None:
    with job.timed("download"):
        fetching.fetch(job)


def _take_stock(job: CaptureJob) -> None:
    """Start reading the frames on disk."""
    job.profile = profile_named("generic")
    job.paths = tuple(job.session.path_of(frame) for frame in job.session.journal.frames)
    for path in job.paths:
        job.arriving.add(path)


def _merge(job: CaptureJob) -> None:
    job.board.show(Stage.MERGING, tr("Checking the frames"))
    job.session.update(stage=Stage.MERGING.value)
    with job.timed("merge"):
        for sentence in file_integrity.check_frames(job.paths, job.plan):
            job.warn(sentence)
        times = file_integrity.planned_times(job.paths, job.plan)
        wishes = job.wishes if times is None else replace(job.wishes, times=times)

        def report(fraction: float, step: Progress) -> None:
            job.board.show(Stage.MERGING, step, fraction)

        job.probe = probe = job.arriving.measure(
            job.paths, replace(wishes, pack=job.pack), job.token, span(report, 0.0, 0.95)
        )
        target = job.session.folder / ENVIRONMENT
        merged = probe.merged
        write_exr(target, merged.radiance, merged.cd_m2)
        job.environment = target
    job.session.update(environment=ENVIRONMENT, seconds=dict(job.seconds))


def _stop(job: CaptureJob) -> None:
    """Stop the camera, ignoring failures. Its settings are restored in the next step."""
    if job.exposing:
        job.board.show(Stage.CANCELLED, tr("Stopping the camera"))
        with contextlib.suppress(DeviceError, CoreError):
            bracket.stop(job)


def _give_back(job: CaptureJob) -> str:
    """Restore the settings if the camera is reachable, and return a sentence about any failure."""
    if not job.session.owes:
        _settle(job, job.session)
        return ""
    try:
        contact = job.contact.unstoppable(_LAST_REJOIN_S)
        unrestored = camera_settings.restore_or_say(contact, job.session)
        if not job.session.journal.settings_to_restore:
            surplus_pictures.delete_pictures(contact, job.session)
        _settle(job, job.session)
    except CoreError as error:
        # Only the journal is out of date, and restoring twice is harmless.
        return error.message
    return unrestored


def _end(job: CaptureJob, stage: Stage, error: DeviceError | CoreError | None = None) -> None:
    """Restore the camera's settings, record the end in the journal, and show the final status."""
    unrestored = _give_back(job)
    if error is None:
        job.warn(unrestored)
    elif unrestored:
        error.hint = f"{error.hint} {unrestored}".strip()
        with contextlib.suppress(CoreError):  # Shown even if the disk is full.
            job.warn(unrestored)
    if stage is Stage.DONE:
        end_time = datetime.now().astimezone().isoformat(timespec="seconds")
        job.session.update(stage=stage.value, finished=end_time)
    job.board.show(stage, tr("Done") if error is None else error.message)


def _result(job: CaptureJob) -> CaptureResult:
    if job.probe is None or job.environment is None:
        raise CaptureFailed(tr("The capture did not finish."), tr("Start again."), "no-end")
    return CaptureResult(
        profile=job.profile,
        info=job.info,
        plan=job.plan,
        frames=job.paths,
        probe=job.probe,
        environment=job.environment,
        warnings=tuple(dict.fromkeys((*job.warnings, *job.probe.warnings))),
        seconds=dict(job.seconds),
    )
