"""A simulated camera, a client and a session, wired up on virtual time, for tests."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.measure.options import MeasureOptions
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.devices.capture.capture_steps import Capture, CaptureResult
from app.devices.capture.session import Session
from app.devices.clock import VirtualClock
from app.devices.passwords import Credentials
from app.devices.simulated.cameras import Personality
from app.devices.simulated.scene import Scene
from app.devices.theta.client import OscClient
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import Link
from tests.faulty_camera.camera import FaultyCamera
from tests.faulty_camera.models import personality_named
from tests.helpers.camera_adapter import CameraAdapter

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from pathlib import Path
    from typing import Literal

    from numpy.typing import NDArray

    from app.devices.capture.status import Status
    from app.devices.simulated.exchange import JsonValue
    from app.devices.simulated.shooting import StoredFile

SMALL = (128, 256)


@lru_cache(maxsize=4)
def pack() -> StylePack:
    return load_named_pack("generic")


@lru_cache(maxsize=1)
def lit_room() -> Scene:
    """The room at a plausible brightness; one scene for all cameras keeps its frames."""
    return Scene(300.0 * room())


@lru_cache(maxsize=4)
def room(rows: int = 128) -> NDArray[np.float32]:
    """(rows, 2 rows, 3) a bundled place, mean 1."""
    from app.core.environment.environment import read_environment

    light = read_environment(resources() / "demo" / "scenes" / "studio.exr").radiance
    step = light.shape[0] // rows
    small = light.reshape(rows, step, 2 * rows, step, 3).mean(axis=(1, 3))
    return np.ascontiguousarray(small / small.mean(), np.float32)


@dataclass
class Rig:
    """All of it; `shoot` runs one capture."""

    folder: Path
    model: str | Personality = "V"
    faults: Collection[str] = ()
    seed: int = 0
    shape: tuple[int, int] | None = SMALL
    rate_mbit: float | None = None
    scene: Scene | None = None
    wishes: MeasureOptions | None = None
    user: str = ""
    password: str = ""
    clock: VirtualClock = field(default_factory=VirtualClock)
    token: Token = field(default_factory=Token)
    seen: list[Status] = field(default_factory=list)
    deleted: list[StoredFile] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.camera = FaultyCamera(
            self.scene or lit_room(),
            personality_named(self.model) if isinstance(self.model, str) else self.model,
            self.clock,
            faults=self.faults,
            seed=self.seed,
            user=self.user,
            password=self.password,
            rate_mbit=self.rate_mbit,
            shape=self.shape,
        )
        storage = self.camera.storage
        delete = storage.delete

        def recorded(urls: Sequence[JsonValue]) -> None:
            held = tuple(storage.files)
            delete(urls)
            self.deleted += [file for file in held if file not in storage.files]

        storage.delete = recorded  # type: ignore[method-assign]

    def client(self) -> OscClient:
        keys = Credentials(self.user, self.password) if self.user else None
        adapter = CameraAdapter(self.camera)
        link = Link(Endpoint("192.168.1.1"), self.clock, keys, adapter=adapter)
        return OscClient(link, self.clock)

    def shoot(self, plan: Literal["paper", "full"] = "paper") -> CaptureResult:
        capture = Capture(
            self.client(),
            Session.open_or_create(self.folder),
            self.clock,
            plan=plan,
            pack=pack(),
            wishes=self.wishes,
            on_status=self.seen.append,
            token=self.token,
        )
        return capture.run()
