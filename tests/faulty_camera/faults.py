"""The faults of a camera by name, how often they strike, and what they do to single answers.

Everything is drawn from the seed: the same names, seed and requests give the same faults. Faults
that a patient client can outlast go away after a few times; the others stay.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from random import Random
from types import MappingProxyType
from typing import Final

from app.devices.simulated.exchange import (
    LATENCY_S,
    Pause,
    Piece,
    Reply,
    Request,
    json_reply,
    refusal,
    text_reply,
)
from tests.faulty_camera.silence import Drop

_ROUTER_PAGE: Final = (
    b"<!DOCTYPE html><html><head><title>404 Not Found</title></head>"
    b"<body><h1>404 Not Found</h1><p>Your router's pages are elsewhere.</p></body></html>"
)
_EXECUTE: Final = "/osc/commands/execute"
_STATUS: Final = "/osc/commands/status"
_SOME_CODES: Final = ("serviceUnavailable", "unexpected", "disabledCommand")
_ENDLESS: Final = b" " * 4096

FAULTS: Final = MappingProxyType(
    {
        "drop-during-download": "The connection is cut in the middle of a file, a few times.",
        "drop-during-exposure": (
            "The camera cannot be reached for some seconds while it shoots; it keeps shooting."
        ),
        "truncated-jpeg": "A file arrives shorter than listed, with a length that fits, at first.",
        "503-bursts": "Several requests in a row are answered with 503, now and then.",
        "disabledcommand-while-preview-is-open": (
            "The camera takes the preview to be open for a while after it was closed."
        ),
        "disabledcommand-too-soon-after-setoptions": (
            "Shooting is refused for longer than the usual second after options were set."
        ),
        "401": "The camera wants a password although none was set.",
        "storage-full": "There is no room, or not for all frames.",
        "battery-low": "The battery is nearly empty; the camera refuses to shoot.",
        "overheating": "The camera is too hot to shoot, from the start or after a while.",
        "sleep": "The camera sleeps, at first and again when idle, unless sleepDelay forbids it.",
        "error-in-a-200": "Errors come with HTTP status 200, some of them for no reason.",
        "equal-exposures": "All frames of a bracket get the exposure of the first.",
        "unequal-lens-iso": "The two lenses use different ISO even in the manual program.",
        "slow-status": "Asking how a command does takes many seconds, once too many.",
        "never-done": "The command that takes the bracket never reports that it is done.",
        "404-router-in-place-of-the-camera": "A home router answers, with web pages.",
        "hostile-file-names": "Files are listed whose names lead out of any folder.",
        "hostile-urls": "URLs of files point to other hosts, to local files, or are huge.",
        "endless-response": "An answer never ends.",
        "wrong-content-length": "Content-Length is larger or smaller than what is sent.",
        "clock-unset": "The camera's date was never set.",
    }
)
"""Name and a sentence of each."""

_BOTH: Final = MappingProxyType(
    {
        "hostile-file-names-and-urls": ("hostile-file-names", "hostile-urls"),
        "disabledcommand": (
            "disabledcommand-while-preview-is-open",
            "disabledcommand-too-soon-after-setoptions",
        ),
    }
)


_TIMES: Final = {
    "drop-during-download": (1, 3),
    "drop-during-exposure": (1, 1),
    "truncated-jpeg": (1, 2),
    "503-bursts": (2, 3),
    "disabledcommand-while-preview-is-open": (1, 3),
    "disabledcommand-too-soon-after-setoptions": (1, 3),
    "sleep": (1, 2),
    "error-in-a-200": (2, 4),
    "equal-exposures": (1, 2),
    "slow-status": (4, 8),
    "hostile-file-names": (2, 6),
    "hostile-urls": (2, 8),
    "endless-response": (1, 2),
    "wrong-content-length": (1, 3),
    "clock-unset": (1, 1),
}


def faults_named(names: Iterable[str]) -> tuple[str, ...]:
    """Find faults by name: any case, and one word for two of a kind.

    `names`: keys of `FAULTS`, "hostile-file-names-and-urls" or "disabledcommand". Raises
    `ValueError` for an unknown name.

    Examples:
        >>> faults_named(["Truncated-JPEG", "hostile-file-names-and-urls"])
        ('truncated-jpeg', 'hostile-file-names', 'hostile-urls')
    """
    found: dict[str, None] = {}
    for name in names:
        plain = name.strip().casefold()
        for each in _BOTH.get(plain, (plain,)):
            if each not in FAULTS:
                raise ValueError(f"there is no fault {name!r}; known: {', '.join(FAULTS)}")
            found[each] = None
    return tuple(found)


class Faults:
    """The faults of one camera. Raises `ValueError` for an unknown name."""

    def __init__(self, names: Collection[str], seed: int) -> None:
        names = faults_named(names)
        self._dice = {name: Random(f"{seed}/{name}") for name in names}
        self._fired: dict[str, int] = {}
        self._left = {
            name: dice.randint(*_TIMES[name]) if name in _TIMES else -1
            for name, dice in self._dice.items()
        }

    def on(self, name: str) -> bool:
        """Whether a fault is among the names and not over."""
        return self._left.get(name, 0) != 0

    def has(self, name: str) -> bool:
        """Whether a fault is among the names, over or not."""
        return name in self._dice

    def dice(self, name: str) -> Random:
        """Source of a fault's chances; only for those among the names."""
        return self._dice[name]

    def roll(self, name: str, low: int, high: int) -> int:
        """Draw a number for a fault among the names; the lowest for any other."""
        return self.dice(name).randint(low, high) if self.has(name) else low

    def fire(self, name: str) -> None:
        """Count a fault, and count it down where it goes away."""
        self._fired[name] = self._fired.get(name, 0) + 1
        if self._left[name] > 0:
            self._left[name] -= 1

    def spend(self, name: str, happens: bool = True) -> bool:
        """Fire a fault if it is on, and something happens that it needs."""
        fires = happens and self.on(name)
        if fires:
            self.fire(name)
        return fires

    def fired(self, name: str) -> int:
        """How often a fault has struck."""
        return self._fired.get(name, 0)


class WireFaults:
    """The faults between the camera's answers and the wire."""

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._waits: dict[str, int] = {
            "503-bursts": faults.roll("503-bursts", 1, 6),
            "error-in-a-200": faults.roll("error-in-a-200", 0, 5),
            "endless-response": faults.roll("endless-response", 0, 12),
            "drop-during-download": faults.roll("drop-during-download", 0, 2),
            "truncated-jpeg": faults.roll("truncated-jpeg", 0, 2),
            "wrong-content-length": faults.roll("wrong-content-length", 0, 2),
        }
        self._burst = 0
        self._worst_poll = faults.roll("slow-status", 0, 3)

    def before(self, model: str, request: Request) -> Reply | None:
        """Answer in the camera's place."""
        if self._faults.spend("404-router-in-place-of-the-camera"):
            return text_reply(_ROUTER_PAGE, "text/html", 404)
        if self._faults.spend("401"):
            return _wants_password(model, self._faults.fired("401"))
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
        """Spoil an answer of the camera's."""
        if request.target == _EXECUTE and reply.status >= 400:
            polite = self._faults.has("error-in-a-200")
            return replace(reply, status=200) if polite else reply
        if request.target == _STATUS and self._faults.on("slow-status"):
            return self._slowly(reply)
        whole = request.target.startswith("/files/") and "?" not in request.target
        if whole and reply.status in {200, 206}:
            return self._spoiled(reply)
        return reply

    def file_data(self, data: bytes) -> bytes:
        """Shorten a file; its stated length will fit."""
        if not self._strikes("truncated-jpeg"):
            return data
        share = self._faults.dice("truncated-jpeg").uniform(0.1, 0.97)
        return data[: int(share * len(data))]

    def stated_url(self, url: str) -> str:
        """Replace the URL of a file."""
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
        """Fire a fault after it has let its number of chances pass."""
        if self._faults.on(name) and self._waits[name] > 0:
            self._waits[name] -= 1
            return False
        return self._faults.spend(name)


def _wants_password(model: str, number: int) -> Reply:
    reply = json_reply({"message": "Unauthorized"}, 401)
    words = f'Digest realm="{model}", nonce="{number:032x}", qop="auth"'
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
