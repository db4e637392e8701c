"""Faults of a simulated camera that show in single answers: refused, cut, endless, too long."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.devices.simulated.exchange import Drop, Pause, Reply
from app.devices.simulated.replies import (
    LATENCY_S,
    JsonValue,
    json_reply,
    refusal,
    text_reply,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.exchange import Piece, Request
    from app.devices.simulated.faults import Faults
    from app.devices.simulated.storage import StoredFile

_ROUTER_PAGE: Final = (
    b"<!DOCTYPE html><html><head><title>404 Not Found</title></head>"
    b"<body><h1>404 Not Found</h1><p>Your router's pages are elsewhere.</p></body></html>"
)
_EXECUTE: Final = "/osc/commands/execute"
_STATUS: Final = "/osc/commands/status"
_SOME_CODES: Final = ("serviceUnavailable", "unexpected", "disabledCommand")
_ENDLESS: Final = b" " * 4096


class WireTrouble:
    """What goes wrong between the camera's words and the wire."""

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._waits: dict[str, int] = {
            "503-bursts": self._roll("503-bursts", 1, 6),
            "error-in-a-200": self._roll("error-in-a-200", 0, 5),
            "endless-response": self._roll("endless-response", 0, 12),
            "drop-during-download": self._roll("drop-during-download", 0, 2),
            "truncated-jpeg": self._roll("truncated-jpeg", 0, 2),
            "wrong-content-length": self._roll("wrong-content-length", 0, 2),
        }
        self._burst = 0
        self._worst_poll = self._roll("slow-status", 0, 3)

    def before(self, camera: SimulatedCamera, request: Request) -> Reply | None:
        """Answer in the camera's place."""
        if self._faults.spend("404-router-in-place-of-the-camera"):
            return text_reply(_ROUTER_PAGE, "text/html", 404)
        if self._faults.spend("401"):
            return _wants_password(camera)
        if self._bursts():
            return refusal("", "serviceUnavailable")
        if request.target.startswith("/osc/") and self._strikes("endless-response"):
            kind = (("Content-Type", "application/json;charset=utf-8"),)
            return Reply(200, kind, _without_end(), LATENCY_S)
        if request.target == _EXECUTE and self._strikes("error-in-a-200"):
            code = self._faults.dice("error-in-a-200").choice(_SOME_CODES)
            return refusal("", code, status=200)
        return None

    def after(self, request: Request, reply: Reply) -> Reply:
        """Spoil an answer of the camera."""
        if request.target == _EXECUTE and reply.status >= 400:
            return self._politely(reply)
        if request.target == _STATUS and self._faults.on("slow-status"):
            return self._slowly(reply)
        whole = request.target.startswith("/files/") and "?" not in request.target
        if whole and reply.status in {200, 206}:
            return self._spoiled(reply)
        return reply

    def bytes_of(self, file: StoredFile) -> bytes:
        """Give a file's bytes as they will be sent, with a length that fits them."""
        if not self._strikes("truncated-jpeg"):
            return file.data
        share = self._faults.dice("truncated-jpeg").uniform(0.1, 0.97)
        return file.data[: int(share * file.size)]

    def poisoned_url(self, url: str) -> str:
        """Give a URL as it will be told."""
        if not self._faults.on("hostile-urls"):
            return url
        dice = self._faults.dice("hostile-urls")
        if dice.random() < 0.3:
            return url
        self._faults.fire("hostile-urls")
        path = "/" + url.partition("://")[2].partition("/")[2]
        return dice.choice(
            (
                f"http://evil.example{path}",
                f"http://169.254.169.254{path}",
                f"http://192.168.1.1@evil.example{path}",
                f"http://192.168.1.1/files/../..{path}",
                f"http://192.168.1.1/%2e%2e/%2e%2e{path}",
                f"http://192.168.1.1\\..\\{path}",
                f"http://192.168.1.1{path}\r\nX-Evil: 1",
                f"http://192.168.1.1{path}" + "A" * 100_000,
                f"file://{path}",
                "file:///private/notes",
                f"ftp://192.168.1.1{path}",
                "javascript:alert(1)",
                "",
            )
        )

    def _bursts(self) -> bool:
        if self._burst > 0:
            self._burst -= 1
            return True
        if not self._strikes("503-bursts"):
            return False
        dice = self._faults.dice("503-bursts")
        self._burst = dice.randint(1, 3)
        self._waits["503-bursts"] = dice.randint(3, 12)
        return True

    def _politely(self, reply: Reply) -> Reply:
        """Say 200 where the answer is an error."""
        if not self._faults.asked("error-in-a-200"):
            return reply
        return replace(reply, status=200)

    def _slowly(self, reply: Reply) -> Reply:
        dice = self._faults.dice("slow-status")
        worst = self._faults.fired("slow-status") == self._worst_poll
        self._faults.fire("slow-status")
        return replace(reply, delay_s=dice.uniform(25.0, 40.0) if worst else dice.uniform(3.0, 9.0))

    def _spoiled(self, reply: Reply) -> Reply:
        length = int(dict(reply.headers)["Content-Length"])
        if self._strikes("wrong-content-length"):
            dice = self._faults.dice("wrong-content-length")
            wrong = dice.choice(
                (length + dice.randint(1, 50_000), int(length * dice.uniform(0.0, 0.99)))
            )
            headers = dict(reply.headers) | {"Content-Length": str(wrong)}
            return replace(reply, headers=tuple(headers.items()))
        if self._strikes("drop-during-download"):
            share = self._faults.dice("drop-during-download").uniform(0.0, 0.98)
            return replace(reply, pieces=_cut(reply.pieces, int(share * length)))
        return reply

    def _strikes(self, name: str) -> bool:
        """Fire a fault once it has let so many chances pass."""
        if not self._faults.on(name):
            return False
        if self._waits[name] > 0:
            self._waits[name] -= 1
            return False
        self._faults.fire(name)
        return True

    def _roll(self, name: str, low: int, high: int) -> int:
        return self._faults.dice(name).randint(low, high) if self._faults.asked(name) else low


def _wants_password(camera: SimulatedCamera) -> Reply:
    body: dict[str, JsonValue] = {"message": "Unauthorized"}
    reply = json_reply(body, 401)
    nonce = f"{len(camera.log):032x}"
    words = f'Digest realm="{camera.personality.model}", nonce="{nonce}", qop="auth"'
    return replace(reply, headers=(*reply.headers, ("WWW-Authenticate", words)))


def _cut(pieces: Iterable[Piece], at: int) -> Iterator[Piece]:
    """Play a body up to a byte, then hang up."""
    left = at
    for piece in pieces:
        if not isinstance(piece, bytes):
            yield piece
        elif len(piece) < left:
            left -= len(piece)
            yield piece
        else:
            yield piece[:left]
            yield Drop()
            return


def _without_end() -> Iterator[Piece]:
    yield b'{"state": "'
    while True:
        yield _ENDLESS
        yield Pause(0.002)
