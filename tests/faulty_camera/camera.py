"""A simulated camera that fails, sleeps, lies, and loses its Wi-Fi.

It overrides methods that `app.devices.simulated.body` lists. Without faults it answers as the good
camera, but for the bad habits of some models (`habits`) and their older Web API (`old_api`).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Final

from app.devices.clock import Clock
from app.devices.simulated.body import CameraBody
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import (
    CommandRefused,
    JsonValue,
    Reply,
    Request,
    text_reply,
)
from app.devices.simulated.scene import Scene
from app.devices.simulated.shooting import (
    CameraDate,
    JobKind,
    PlannedFrame,
    ShootingJob,
    StoredFile,
)
from tests.faulty_camera.digest import Guard
from tests.faulty_camera.faults import Faults, WireFaults
from tests.faulty_camera.habits import OddCamera
from tests.faulty_camera.models import personality_named, user_name
from tests.faulty_camera.silence import NO_ANSWER

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
_EMPTY: Final = 0.03
_HOT_C: Final = 71
_NEVER: Final = float("inf")


class UnsetDate(CameraDate):
    """The date of a camera whose date was never set."""

    def __init__(self, now: float, year: int) -> None:
        super().__init__(now, datetime(year, 1, 1), "+00:00")
        self.unset = True

    def set(self, text: str, now: float) -> None:
        super().set(text, now)
        self.unset = False


def store_older(camera: CameraBody, count: int) -> None:
    """Put pictures onto a camera's storage as if they had been taken before."""
    shooter, options = camera.shooter, camera.options
    for index in range(count):
        at = camera.clock.now() - 60.0 * (count - index)
        take = shooter.plan({**options, "exposureProgram": 2}, options, at)
        shooter.write(PlannedFrame(at, at, replace(take, shape=(64, 128))), None)


class FaultyCamera(OddCamera):
    """A camera with faults, and with a Wi-Fi that can be lost.

    Args:
        faults: Keys of `tests.faulty_camera.faults.FAULTS`.
        seed: Of the faults and of the nonces.
        user: User name for the password; "THETA" and the serial number unless given.
        password: With a password the camera is in somebody's network and demands digest
            authentication.

    Raises `ValueError` for a fault or a model that does not exist, or a password where the model
    can have none.
    """

    def __init__(
        self,
        scene: Scene,
        personality: Personality | str,
        clock: Clock,
        *,
        faults: Collection[str] = (),
        seed: int = 0,
        user: str = "",
        password: str = "",
        rate_mbit: float | None = None,
        shape: tuple[int, int] | None = None,
        older_files: int = 0,
    ) -> None:
        person = personality_named(personality) if isinstance(personality, str) else personality
        if password and not person.digest:
            raise ValueError(f"a {person.model} cannot ask for a password")
        self.faults = Faults(faults, seed)
        self.epoch = 0
        self._wire = WireFaults(self.faults)
        self._guard: Guard | None = None
        if password:
            self._guard = Guard(user or user_name(person), password, person.model, seed)
        self._silent_until = -_NEVER
        self._silent = False
        self._heard: float | None = None
        self._drop_at = _NEVER
        self._drop_job = self.faults.roll("drop-during-exposure", 0, 1)
        self._room = self.faults.roll("storage-full", 0, 3)
        self._hot_after = self.faults.roll("overheating", 0, 1)
        self._stuck: dict[str, JsonValue] | None = None
        super().__init__(
            scene,
            person,
            clock,
            rate_mbit=rate_mbit,
            shape=shape,
            date=self._first_date(clock.now()),
        )
        store_older(self, older_files)
        self._older = len(self.storage.files)
        if self.faults.spend("battery-low"):
            self.battery = _EMPTY
        if self.faults.on("overheating"):
            self.temperature_c = _HOT_C
        if self.faults.on("unequal-lens-iso"):
            gains = ((1.25, 0.8), (0.8, 1.6), (1.0, 0.5))
            self.shooter.manual_gains = self.faults.dice("unequal-lens-iso").choice(gains)

    def _first_date(self, now: float) -> CameraDate | None:
        if not self.faults.spend("clock-unset"):
            return None
        return UnsetDate(now, self.faults.dice("clock-unset").choice((1970, 2000)))

    # The link.

    def reachable(self) -> bool:
        """Whether a connection would be taken now; asking wakes a sleeping camera, in time."""
        with self._lock:
            return self._hears()

    def _hears(self) -> bool:
        now = self.clock.now()
        if now < self._silent_until:
            return False
        if self._silent:
            self._silent = False
            self.reconnect()
        elif self._drops(now) or self._falls_asleep(now):
            self._silent = True
            return False
        self._heard = now
        return True

    def reconnect(self) -> None:
        """Lose the Wi-Fi and join it again: old connections die, and some models forget.

        `epoch` counts the connections that died.
        """
        with self._lock:
            self.shooter.settle()
            self.epoch += 1
            self.preview.close()
            self.wake()
            if self.habits.forgets:
                self.store.reset()

    def _drops(self, now: float) -> bool:
        if now < self._drop_at or not self.faults.spend("drop-during-exposure"):
            return False
        self._drop_at = _NEVER
        self._silent_until = now + self.faults.dice("drop-during-exposure").uniform(3.0, 20.0)
        return True

    def _falls_asleep(self, now: float) -> bool:
        if not self.faults.on("sleep"):
            return False
        dice = self.faults.dice("sleep")
        if self._heard is None:
            sleeps = dice.random() < 0.6
            self._heard = now
        else:
            idle = now - self._heard > dice.uniform(2.5, 6.0)
            sleeps = idle and self.options["sleepDelay"] != 65535
            self.shooter.settle()
            sleeps = sleeps and not self.shooter.busy
        if sleeps:
            self.faults.fire("sleep")
            self._silent_until = now + dice.uniform(5.0, 25.0)
        return sleeps

    # On the wire.

    def answer(self, request: Request) -> Reply:
        with self._lock:
            if self._hears():
                return super().answer(request)
            self.note(request)
            return NO_ANSWER

    def refuse(self, request: Request) -> Reply | None:
        early = self._wire.before(self.personality.model, request)
        return early or super().refuse(request) or self._challenge(request)

    def _challenge(self, request: Request) -> Reply | None:
        if self._guard is None:
            return None
        now = self.clock.now()
        verdict = self._guard.check(request, now)
        if verdict == "ok":
            return None
        reply = text_reply(b"", "text/plain", 401)
        challenge = self._guard.challenge(now, stale=verdict == "stale")
        return replace(reply, headers=(*reply.headers, ("WWW-Authenticate", challenge)))

    def route(self, request: Request) -> Reply:
        return self._wire.after(request, super().route(request))

    def file_data(self, file: StoredFile) -> bytes:
        return self._wire.file_data(super().file_data(file))

    # What is permitted.

    def check_settable(self) -> None:
        # In API 2.0 there is nothing that a preview could be in the way of.
        lingers = self.api_version > 1 and self._preview_lingers()
        super().check_settable()
        if lingers:
            raise CommandRefused("disabledCommand")

    def check_ready(self) -> None:
        if self.faults.spend("battery-low"):
            raise CommandRefused("powerOffSequenceRunning", "The battery is empty.")
        if self._full() or self._hot():
            raise CommandRefused("disabledCommand")
        super().check_ready()

    def check_preview_closed(self) -> None:
        super().check_preview_closed()
        if self._preview_lingers():
            raise CommandRefused("disabledCommand", "The live preview is open.")

    def check_settled(self) -> None:
        super().check_settled()
        name = "disabledcommand-too-soon-after-setoptions"
        since = self.clock.now() - self.options_set_at
        soon = self.faults.on(name) and since < self.faults.dice(name).uniform(2.0, 4.0)
        if self.faults.spend(name, soon):
            raise CommandRefused("disabledCommand", "Options were set a moment ago.")

    def _preview_lingers(self) -> bool:
        closed = self.preview.body is None
        return self.faults.spend("disabledcommand-while-preview-is-open", closed)

    # What is reported.

    def errors(self) -> tuple[str, ...]:
        words = [*super().errors()]
        if isinstance(self.date, UnsetDate) and self.date.unset:
            words.append("NO_DATE_SETTING")
        if self._full():
            words.append("NO_MEMORY")
        if self._hot():
            words.append("HIGH_TEMPERATURE")
        return tuple(words)

    def free_bytes(self) -> int:
        if not self.faults.spend("storage-full"):
            return super().free_bytes()
        return max(self._room_left(), 0) * _BYTES_PER_PICTURE

    def stated_url(self, file: StoredFile) -> str:
        return self._wire.stated_url(super().stated_url(file))

    def listing(
        self, files: Sequence[StoredFile], *, detail: bool, thumb_size: int
    ) -> list[JsonValue]:
        entries = super().listing(files, detail=detail, thumb_size=thumb_size)
        if self.faults.spend("hostile-file-names"):
            self._add_hostile(entries)
        return entries

    def _add_hostile(self, entries: list[JsonValue]) -> None:
        """Add files to a list that were not taken."""
        dice = self.faults.dice("hostile-file-names")
        for name in dice.sample(HOSTILE_NAMES, dice.randint(1, 3)):
            model = dice.choice(entries) if entries else {}
            assert isinstance(model, dict)
            entry: dict[str, JsonValue] = {
                "size": 1_000_000,
                "dateTimeZone": self.date.text(self.clock.now()),
                "width": 5376,
                "height": 2688,
                "isProcessed": True,
                "previewUrl": "",
            }
            entry |= model
            entry["name"] = name
            entry["fileUrl"] = f"http://{self.personality.address}/files/{name}"
            entries.insert(dice.randint(0, len(entries)), entry)

    def has_ended(self, job: ShootingJob) -> bool:
        polled = job.kind == "bracket" or self.personality.bracket is None
        return super().has_ended(job) and not self.faults.spend("never-done", polled)

    def _room_left(self) -> int:
        return self._room - (len(self.storage.files) - self._older)

    def _full(self) -> bool:
        return self.faults.spend("storage-full", self._room_left() <= 0)

    def _hot(self) -> bool:
        return self.faults.spend("overheating", len(self.shooter.jobs) >= self._hot_after)

    # Taking pictures.

    def shoot(self, name: str, kind: JobKind, shots: Sequence[dict[str, JsonValue]]) -> ShootingJob:
        job = super().shoot(name, kind, self._exposures(shots))
        if self.faults.spend("storage-full", len(job.frames) > self._room_left()):
            job.frames[self._room_left() :] = []
        self.faults.spend("unequal-lens-iso", any(f.take.program == 1 for f in job.frames))
        chosen = len(self.shooter.jobs) > self._drop_job and job.frames
        if self.faults.on("drop-during-exposure") and chosen:
            share = self.faults.dice("drop-during-exposure").uniform(0.1, 0.8)
            self._drop_at = job.start_s + share * (job.frames[-1].end - job.start_s)
        return job

    def _exposures(self, shots: Sequence[dict[str, JsonValue]]) -> Sequence[dict[str, JsonValue]]:
        """Repeat the first exposure of a bracket, or of single pictures in a row."""
        name = "equal-exposures"
        if not self.faults.on(name) or not shots or shots[0].get("exposureProgram") != 1:
            return shots
        if len(shots) > 1:
            self.faults.fire(name)
            return [shots[0]] * len(shots)
        first = self._stuck or shots[0]
        self._stuck = first
        stuck = {key: first[key] for key in _SETTINGS_OF_EXPOSURE if key in first}
        if self.personality.bracket is None and shots[0] | stuck != shots[0]:
            self.faults.fire(name)
            return [shots[0] | stuck]
        return shots
