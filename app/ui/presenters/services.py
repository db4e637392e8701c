"""What presenters are given to work with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

from app.ui.presenters.sounds import Silence

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from datetime import datetime
    from pathlib import Path

    from app.core.base.progress import Token
    from app.devices.clock import Clock
    from app.devices.discovery import Discovery
    from app.devices.found import FoundCamera
    from app.devices.passwords import Passwords
    from app.devices.theta.link import Credentials, Link
    from app.devices.webcam import Webcam
    from app.ui.presenters.job_runner import Runner
    from app.ui.presenters.model import Model
    from app.ui.presenters.sounds import Sounds
    from app.ui.presenters.undo import UndoStack

Kind: TypeAlias = Literal["info", "done", "warning", "error"]
Action: TypeAlias = "tuple[str, Callable[[], None]]"


class Notifier(Protocol):
    """Tells the user something that needs no answer."""

    def tell(
        self,
        message: str,
        *,
        kind: Kind = "info",
        actions: Sequence[Action] = (),
        about: str = "",
        stay: bool = False,
    ) -> None:
        """Show one sentence for a while and keep it in the list of messages.

        Errors stay until they are closed, acted upon or mended.

        Parameters
        ----------
        actions : sequence of (str, callable), optional
            At most two buttons.
        """

    def tell_error(
        self, error: Exception, *, actions: Sequence[Action] = (), about: str = ""
    ) -> None:
        """Show an error in its own words; one that has none of ours is logged as well.

        Parameters
        ----------
        actions : sequence of (str, callable), optional
            At most two buttons.
        """

    def mended(self, about: str) -> None:
        """Take off the screen what speaks of this: it is over."""


class Devices(Protocol):
    """Cameras and webcams, real or simulated."""

    def discover(self, token: Token) -> Discovery:
        """Look for 360 cameras for some seconds."""

    def look_at(self, address: str) -> FoundCamera:
        """Ask one address that was typed.

        Raises
        ------
        CoreError, DeviceError
            When it is no address, or there is no camera.
        """

    def link(self, camera: FoundCamera, credentials: Credentials | None) -> Link:
        """Connect to a camera."""

    def passwords(self) -> Passwords:
        """Where passwords are kept."""

    def webcams(self) -> Sequence[tuple[int, str]]:
        """Index and name of every webcam. Takes a while: not for the thread of the screens."""

    def webcam(self, index: int) -> Webcam:
        """Make a webcam that is not yet opened."""


@dataclass(frozen=True, slots=True)
class Folders:
    """Where the user's things are."""

    home: Path
    places: Path
    styles: Path
    drafts: Path
    demo: Path


@dataclass(frozen=True, slots=True)
class Services:
    """All that a presenter may use."""

    model: Model
    runner: Runner
    notify: Notifier
    undo: UndoStack
    clock: Clock
    today: Callable[[], datetime]
    devices: Devices
    folders: Folders
    sounds: Sounds = field(default_factory=Silence)
