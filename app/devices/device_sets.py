"""The devices that the window is given: real ones, or simulated ones to try the program with.

The camera of the demo runs in a process of its own and is spoken to over the network of this
computer, as a real one would be; the webcam stands at the sitter of the demo location.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from app.core.base.progress import Token
from app.core.text import tr
from app.devices.clock import Clock
from app.devices.errors import Unreachable
from app.devices.passwords import Credentials, Passwords
from app.devices.theta.camera_identity import FoundCamera
from app.devices.theta.discovery import Discovery, discover, look_at
from app.devices.theta.endpoint import check_address
from app.devices.theta.link import Link
from app.devices.webcam import OpenCvWebcam, SimulatedWebcam, Webcam, list_webcams
from app.devices.webcam.simulated import DEMO_SIZE

_TICK_S: Final = 0.05
_START_S: Final = 20.0


class RealDevices:
    """The cameras and webcams of this computer and its network."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def discover(self, token: Token) -> Discovery:
        """Look for 360 cameras for some seconds; see `app.devices.theta.discovery.discover`."""
        return discover(self._clock, token=token)

    def look_at(self, address: str, token: Token | None = None) -> FoundCamera:
        """Ask one address that was typed; see `app.devices.theta.discovery.look_at`."""
        return look_at(check_address(address), self._clock, token=token)

    def link(self, camera: FoundCamera, credentials: Credentials | None) -> Link:
        """Make a link; nothing is sent yet."""
        return Link(camera.endpoint, self._clock, credentials)

    def passwords(self) -> Passwords:
        """Give the system's keyring."""
        return Passwords()

    def webcams(self) -> Sequence[tuple[int, str]]:
        """Index and name of every webcam. Takes a while: opens each of them."""
        return list_webcams()

    def webcam(self, index: int) -> Webcam:
        """Make a webcam that is not yet opened."""
        return OpenCvWebcam(index, self._clock)

    def close(self) -> None:
        """Nothing is held."""


class CameraProcess:
    """A simulated camera in a process of its own."""

    def __init__(self, scene: Path, model: str = "V") -> None:
        # Not "-m app": a folder of the user's may be called that.
        own = [sys.executable, "-P", "-m", "turnlight"]
        command = [*own, "simulate-camera", "--scene", str(scene)]
        # Its errors would fill the user's terminal; whether it runs is seen by its address.
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            [*command, "--model", model, "--until-eof"],
            # It ends when this is closed: also when this program is killed.
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            encoding="utf-8",
            env={**os.environ, "PYTHONUTF8": "1"},
        )
        self._url = ""
        self._read = threading.Event()
        threading.Thread(target=self._listen, name="demo camera", daemon=True).start()

    def _listen(self) -> None:
        stream = self._process.stdout
        if stream is not None:
            with contextlib.suppress(OSError, ValueError):
                self._url = stream.readline().strip()
        self._read.set()

    def url(self, clock: Clock, token: Token) -> str:
        """Wait for the camera's address. Raises `Unreachable` when it does not start."""
        end = clock.now() + _START_S
        while not self._read.is_set() and clock.now() < end:
            token.check()
            clock.sleep(_TICK_S)
        if not self._url:
            raise Unreachable(
                tr("The demo camera did not start."),
                tr("Start the demo again, or open a panorama."),
            )
        return self._url

    @property
    def running(self) -> bool:
        """Whether the process lives."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the process; a second time does nothing."""
        if self.running:
            self._process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=5.0)
        if self.running:
            self._process.kill()
            self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()


class DemoDevices(RealDevices):
    """Simulated devices in the demo café; a typed address is still a real one."""

    def __init__(self, clock: Clock, cafe: Path) -> None:
        super().__init__(clock)
        self.camera = CameraProcess(cafe / "probe.exr")
        self.simulated = SimulatedWebcam(cafe, clock, size=DEMO_SIZE)

    def discover(self, token: Token) -> Discovery:
        """Find the demo camera, as soon as it has started."""
        return Discovery((self.look_at(self.camera.url(self._clock, token), token),))

    def webcams(self) -> Sequence[tuple[int, str]]:
        """Name the one that stands at the demo location."""
        return ((0, self.simulated.name),)

    def webcam(self, index: int) -> Webcam:
        """Give the one that stands at the demo location, whatever is asked for."""
        del index
        return self.simulated

    def close(self) -> None:
        """End the camera's process and the webcam."""
        self.simulated.close()
        self.camera.close()
