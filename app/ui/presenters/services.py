"""The services that presenters use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, Literal, Protocol, TypeAlias, TypeVar, Unpack

from numpy.typing import NDArray

from app.core.base.progress import Handlers, PhraseReport, Token
from app.core.text import tr
from app.ui.presenters.backgrounds import Backgrounds

if TYPE_CHECKING:
    import numpy as np

    from app.devices.clock import Clock
    from app.devices.passwords import Credentials, Passwords
    from app.devices.theta.camera_identity import FoundCamera
    from app.devices.theta.discovery import Discovery
    from app.devices.theta.link import Link
    from app.devices.webcam import Webcam
    from app.ui.presenters.undo_stack import UndoStack
    from app.ui.presenters.window_model import Model


NO_LOUDSPEAKER: Final = tr("No sound output")


class Sounds:
    """Plays short sounds without ever blocking or failing. This base class is silent."""

    @property
    def available(self) -> bool:
        """Whether this computer can play sounds."""
        return False

    @property
    def speaks(self) -> bool:
        """Whether the system can speak text."""
        return False

    def play(self, samples: NDArray[np.int16], volume: float = 1.0) -> None:
        """Play a sound from the beginning, cutting off any sound that is still playing.

        Args:
            samples: (n,) int16, mono, at the sample rate `app.core.guidance.beeps.RATE`.
            volume: Volume from 0 to 1.
        """

    def stop(self) -> None:
        """Stop the sound that is playing."""

    def say(self, words: str) -> None:
        """Speak text with the system's voice."""


def sound_words(enabled: bool, sounds: Sounds) -> tuple[str, str]:
    """Return the label and the icon that show whether sound is on."""
    if not enabled:
        return tr("Sound off"), "sound-off"
    if not sounds.available:
        return NO_LOUDSPEAKER, "sound-off"
    return tr("Sound on: beeps quicken as you get closer"), "sound"


T = TypeVar("T")


class Runner(Protocol):
    """Runs long tasks on a worker thread and delivers the results to the UI thread."""

    def submit(
        self, key: str, work: Callable[[Token, PhraseReport], T], **how: Unpack[Handlers[T]]
    ) -> None:
        """Start `work`. Any older job with the same key is cancelled, and its result is dropped."""

    def cancel(self, key: str) -> None:
        """Cancel the job with this key, if there is one."""

    def running(self, key: str) -> bool:
        """Return whether a job with this key is still running."""


Kind: TypeAlias = Literal["info", "done", "warning", "error"]
Action: TypeAlias = "tuple[str, Callable[[], None]]"


class Notifier(Protocol):
    """Shows messages that do not need a reply."""

    def tell(
        self,
        message: str,
        *,
        kind: Kind = "info",
        actions: Sequence[Action] = (),
        about: str = "",
        stay: bool = False,
    ) -> None:
        """Show a message for a while, and keep it in the list of messages.

        An error stays until it is closed, acted on or resolved.
        """

    def tell_error(
        self, error: Exception, *, actions: Sequence[Action] = (), about: str = ""
    ) -> None:
        """Show an error with its own message, and also log the error if it is unexpected."""

    def mended(self, about: str) -> None:
        """Remove the messages about a problem that has been resolved."""


class Devices(Protocol):
    """The cameras and webcams, whether real or simulated."""

    def discover(self, token: Token) -> Discovery:
        """Look for 360 cameras for a few seconds."""

    def look_at(self, address: str, token: Token | None = None) -> FoundCamera:
        """Look for a camera at an address that the user has entered.

        Raises:
            CoreError: If the address is invalid.
            DeviceError: If there is no camera at the address.
        """

    def link(self, camera: FoundCamera, credentials: Credentials | None) -> Link:
        """Connect to a camera."""

    def passwords(self) -> Passwords:
        """Return the password store."""

    def webcams(self) -> Sequence[tuple[int, str]]:
        """Return the index and name of every webcam. This is too slow for the main thread."""

    def webcam(self, index: int) -> Webcam:
        """Return the webcam with this index, without opening it."""


@dataclass(frozen=True, slots=True)
class Folders:
    """The folders that contain the user's data."""

    home: Path
    places: Path
    styles: Path
    drafts: Path
    demo: Path


@dataclass(frozen=True, slots=True)
class Services:
    """All the services that a presenter may use."""

    model: Model
    runner: Runner
    notify: Notifier
    undo: UndoStack
    clock: Clock
    today: Callable[[], datetime]
    devices: Devices
    folders: Folders
    sounds: Sounds = field(default_factory=Sounds)
    backgrounds: Backgrounds = field(default_factory=Backgrounds)


class View(Protocol):
    """A view that shows a presenter's state."""

    def show_state(self, state: Any, /) -> None:
        """Show the state."""


V = TypeVar("V", bound=View)


class Presenter(Generic[V]):
    """Resolves a state, and shows that state while a view is attached and visible."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._view: V | None = None
        self._in_front = True

    def attach(self, view: V) -> None:
        """Show the state in `view` from now on."""
        self._view = view
        self._refresh()

    def detach(self) -> None:
        """Stop showing the state because the view is being removed."""
        self._view = None

    def resolve(self) -> Any:
        """Return the view's state."""
        raise NotImplementedError

    def _refresh(self) -> None:
        if self._view is not None and self._in_front:
            self._view.show_state(self.resolve())
