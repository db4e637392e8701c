"""What can go wrong with a simulated camera, by name, how often it does, and in single answers.

Everything is drawn from the seed: the same names, seed and requests give the same troubles.
Troubles that a patient client can outlast go away after a few times; the others stay.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from random import Random
from types import MappingProxyType
from typing import Final

from app.core.text import tr
from app.devices.simulated.exchange import (
    LATENCY_S,
    Drop,
    Pause,
    Piece,
    Reply,
    Request,
    json_reply,
    refusal,
    text_reply,
)
from app.devices.simulated.shooting import StoredFile

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
        "drop-during-download": tr("The connection is cut in the middle of a file, a few times."),
        "drop-during-exposure": (
            tr("The camera cannot be reached for some seconds while it shoots; it keeps shooting.")
        ),
        "truncated-jpeg": tr(
            "A file arrives shorter than listed, with a length that fits, at first."
        ),
        "503-bursts": tr("Several requests in a row are answered with 503, now and then."),
        "disabledcommand-while-preview-is-open": (
            tr("The camera takes the preview to be open for a while after it was closed.")
        ),
        "disabledcommand-too-soon-after-setoptions": (
            tr("Shooting is refused for longer than the usual second after options were set.")
        ),
        "401": tr("The camera wants a password although none was set."),
        "storage-full": tr("There is no room, or not for all frames."),
        "battery-low": tr("The battery is nearly empty; the camera refuses to shoot."),
        "overheating": tr("The camera is too hot to shoot, from the start or after a while."),
        "sleep": tr(
            "The camera sleeps, at first and again when idle, unless sleepDelay forbids it."
        ),
        "error-in-a-200": tr("Errors come with HTTP status 200, some of them for no reason."),
        "equal-exposures": tr("All frames of a bracket get the exposure of the first."),
        "unequal-lens-iso": tr("The two lenses use different ISO even in the manual program."),
        "slow-status": tr("Asking how a command does takes many seconds, once too many."),
        "never-done": tr("The command that takes the bracket never reports that it is done."),
        "404-router-in-place-of-the-camera": tr("A home router answers, with web pages."),
        "hostile-file-names": tr("Files are listed whose names lead out of any folder."),
        "hostile-urls": tr("URLs of files point to other hosts, to local files, or are huge."),
        "endless-response": tr("An answer never ends."),
        "wrong-content-length": tr("Content-Length is larger or smaller than what is sent."),
        "clock-unset": tr("The camera's date was never set."),
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
    """Find faults by what a user writes: any case, and one word for two of a kind.

    `names`: keys of `FAULTS`, "hostile-file-names-and-urls" or "disabledcommand". Raises
    `ValueError` for a name that is not known.

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
    """The troubles of one camera. Raises `ValueError` for a name that is not known."""

    def __init__(self, names: Collection[str], seed: int) -> None:
        names = faults_named(names)
        self._dice = {name: Random(f"{seed}/{name}") for name in names}  # noqa: S311
        self._fired: dict[str, int] = {}
        self._left = {
            name: dice.randint(*_TIMES[name]) if name in _TIMES else -1
            for name, dice in self._dice.items()
        }

    def on(self, name: str) -> bool:
        """Whether a fault was asked for and is not over."""
        return self._left.get(name, 0) != 0

    def asked(self, name: str) -> bool:
        """Whether a fault was asked for, over or not."""
        return name in self._dice

    def dice(self, name: str) -> Random:
        """Source of a fault's chances; only for those that were asked for."""
        return self._dice[name]

    def fire(self, name: str) -> None:
        """Note that a fault has shown, and count it down where it goes away."""
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
        """How often a fault has shown."""
        return self._fired.get(name, 0)


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
        """Spoil an answer of the camera."""
        if request.target == _EXECUTE and reply.status >= 400:
            polite = self._faults.asked("error-in-a-200")
            return replace(reply, status=200) if polite else reply
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
        if self._faults.on(name) and self._waits[name] > 0:
            self._waits[name] -= 1
            return False
        return self._faults.spend(name)

    def _roll(self, name: str, low: int, high: int) -> int:
        return self._faults.dice(name).randint(low, high) if self._faults.asked(name) else low


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
