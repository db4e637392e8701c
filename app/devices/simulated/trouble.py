"""Where the faults of a simulated camera show: in what it says and does, and in single answers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.devices.simulated.body import CameraBody
from app.devices.simulated.exchange import (
    LATENCY_S,
    CommandRefused,
    Drop,
    JsonValue,
    Pause,
    Reply,
    json_reply,
    refusal,
    text_reply,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from app.devices.clock import Clock
    from app.devices.simulated.exchange import Piece, Request
    from app.devices.simulated.faults import Faults
    from app.devices.simulated.personality import Personality
    from app.devices.simulated.scene import Scene
    from app.devices.simulated.shooting import Job, StoredFile

_ROUTER_PAGE: Final = (
    b"<!DOCTYPE html><html><head><title>404 Not Found</title></head>"
    b"<body><h1>404 Not Found</h1><p>Your router's pages are elsewhere.</p></body></html>"
)
_EXECUTE: Final = "/osc/commands/execute"
_STATUS: Final = "/osc/commands/status"
_SOME_CODES: Final = ("serviceUnavailable", "unexpected", "disabledCommand")
_ENDLESS: Final = b" " * 4096

HOSTILE_NAMES: Final = (
    "../../../../tmp/turnlight-was-here.JPG",
    "..",
    ".",
    "",
    "/etc/turnlight-was-here",
    "C:\\Windows\\R0010001.JPG",
    "..\\..\\R0010001.JPG",
    ".bashrc",
    "R0010001.JPG\u0000.sh",
    "R0010001.JPG\n",
    "R001\u202e0001GPJ.exe",
    "CON.JPG",
    "-rf",
    "R" + "0" * 5000 + ".JPG",
    "R001/0001.JPG",
    "session.json",
)
"""Names that no client may use as they are."""

_SETTINGS_OF_EXPOSURE: Final = ("iso", "shutterSpeed", "aperture", "exposureCompensation")
_BYTES_PER_PICTURE: Final = 5_000_000
_WARM: Final = 38
_HOT: Final = 71


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

    def before(self, camera: CameraBody, request: Request) -> Reply | None:
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


def _wants_password(camera: CameraBody) -> Reply:
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


class Trouble(WireTrouble):
    """All that goes wrong with one camera."""

    def __init__(self, faults: Faults) -> None:
        super().__init__(faults)
        self._silent_until = float("-inf")
        self._silent = False
        self._heard: float | None = None
        self._drop_at = float("inf")
        self._drop_job = self._roll("drop-during-exposure", 0, 1)
        self._room = self._roll("storage-full", 0, 3)
        self._hot_after = self._roll("overheating", 0, 1)
        self._older = 0
        self._stuck: dict[str, JsonValue] | None = None

    @property
    def first_year(self) -> int | None:
        """Year that a camera without a date believes in."""
        if not self._faults.spend("clock-unset"):
            return None
        return self._faults.dice("clock-unset").choice((1970, 2000))

    def prepare(self, camera: CameraBody) -> None:
        """Take note of the camera as it is before anybody has asked it anything."""
        self._older = len(camera.storage.files)
        if self._faults.on("unequal-lens-iso"):
            gains = ((1.25, 0.8), (0.8, 1.6), (1.0, 0.5))
            camera.shooter.manual_gains = self._faults.dice("unequal-lens-iso").choice(gains)

    # Being there.

    def reachable(self, camera: CameraBody) -> bool:
        """Say whether anything gets through to the camera now."""
        now = camera.clock.now()
        if now < self._silent_until:
            return False
        if self._silent:
            self._silent = False
            camera.reconnect()
        elif self._drops(now) or self._falls_asleep(camera, now):
            self._silent = True
            return False
        self._heard = now
        return True

    def _drops(self, now: float) -> bool:
        if now < self._drop_at or not self._faults.spend("drop-during-exposure"):
            return False
        self._drop_at = float("inf")
        self._silent_until = now + self._faults.dice("drop-during-exposure").uniform(3.0, 20.0)
        return True

    def _falls_asleep(self, camera: CameraBody, now: float) -> bool:
        if not self._faults.on("sleep"):
            return False
        dice = self._faults.dice("sleep")
        if self._heard is None:
            sleeps = dice.random() < 0.6
            self._heard = now
        else:
            idle = now - self._heard > dice.uniform(2.5, 6.0)
            sleeps = idle and camera.options["sleepDelay"] != 65535
            camera.shooter.settle()
            sleeps = sleeps and not camera.shooter.busy
        if sleeps:
            self._faults.fire("sleep")
            self._silent_until = now + dice.uniform(5.0, 25.0)
        return sleeps

    def slip_in(self, camera: CameraBody, entries: list[JsonValue]) -> None:
        """Add files that nobody took to a list."""
        if not self._faults.spend("hostile-file-names"):
            return
        dice = self._faults.dice("hostile-file-names")
        for name in dice.sample(HOSTILE_NAMES, dice.randint(1, 3)):
            known = dice.choice(entries) if entries else {}
            assert isinstance(known, dict)
            entry: dict[str, JsonValue] = {
                "size": 1_000_000,
                "dateTimeZone": camera.date.text(camera.clock.now()),
                "width": 5376,
                "height": 2688,
                "isProcessed": True,
                "previewUrl": "",
            }
            entry |= known
            entry["name"] = name
            entry["fileUrl"] = f"http://{camera.personality.address}/files/{name}"
            entries.insert(dice.randint(0, len(entries)), entry)

    # What the camera says of itself.

    def battery(self, level: float) -> float:
        """Charge, 0 to 1."""
        if not self._faults.spend("battery-low"):
            return level
        return 0.03

    def temperature(self) -> int:
        """Of the board, in degrees Celsius."""
        return _HOT if self._faults.on("overheating") else _WARM

    def errors(self, camera: CameraBody) -> tuple[str, ...]:
        """`_cameraError`."""
        words = ["COMPASS_CALIBRATION"] if camera.personality.name == "Z1" else []
        if camera.date.unset:
            words.append("NO_DATE_SETTING")
        if self._full(camera):
            words.append("NO_MEMORY")
        if self._hot(camera):
            words.append("HIGH_TEMPERATURE")
        return tuple(words)

    def free_bytes(self, camera: CameraBody) -> int:
        """Count what is left of the storage."""
        if not self._faults.on("storage-full"):
            return camera.storage.free_bytes
        self._faults.fire("storage-full")
        return max(self._room_left(camera), 0) * _BYTES_PER_PICTURE

    def _room_left(self, camera: CameraBody) -> int:
        return self._room - (len(camera.storage.files) - self._older)

    def _full(self, camera: CameraBody) -> bool:
        full = self._faults.on("storage-full") and self._room_left(camera) <= 0
        if full:
            self._faults.fire("storage-full")
        return full

    def _hot(self, camera: CameraBody) -> bool:
        hot = self._faults.on("overheating") and len(camera.shooter.jobs) >= self._hot_after
        if hot:
            self._faults.fire("overheating")
        return hot

    # Shooting.

    def check_shooting(self, camera: CameraBody) -> None:
        """Refuse to shoot.

        Raises `CommandRefused`: disabledCommand or powerOffSequenceRunning.
        """
        if self._faults.spend("battery-low"):
            raise CommandRefused("powerOffSequenceRunning", "The battery is empty.")
        if self._full(camera) or self._hot(camera):
            raise CommandRefused("disabledCommand")

    def preview_lingers(self, camera: CameraBody) -> bool:
        """Say whether the camera takes the preview to be open though it is not."""
        if camera.preview.body is not None:
            return False
        return self._faults.spend("disabledcommand-while-preview-is-open")

    def still_settling(self, since: float) -> bool:
        """Say whether options were set too short a time ago, by a longer measure than usual."""
        name = "disabledcommand-too-soon-after-setoptions"
        if not self._faults.on(name) or since >= self._faults.dice(name).uniform(2.0, 4.0):
            return False
        self._faults.fire(name)
        return True

    def exposures(
        self, camera: CameraBody, shots: list[dict[str, JsonValue]]
    ) -> list[dict[str, JsonValue]]:
        """Give the exposures as the camera will take them."""
        name = "equal-exposures"
        if not self._faults.on(name) or not shots or shots[0].get("exposureProgram") != 1:
            return shots
        if len(shots) > 1:
            self._faults.fire(name)
            return [shots[0]] * len(shots)
        first = self._stuck or shots[0]
        self._stuck = first
        stuck = {key: first[key] for key in _SETTINGS_OF_EXPOSURE if key in first}
        if camera.personality.bracket is None and shots[0] | stuck != shots[0]:
            self._faults.fire(name)
            return [shots[0] | stuck]
        return shots

    def begun(self, camera: CameraBody, job: Job) -> None:
        """Take note of a job, and cut it short where there is no room."""
        if self._faults.on("storage-full") and len(job.frames) > self._room_left(camera):
            self._faults.fire("storage-full")
            job.frames[self._room_left(camera) :] = []
        if self._faults.on("unequal-lens-iso") and any(f.take.program == 1 for f in job.frames):
            self._faults.fire("unequal-lens-iso")
        chosen = len(camera.shooter.jobs) > self._drop_job and job.frames
        if self._faults.on("drop-during-exposure") and chosen:
            share = self._faults.dice("drop-during-exposure").uniform(0.1, 0.8)
            self._drop_at = job.begun + share * (job.frames[-1].end - job.begun)

    def hides_end(self, camera: CameraBody, job: Job) -> bool:
        """Say whether a command goes on for ever as far as its status says."""
        if not self._faults.on("never-done"):
            return False
        if job.kind != "bracket" and camera.personality.bracket is not None:
            return False
        self._faults.fire("never-done")
        return True


class TroubledCamera(CameraBody):
    """A camera and what goes wrong with it."""

    def __init__(
        self,
        scene: Scene,
        person: Personality,
        clock: Clock,
        shape: tuple[int, int] | None,
        faults: Faults,
    ) -> None:
        self.trouble = Trouble(faults)
        super().__init__(scene, person, clock, shape, self.trouble.first_year)
