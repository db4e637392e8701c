"""What a simulated camera consists of, and what goes wrong with what it says and does."""

from __future__ import annotations

from typing import Final

from app.devices.clock import Clock
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import CommandRefused, JsonValue, Request
from app.devices.simulated.faults import Faults, WireTrouble
from app.devices.simulated.options import OptionStore
from app.devices.simulated.preview import PreviewGate
from app.devices.simulated.scene import Scene
from app.devices.simulated.shooting import CameraDate, Job, Shooter, Storage, StoredFile

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
        """Add files to a list that were not taken."""
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
        return 0.03 if self._faults.spend("battery-low") else level

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
        if not self._faults.spend("storage-full"):
            return camera.storage.free_bytes
        return max(self._room_left(camera), 0) * _BYTES_PER_PICTURE

    def _room_left(self, camera: CameraBody) -> int:
        return self._room - (len(camera.storage.files) - self._older)

    def _full(self, camera: CameraBody) -> bool:
        return self._faults.spend("storage-full", self._room_left(camera) <= 0)

    def _hot(self, camera: CameraBody) -> bool:
        return self._faults.spend("overheating", len(camera.shooter.jobs) >= self._hot_after)

    # Shooting.

    def check_shooting(self, camera: CameraBody) -> None:
        """Refuse to shoot. Raises `CommandRefused`: disabledCommand or powerOffSequenceRunning."""
        if self._faults.spend("battery-low"):
            raise CommandRefused("powerOffSequenceRunning", "The battery is empty.")
        if self._full(camera) or self._hot(camera):
            raise CommandRefused("disabledCommand")

    def preview_lingers(self, camera: CameraBody) -> bool:
        """Say whether the camera takes the preview to be open though it is not."""
        closed = camera.preview.body is None
        return self._faults.spend("disabledcommand-while-preview-is-open", closed)

    def still_settling(self, since: float) -> bool:
        """Say whether options were set too short a time ago, by a longer measure than usual."""
        name = "disabledcommand-too-soon-after-setoptions"
        soon = self._faults.on(name) and since < self._faults.dice(name).uniform(2.0, 4.0)
        return self._faults.spend(name, soon)

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
        if self._faults.spend("storage-full", len(job.frames) > self._room_left(camera)):
            job.frames[self._room_left(camera) :] = []
        self._faults.spend("unequal-lens-iso", any(f.take.program == 1 for f in job.frames))
        chosen = len(camera.shooter.jobs) > self._drop_job and job.frames
        if self._faults.on("drop-during-exposure") and chosen:
            share = self._faults.dice("drop-during-exposure").uniform(0.1, 0.8)
            self._drop_at = job.begun + share * (job.frames[-1].end - job.begun)

    def hides_end(self, camera: CameraBody, job: Job) -> bool:
        """Say whether a command continues for ever as far as its status says."""
        told = job.kind == "bracket" or camera.personality.bracket is None
        return self._faults.spend("never-done", told)


class CameraBody:
    """A camera's parts, its settings and where it is, and what goes wrong with it.

    `host`, `port`: where the last client asked for it: the address in its URLs. Else where it
    believes to be.
    """

    def __init__(
        self,
        scene: Scene,
        person: Personality,
        clock: Clock,
        shape: tuple[int, int] | None,
        faults: Faults,
    ) -> None:
        self.faults = faults
        self.trouble = Trouble(faults)
        self.personality = person
        self.scene = scene
        self.clock = clock
        self.battery = 0.8
        self.started = clock.now()
        self.date = CameraDate(self.started, self.trouble.first_year)
        self.store = OptionStore(person)
        self.storage = Storage(person)
        self.shooter = Shooter(scene, person, clock, self.date, self.storage, shape)
        self.preview = PreviewGate(scene.environment, person, clock, self.store.values)
        self.api_version = 1 if person.switches_api else 2
        self.session = ""
        self.options_set_at = float("-inf")
        self.log: list[Request] = []
        self.epoch = 0
        self.host = person.address

    @property
    def options(self) -> dict[str, JsonValue]:
        """The options as the camera holds them."""
        return self.store.values

    def url(self, file: StoredFile) -> str:
        """URL of a file."""
        return f"http://{self.host}{file.path}"

    @property
    def port(self) -> int:
        """The port of its address."""
        digits = self.host.rpartition("]")[2].rpartition(":")[2]
        return int(digits) if digits.isdecimal() and len(digits) < 6 and ":" in self.host else 80

    def reconnect(self) -> None:
        """Lose the Wi-Fi and take it up again: old connections die, and some models forget."""
        self.shooter.settle()
        self.epoch += 1
        self.session = ""
        self.preview.close()
        if self.personality.switches_api:
            self.api_version = 1
        if not self.personality.keeps_settings:
            self.store.reset()
