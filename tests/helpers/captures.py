"""Captures that something happens to."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.core.base.remarks import PlainRemark
from app.core.measure.bracket.incoming_frames import ArrivingFrames
from app.devices.capture.capture_steps import Capture
from app.devices.capture.session import Session
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import Reply, Request
from tests.helpers.cameras import Rig, pack

TINY = (64, 128)


def without_merging(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the merge, which takes most of the time."""
    light = SimpleNamespace(radiance=np.ones((32, 64, 3), np.float32), cd_m2=None)
    probe = SimpleNamespace(merged=light, warnings=(PlainRemark("It was merged."),))
    monkeypatch.setattr(ArrivingFrames, "measure", lambda *args, **how: probe)


def without_waiting_for_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out flushing: these tests do not cut the power."""
    monkeypatch.setattr("os.fsync", lambda handle: None)


def capture(made: Rig, **how: Any) -> Capture:
    return Capture(
        made.client(),
        Session.open_or_create(made.folder),
        made.clock,
        plan="paper",
        pack=pack(),
        on_status=made.seen.append,
        token=made.token,
        **how,
    )


def rig(folder: Path, model: str | Personality = "V", **how: Any) -> Rig:
    return Rig(folder / "session", model, shape=how.pop("shape", TINY), **how)


class Weather:
    """Counts the requests to a camera, and breaks the link or acts at one of them."""

    def __init__(self, made: Rig) -> None:
        self.made = made
        self.requests = 0
        self.lost_until = -math.inf
        self.at: dict[int, Callable[[], None]] = {}
        self.dead = self.heard = False
        self._answer = made.camera.answer
        self._reachable = made.camera.reachable
        made.camera.answer = self.answer  # type: ignore[method-assign]
        made.camera.reachable = self.reachable  # type: ignore[method-assign]

    def reachable(self) -> bool:
        return self.made.clock.now() >= self.lost_until and self._reachable()

    def lose(self, seconds: float) -> None:
        self.lost_until = self.made.clock.now() + seconds
        self.made.camera.reconnect()

    def answer(self, request: Request) -> Reply:
        if self.dead:
            raise Killed
        if self.made.clock.now() < self.lost_until:
            return Reply(0)
        self.requests += 1
        act = self.at.get(self.requests)
        if act is not None:
            if self.heard:
                self._answer(request)
            act()
        if self.made.clock.now() < self.lost_until:
            return Reply(0)
        return self._answer(request)


class Killed(BaseException):
    """The program ends here."""


def when(made: Rig, words: str, act: Callable[[], None]) -> None:
    """Do something the first time a request has these words in it."""
    answer = made.camera.answer
    done: list[bool] = []

    def wrapped(request: Request) -> Reply:
        if not done and words in request.target + request.body.decode():
            done.append(True)
            reply = answer(request)
            act()
            return reply
        return answer(request)

    made.camera.answer = wrapped  # type: ignore[method-assign]


def asked(made: Rig, words: str) -> int:
    return sum(words in request.body.decode() for request in made.camera.log)
