"""The probe's presenter with a simulated camera on virtual time, for tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from app.core.base.errors import Cancelled
from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.environment.environment import from_radiance
from app.core.places.place import Place
from app.core.solver.place_light import prepare
from app.devices.errors import Unreachable
from app.devices.passwords import Credentials
from app.devices.theta.camera_identity import FoundCamera, described
from app.devices.theta.discovery import Discovery
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import Link
from app.devices.theta.messages import Info
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Folders, Services, Sounds
from app.ui.presenters.undo_stack import UndoStack
from app.ui.presenters.window_model import Model
from app.ui.screens.probe.screen import ProbePresenter
from tests.helpers.camera_adapter import CameraAdapter
from tests.helpers.cameras import Rig
from tests.helpers.probes import place as lit_place
from tests.helpers.told import Told

SERIAL = "00112358"


class BeatRunner:
    """Does everything at once; each report is a beat of the screen's clock."""

    def __init__(self) -> None:
        self.ran: list[str] = []
        self.tokens: dict[str, Token] = {}
        self.beats: list[Callable[[], None]] = []
        self.held: set[str] = set()
        self.waiting: dict[str, Callable[[], None]] = {}

    def release(self, key: str) -> None:
        """Do what was held back."""
        self.held.discard(key)
        self.waiting.pop(key)()

    def submit(
        self,
        key: str,
        work: Callable[..., Any],
        *,
        title: str = "",
        done: Callable[..., None] | None = None,
        failed: Callable[[Exception], None] | None = None,
        cancelled: Callable[[], None] | None = None,
    ) -> None:
        del title
        self.ran.append(key)
        if key in self.held:
            self.waiting[key] = lambda: self.submit(
                key, work, done=done, failed=failed, cancelled=cancelled
            )
            return
        token = self.tokens[key] = Token()

        def report(fraction: float, message: str) -> None:
            del fraction, message
            for beat in tuple(self.beats):
                beat()

        try:
            answer = work(token, report)
        except Cancelled:
            if cancelled is not None:
                cancelled()
            return
        except Exception as error:
            if failed is None:
                raise
            failed(error)
            return
        if done is not None:
            done(answer)

    def cancel(self, key: str) -> None:
        if key in self.tokens:
            self.tokens[key].cancel()

    def running(self, key: str) -> bool:
        del key
        return False


class Keyring:
    """Passwords in memory."""

    def __init__(self) -> None:
        self.kept: dict[str, str] = {}

    def get(self, account: str) -> str | None:
        return self.kept.get(account)

    def set(self, account: str, password: str) -> bool:
        self.kept[account] = password
        return True


class Loudspeaker(Sounds):
    """Counts sounds, and keeps what was said."""

    available = speaks = True

    def __init__(self) -> None:
        self.played = 0
        self.said: list[str] = []

    def say(self, words: str) -> None:
        self.said.append(words)

    def play(self, samples: Any, volume: float = 1.0) -> None:
        assert len(samples)
        assert 0.0 <= volume <= 1.0
        self.played += 1

    def stop(self) -> None:
        pass


@dataclass
class RigDevices:
    """A camera that is a `Rig`'s."""

    rig: Rig
    there: bool = True
    keyring: Keyring = field(default_factory=Keyring)

    def camera(self) -> FoundCamera:
        info = Info("RICOH THETA V", serial_number=SERIAL)
        secret = bool(self.rig.user)
        name = f"THETAYL{SERIAL}._osc._tcp.local."
        return described(Endpoint("192.168.1.1"), "access point", None if secret else info, name)

    def discover(self, token: Token) -> Discovery:
        del token
        return Discovery((self.camera(),) if self.there else ())

    def look_at(self, address: str, token: Token | None = None) -> FoundCamera:
        del token
        if address != "192.168.1.1":
            raise Unreachable(f"Nothing answers at {address}.", "Check the address.")
        return self.camera()

    def link(self, camera: FoundCamera, credentials: Credentials | None) -> Link:
        adapter = CameraAdapter(self.rig.camera)
        return Link(camera.endpoint, self.rig.clock, credentials, adapter=adapter)

    def passwords(self) -> Keyring:
        return self.keyring

    def webcams(self) -> Sequence[tuple[int, str]]:
        return ()

    def webcam(self, index: int) -> Any:
        raise AssertionError(index)


@dataclass
class Bench:
    """Everything that a probe needs, with nobody outside."""

    home: Path
    rig_options: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.rig = Rig(self.home / "rig", **{"shape": (128, 256), **self.rig_options})
        self.devices = RigDevices(self.rig)
        self.runner = BeatRunner()
        self.told = Told()
        self.sounds = Loudspeaker()
        self.model = Model()
        self.now = datetime(2026, 6, 21, 14, 5, tzinfo=UTC)
        self.services = Services(
            model=self.model,
            runner=self.runner,
            notify=self.told,
            undo=UndoStack(),
            clock=self.rig.clock,
            today=lambda: self.now,
            devices=self.devices,  # type: ignore[arg-type]
            folders=Folders(
                self.home,
                self.home / "places",
                self.home / "styles",
                self.home / "drafts",
                resources() / "demo" / "cafe",
            ),
            sounds=self.sounds,
        )
        self.desk = PlaceController(self.services)
        self.desk.begin()
        self.model.update(settings=self.model.settings.with_("plan", "paper"))
        self.presenter = ProbePresenter(self.services, self.desk)
        self.runner.beats.append(self.presenter.tick)

    def later(self, minutes: float) -> None:
        """Let time of day pass."""
        self.now += timedelta(minutes=minutes)

    def places(self) -> list[Path]:
        """Folders of places."""
        root = self.home / "places"
        return sorted(each for each in root.iterdir()) if root.is_dir() else []


def vanish_after(bench: Bench, frames: int) -> None:
    """Make the camera go away when so many frames are here."""

    def look() -> None:
        seen = bench.presenter.taking._progress
        if seen is not None and sum(frame.done for frame in seen.status.frames) >= frames:
            bench.rig.camera.reachable = lambda: False  # type: ignore[method-assign]

    bench.runner.beats.append(look)


def with_lamp(bench: Bench, azimuth: float, elevation: float = 20.0) -> None:
    """Open a place with one lamp, without any file."""
    radiance = lit_place([(azimuth, elevation, 12.0, 40.0)])
    bench.model.update(
        place=Place("Known", bench.now, measured_at=bench.now),
        place_folder=None,
        light=prepare(from_radiance(radiance, "Known")),
    )
