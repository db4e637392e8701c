"""The state of one capture: its settings, its tools and its results so far."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from app.core.base.progress import Token
from app.core.base.remarks import PlainRemark, Remark
from app.core.measure.bracket.incoming_frames import ArrivingFrames
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.plan.planner import Plan
from app.core.styles.style_pack import StylePack
from app.core.text import tr
from app.devices.capture.reconnection import Contact
from app.devices.capture.session import Session
from app.devices.capture.status import Board
from app.devices.capture.unrestored_settings import Debts
from app.devices.clock import Clock
from app.devices.errors import CaptureFailed
from app.devices.protocol_profiles import ModelProfile
from app.devices.theta.client import OscClient
from app.devices.theta.messages import Info


@dataclass(slots=True)
class CaptureJob:
    """One capture in progress, with everything that its steps share.

    Attributes:
        client, contact: Client for the camera, and the wrapper that retries its requests.
        session, board: Folder of the capture with its journal, and the board that shows the status.
        debts: The captures whose camera settings still have to be restored, or None to keep no such
            record.
        profile: The camera's profile.
        info: The camera's description of itself, or None until the camera answers.
    """

    client: OscClient
    session: Session
    clock: Clock
    token: Token
    board: Board
    contact: Contact
    kind: Literal["paper", "full"]
    pack: StylePack
    wishes: MeasureOptions
    delay_s: int
    arriving: ArrivingFrames
    profile: ModelProfile
    debts: Debts | None = None
    info: Info | None = None
    exposing: bool = False
    paths: tuple[Path, ...] = ()
    probe: Measurement | None = None
    environment: Path | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[Remark] = field(default_factory=list)

    @property
    def plan(self) -> Plan:
        """The planned bracket.

        Raises:
            CaptureFailed: If there is no plan yet.
        """
        plan = self.session.journal.plan
        if plan is None:
            raise CaptureFailed(tr("No bracket has been planned."), tr("Start again."), "no-plan")
        return plan

    def warn(self, warning: Remark | str) -> None:
        """Add a warning for the user unless it is already there."""
        remark = PlainRemark(warning) if isinstance(warning, str) else warning
        if warning and remark not in self.warnings:
            self.warnings.append(remark)
            self.session.warn(remark)

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the duration of the block to the total for `part`."""
        began = self.clock.now()
        try:
            yield
        finally:
            self.seconds[part] = self.seconds.get(part, 0.0) + self.clock.now() - began
