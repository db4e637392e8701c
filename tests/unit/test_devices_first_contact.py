"""How long an address is asked that has not answered as a camera yet."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.capture.reconnection import Contact
from app.devices.clock import SystemClock, VirtualClock
from app.devices.errors import BadReply, DeviceError, NotACamera, Unreachable
from app.devices.simulated.exchange import Reply, Request
from app.devices.theta.client import OscClient
from app.devices.theta.discovery import discover, look_at
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import Link
from app.devices.theta.network_errors import BROKEN, NOBODY
from tests.faulty_camera.bad_line import BadLine
from tests.helpers.cameras import Rig
from tests.helpers.captures import TINY, without_merging, without_waiting_for_the_disk

CUT = BadReply("cut")
BREAK = Unreachable("broken", code=BROKEN)
INFO = {"model": "RICOH THETA SC2", "serialNumber": "1", "firmwareVersion": "1.82"}


class Wire:
    """Answers /osc/info: what it is given first, then as a camera."""

    def __init__(self, *answers: object) -> None:
        self.answers, self.requests = list(answers), 0

    def get(self, path: str) -> Any:
        self.requests += 1
        answer = self.answers.pop(0) if self.answers else INFO
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        pass


def look(wire: Wire, token: Token | None = None) -> tuple[str, float]:
    """Model, and the seconds that it took to learn it."""
    clock = VirtualClock()
    camera = look_at(
        Endpoint("192.168.1.1"), clock, token=token, link_factory=lambda _: cast("Any", wire)
    )
    return camera.model, clock.now()


@pytest.mark.parametrize("losses", [[CUT] * 5, [BREAK] * 6, [CUT, BREAK, CUT, BREAK, CUT]])
def test_garbled_replies_do_not_end_the_first_contact(losses: list[DeviceError]) -> None:
    model, seconds = look(Wire(*losses))
    assert model == "RICOH THETA SC2"
    assert 2.5 < seconds < 25.0


@pytest.mark.parametrize("error", [CUT, BREAK, NotACamera("page"), Unreachable("", code=NOBODY)])
def test_the_first_contact_ends(error: DeviceError) -> None:
    wire = Wire(*[error] * 1000)
    with pytest.raises(type(error)):
        look(wire)
    assert wire.requests <= 12


def test_a_refused_connection_is_reported_at_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    clock = VirtualClock()
    contact = Contact(
        OscClient(Link(Endpoint("127.0.0.1", port), SystemClock()), clock),
        clock,
        None,
        lambda words, left, *, seeking=False: None,
    )
    with pytest.raises(Unreachable, match="Nothing answers") as caught:
        contact.meet()
    assert caught.value.code == NOBODY
    assert clock.now() < 3.0
    with pytest.raises(Unreachable, match="Nothing answers"):
        look_at(Endpoint("127.0.0.1", port), clock)
    assert clock.now() < 6.0


def test_the_first_contact_can_be_cancelled() -> None:
    token = Token()
    wire = Wire(*[CUT] * 1000)
    answer = wire.get

    def cancel_at_the_third(path: str) -> Any:
        if wire.requests == 2:
            token.cancel()
        return answer(path)

    wire.get = cancel_at_the_third  # type: ignore[method-assign]
    with pytest.raises(Cancelled):
        look(wire, token)
    assert wire.requests == 3


def test_a_search_asks_again_after_a_garbled_reply() -> None:
    def browse(found: Callable[..., None], stop: Any) -> None:
        stop.wait(2.0)

    wire = Wire(CUT, BREAK)
    found = discover(SystemClock(), 3.0, link_factory=lambda _: cast("Any", wire), browse=browse)
    assert [camera.model for camera in found.cameras] == ["RICOH THETA SC2"]


@pytest.mark.parametrize("model", ["V", "SC2", "insta360"])
def test_a_capture_begins_although_its_first_replies_are_cut(
    tmp_path: Path, model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_waiting_for_the_disk(monkeypatch)
    without_merging(monkeypatch)
    rig = Rig(tmp_path / "session", model, shape=TINY)
    answer = rig.camera.answer
    line = BadLine(rig.camera, "truncation", share=1.0)
    cut = rig.camera.answer

    def first_five(request: Request) -> Reply:
        return cut(request) if line.requests < 5 else answer(request)

    rig.camera.answer = first_five  # type: ignore[method-assign]
    assert len(rig.shoot().frames) == 3
