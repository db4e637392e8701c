"""What a simulated camera consists of, whatever goes wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.devices.simulated.options import OptionStore
from app.devices.simulated.preview import PreviewGate
from app.devices.simulated.shooting import CameraDate, Shooter, Storage

if TYPE_CHECKING:
    from app.devices.clock import Clock
    from app.devices.simulated.exchange import JsonValue, Request
    from app.devices.simulated.personality import Personality
    from app.devices.simulated.scene import Scene
    from app.devices.simulated.shooting import StoredFile


class CameraBody:
    """A camera's parts, its settings and where it is.

    * `first_year`: the year that a camera without a date believes in; None for one with a date.
    * `host`, `port`: where the last client asked for it: the address in its URLs. Else where it
      believes to be.
    """

    def __init__(
        self,
        scene: Scene,
        person: Personality,
        clock: Clock,
        shape: tuple[int, int] | None,
        first_year: int | None,
    ) -> None:
        self.personality = person
        self.scene = scene
        self.clock = clock
        self.battery = 0.8
        self.started = clock.now()
        self.date = CameraDate(self.started, first_year)
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
