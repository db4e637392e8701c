"""The cameras and webcams of this computer and its network, real ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.devices.discovery import check_address, discover, look_at
from app.devices.passwords import Passwords
from app.devices.theta.link import Credentials, Link
from app.devices.webcam import OpenCvWebcam, list_webcams

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.progress import Token
    from app.devices.clock import Clock
    from app.devices.discovery import Discovery
    from app.devices.found import FoundCamera
    from app.devices.webcam import Webcam


class DevicesAtHand:
    """What is really there."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def discover(self, token: Token) -> Discovery:
        """Look for 360 cameras for some seconds; see `app.devices.discovery.discover`."""
        return discover(self._clock, token=token)

    def look_at(self, address: str) -> FoundCamera:
        """Ask one address that was typed; see `app.devices.discovery.look_at`."""
        return look_at(check_address(address), self._clock)

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
