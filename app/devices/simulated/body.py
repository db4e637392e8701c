"""Parts of a simulated camera: its settings, storage, shooter, permissions and reports.

The camera behaves correctly. Where real cameras are known to misbehave, `CameraBody` and
`camera.SimulatedCamera` have methods that a subclass may override:

* Replies: `answer`, `refuse`, `route`, `find_command`, `file_data`.
* Permissions: `check_settable`, `check_ready`, `check_preview_closed`, `check_settled`.
* Reports: `status`, `errors`, `free_bytes`, `stated_url`, `listing`, `has_ended`.
* Shooting: `shoot`. The `PreviewGate` in `preview` may also be replaced.
* Options: `make_store`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.devices.clock import Clock
from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import CommandRefused, JsonValue, Request
from app.devices.simulated.options import OptionStore
from app.devices.simulated.preview import PreviewGate
from app.devices.simulated.scene import Scene
from app.devices.simulated.shooting import (
    CameraDate,
    JobKind,
    Shooter,
    ShootingJob,
    Storage,
    StoredFile,
)

_SETTLE_S: Final = 1.0
_WARM_C: Final = 38


class CameraBody:
    """A camera's parts, settings and address.

    Args:
        date: Date and time of the camera's clock, or None for noon on a summer day.
        host: Address and port used in the camera's URLs, taken from the last request.
        battery: Battery charge, 0 to 1.
        temperature_c: Temperature of the camera's board in degrees Celsius.
    """

    def __init__(
        self,
        scene: Scene,
        person: Personality,
        clock: Clock,
        shape: tuple[int, int] | None,
        date: CameraDate | None = None,
    ) -> None:
        self.personality = person
        self.scene = scene
        self.clock = clock
        self.battery = 0.8
        self.temperature_c = _WARM_C
        self.start_s = clock.now()
        self.date = date or CameraDate(self.start_s)
        self.store = self.make_store(person)
        self.storage = Storage(person)
        self.shooter = Shooter(scene, person, clock, self.date, self.storage, shape)
        self.preview = PreviewGate(scene.environment, person, clock, self.store.values)
        self.options_set_at = float("-inf")
        self.log: list[Request] = []
        self.host = person.address

    def make_store(self, person: Personality) -> OptionStore:
        """Create the option store for a model."""
        return OptionStore(person)

    @property
    def options(self) -> dict[str, JsonValue]:
        """The current values of the options."""
        return self.store.values

    @property
    def port(self) -> int:
        """The port in the camera's address."""
        digits = self.host.rpartition("]")[2].rpartition(":")[2]
        return int(digits) if digits.isdecimal() and len(digits) < 6 and ":" in self.host else 80

    def url(self, file: StoredFile) -> str:
        """Return the URL of a file."""
        return f"http://{self.host}{file.path}"

    # Permissions.

    def check_settable(self) -> None:
        """Raise `CommandRefused` (disabledCommand) if options cannot be changed now."""
        if self.shooter.busy:
            raise CommandRefused("disabledCommand")

    def check_ready(self) -> None:
        """Raise `CommandRefused` (disabledCommand) if the camera cannot shoot now."""
        if self.shooter.busy:
            raise CommandRefused("disabledCommand", "Shooting is under way.")
        self.check_preview_closed()
        self.check_settled()

    def check_preview_closed(self) -> None:
        """Raise `CommandRefused` (disabledCommand) while the preview is open."""
        if self.preview.body is not None:
            raise CommandRefused("disabledCommand", "The live preview is open.")

    def check_settled(self) -> None:
        """Raise `CommandRefused` (disabledCommand) for one second after options are changed."""
        if self.clock.now() - self.options_set_at < _SETTLE_S:
            raise CommandRefused("disabledCommand", "Options were set a moment ago.")

    # Reports.

    def errors(self) -> tuple[str, ...]:
        """Return the value of `_cameraError`."""
        return ("COMPASS_CALIBRATION",) if self.personality.name == "Z1" else ()

    def free_bytes(self) -> int:
        """Return the number of free bytes in storage."""
        return self.storage.free_bytes

    def stated_url(self, file: StoredFile) -> str:
        """Return the URL of a file as stated in a reply."""
        return self.url(file)

    def listing(
        self, files: Sequence[StoredFile], *, detail: bool, thumb_size: int
    ) -> list[JsonValue]:
        """Return the entries for files in the reply to camera.listFiles."""
        return [
            self.storage.entry(file, self.stated_url(file), detail=detail, thumb_size=thumb_size)
            for file in files
        ]

    def has_ended(self, job: ShootingJob) -> bool:
        """Return whether a job's command reports that it is done."""
        return job.done and not job.watched

    # Shooting.

    def shoot(self, name: str, kind: JobKind, shots: Sequence[dict[str, JsonValue]]) -> ShootingJob:
        """Start shooting.

        Args:
            name: Name of the command.
            kind: Kind of job.
            shots: Settings for each frame (see `Shooter.begin`).
        """
        job = self.shooter.begin(name, kind, shots, self.options)
        rules = self.personality.bracket
        job.watched = kind == "bracket" and rules is not None and rules.watched
        return job
