"""What the steps of a capture share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.core.base.progress import Token
from app.core.hdr.planner import Plan
from app.core.text import tr
from app.devices.capture.status import Board
from app.devices.errors import CaptureFailed
from app.devices.profiles import ModelProfile

if TYPE_CHECKING:
    from app.core.hdr.arriving import ArrivingFrames
    from app.core.hdr.finish import MergeOptions
    from app.core.hdr.pipeline import Probe
    from app.core.solver.style_pack import StylePack
    from app.devices.capture.recovery import Contact
    from app.devices.capture.session import Debts, Session
    from app.devices.clock import Clock
    from app.devices.theta.client import OscClient
    from app.devices.theta.messages import Info


@dataclass(slots=True)
class Job:
    """One capture on its way: what was asked for, and what has come of it so far.

    * `client`, `session`, `clock`, `token`, `board`, `contact`: the camera, where its files go,
      time, the wish to stop, the status, and the camera again with patience.
    * `debts`: what earlier captures owe to cameras; None where it is not kept.
    * `profile`, `info`: of the camera; `info` is None where it was not needed any more.
    """

    client: OscClient
    session: Session
    clock: Clock
    token: Token
    board: Board
    contact: Contact
    kind: Literal["paper", "full"]
    pack: StylePack
    wishes: MergeOptions
    delay_s: int
    arriving: ArrivingFrames
    profile: ModelProfile
    debts: Debts | None = None
    info: Info | None = None
    exposing: bool = False
    paths: tuple[Path, ...] = ()
    probe: Probe | None = None
    environment: Path | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def plan(self) -> Plan:
        """The bracket that is shot.

        Raises `CaptureFailed` before there is one.
        """
        plan = self.session.journal.plan
        if plan is None:
            raise CaptureFailed(tr("No bracket has been planned."), tr("Start again."), "no-plan")
        return plan

    def warn(self, sentence: str) -> None:
        """Keep a sentence for the user, once."""
        if sentence and sentence not in self.warnings:
            self.warnings.append(sentence)
            self.session.warn(sentence)

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the time that passes to a part."""
        began = self.clock.now()
        try:
            yield
        finally:
            self.seconds[part] = self.seconds.get(part, 0.0) + self.clock.now() - began
