"""A bad line to a simulated camera: one request in ten goes wrong, in one way, by a seed."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.devices.simulated.exchange import NO_ANSWER, Drop, Pause, Reply, Request, text_reply

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.exchange import Piece

KINDS: Final = (
    "lost-request",
    "lost-reply",
    "reset",
    "truncation",
    "503",
    "html",
    "redirect",
    "401",
)
_PAGE: Final = b"<!DOCTYPE html><html><title>Login</title><body>Sign in.</body></html>"
_CHALLENGES: Final = (
    'Digest realm="router", nonce="5ca1ab1e", qop="auth"',
    'Basic realm="router"',
)


class BadLine:
    """Takes the place of a camera's `answer`; serves under the adapter and under real sockets.

    Args:
        camera: Whose answers pass through here from now on.
        kind: One of `KINDS`.
        share: Of the requests that go wrong.
    """

    def __init__(
        self, camera: SimulatedCamera, kind: str, *, seed: int = 0, share: float = 0.1
    ) -> None:
        self.struck = self.requests = 0
        self._kind, self._share = kind, share
        self._dice = random.Random(f"{kind}/{seed}")
        self._answer: Callable[[Request], Reply] = camera.answer
        camera.answer = self.answer  # type: ignore[method-assign]

    def answer(self, request: Request) -> Reply:
        """Answer as the camera does, or fail on the way there or back."""
        self.requests += 1
        if self._dice.random() >= self._share:
            return self._answer(request)
        self.struck += 1
        if self._kind in ("lost-request", "503", "html", "redirect", "401"):
            return self._instead()
        if self._kind == "reset" and self._dice.random() < 0.5:
            return Reply(0)
        reply = self._answer(request)
        if self._kind == "truncation":
            return self._cut(reply)
        close = getattr(reply.pieces, "close", None)
        if close is not None:
            close()
        return NO_ANSWER if self._kind == "lost-reply" else Reply(0, delay_s=reply.delay_s)

    def _instead(self) -> Reply:
        if self._kind == "503":
            return text_reply(_PAGE, "text/html", 503)
        if self._kind == "html":
            return text_reply(_PAGE, "text/html")
        if self._kind == "redirect":
            return _with(text_reply(b"", "text/html", 302), "Location", "http://10.0.0.1/login")
        if self._kind == "401":
            challenge = self._dice.choice(_CHALLENGES)
            return _with(text_reply(_PAGE, "text/html", 401), "WWW-Authenticate", challenge)
        return NO_ANSWER

    def _cut(self, reply: Reply) -> Reply:
        """Cut a body, with a connection that breaks or a length that fits."""
        length = next(int(v) for n, v in reply.headers if n.lower() == "content-length")
        most = int(length * self._dice.uniform(0.0, 0.98))
        if self._dice.random() < 0.5:
            return replace(reply, pieces=_until(reply.pieces, most, breaks=True))
        headers = tuple(h for h in reply.headers if h[0].lower() != "content-length")
        headers += (("Content-Length", str(most)),)
        return replace(reply, headers=headers, pieces=_until(reply.pieces, most, breaks=False))


def _with(reply: Reply, name: str, value: str) -> Reply:
    return replace(reply, headers=(*reply.headers, (name, value)))


def _until(pieces: object, most: int, *, breaks: bool) -> Iterator[Piece]:
    left = most
    for piece in pieces:  # type: ignore[attr-defined]
        if isinstance(piece, Pause | Drop):
            yield piece
        elif left > 0:
            yield piece[:left]
            left -= len(piece)
    if breaks:
        yield Drop()
