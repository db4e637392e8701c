"""The devices that the window uses: real ones, or the simulated ones in the demo.

The demo camera runs in a separate process and is reached over this computer's network like a real
one. The demo webcam shows the sitter at the demo location.
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
    """The cameras and webcams on this computer and its network."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def discover(self, token: Token) -> Discovery:
        """Search for 360 cameras for a few seconds (see `app.devices.theta.discovery.discover`)."""
        return discover(self._clock, token=token)

    def look_at(self, address: str, token: Token | None = None) -> FoundCamera:
        """Identify the camera at a typed address (see `app.devices.theta.discovery.look_at`)."""
        return look_at(check_address(address), self._clock, token=token)

    def link(self, camera: FoundCamera, credentials: Credentials | None) -> Link:
        """Return a link that has not sent anything yet."""
        return Link(camera.endpoint, self._clock, credentials)

    def passwords(self) -> Passwords:
        """Return the passwords stored in the system keyring."""
        return Passwords()

    def webcams(self) -> Sequence[tuple[int, str]]:
        """Return the index and name of every webcam. This is slow, since each webcam is opened."""
        return list_webcams()

    def webcam(self, index: int) -> Webcam:
        """Return a webcam that is not yet open."""
        return OpenCvWebcam(index, self._clock)

    def close(self) -> None:
        """Do nothing."""


class CameraProcess:
    """A simulated camera in a separate process."""

    def __init__(self, scene: Path, model: str = "V") -> None:
        # Not "-m app", because the user may have a folder of that name.
        own = [sys.executable, "-P", "-m", "turnlight"]
        command = [*own, "simulate-camera", "--scene", str(scene)]
        # The camera's errors would clutter the terminal; its address shows whether it is running.
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            [*command, "--model", model, "--until-eof"],
            # The process ends when this pipe closes, even if this program is killed.
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
        """Wait for the camera's address and return it.

        Raises:
            Unreachable: If the camera does not start.
        """
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
        """Whether the process is running."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the process. Calling this again has no effect."""
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
    """Simulated devices in the demo café. Addresses typed by the user still reach real cameras."""

    def __init__(self, clock: Clock, cafe: Path) -> None:
        super().__init__(clock)
        self.camera = CameraProcess(cafe / "probe.exr")
        self.simulated = SimulatedWebcam(cafe, clock, size=DEMO_SIZE)

    def discover(self, token: Token) -> Discovery:
        """Return the demo camera as soon as it has started."""
        return Discovery((self.look_at(self.camera.url(self._clock, token), token),))

    def webcams(self) -> Sequence[tuple[int, str]]:
        """Return the demo webcam."""
        return ((0, self.simulated.name),)

    def webcam(self, index: int) -> Webcam:
        """Return the demo webcam for any index."""
        del index
        return self.simulated

    def close(self) -> None:
        """End the camera's process and close the webcam."""
        self.simulated.close()
        self.camera.close()
