"""The live camera of the Turn screen: found, opened and closed, and how it is, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from app.core.turning.guidance import Source
from app.devices.webcam import WebcamState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from app.devices.webcam import Webcam, WebcamError, WebcamFrame
    from app.ui.presenters.services import Services

__all__ = ["LiveCamera"]

_LIST: Final = "turn-webcams"
_LOOK_AGAIN_S: Final = 5.0
_LARGEST_INDEX: Final = 15


class LiveCamera:
    """Runs one webcam while the screen is in front.

    Parameters
    ----------
    services : Services
        The window's.
    changed : callable
        Called when webcams were listed or another one was taken.

    Attributes
    ----------
    listed : tuple of (index, name)
        Webcams of this computer, as found last.
    frame : WebcamFrame or None
        The newest picture; it stays when the webcam goes away.
    index : int
        Of the webcam in use.
    """

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._webcam: Webcam | None = None
        self._wanted = False
        self._looked = False
        self._again_s = 0.0
        self.listed: tuple[tuple[int, str], ...] = ()
        self.frame: WebcamFrame | None = None
        self.index = 0

    # -- beginning and end ---------------------------------------------------------------------

    def start(self) -> None:
        """Look for webcams and open one; does nothing while it runs."""
        if self._wanted:
            return
        self._wanted, self._looked = True, False
        self._list()

    def stop(self) -> None:
        """Give the webcam back, without waiting for it."""
        self._wanted = False
        self._services.runner.cancel(_LIST)
        self._release()

    def choose(self, index: int) -> None:
        """Take another webcam from now on.

        Parameters
        ----------
        index : int
            Of one that was listed.
        """
        if 0 <= index <= _LARGEST_INDEX:
            model = self._services.model
            model.update(settings=model.settings.with_("webcam", index))
        if self._wanted and (index != self.index or self._webcam is None):
            self._open(index)
            self._changed()

    def tick(self) -> bool:
        """Take the newest picture; look for a webcam from time to time where there is none.

        Returns
        -------
        bool
            Whether a new picture is there.
        """
        if not self._wanted:
            return False
        if self._webcam is None:
            if self._looked and self._services.clock.now() >= self._again_s:
                self._list()
            return False
        newest = self._webcam.frames.get()
        if newest is None:
            return False
        self.frame = newest
        return True

    def _list(self) -> None:
        devices = self._services.devices
        self._again_s = self._services.clock.now() + _LOOK_AGAIN_S
        self._services.runner.submit(
            _LIST,
            lambda token, report: tuple(devices.webcams()),
            done=self._listed,
            # Nothing to choose from is no reason for a message: the screen says it anyway.
            failed=lambda error: self._listed(()),
        )

    def _listed(self, found: Sequence[tuple[int, str]]) -> None:
        self.listed, self._looked = tuple(found), True
        self._again_s = self._services.clock.now() + _LOOK_AGAIN_S
        if not self._wanted:
            return
        indices = [index for index, _ in self.listed]
        if indices and self._webcam is None:
            chosen = self._services.model.settings.webcam
            self._open(chosen if chosen in indices else indices[0])
        self._changed()

    def _open(self, index: int) -> None:
        self._release()
        self.index = index
        self._webcam = self._services.devices.webcam(index)
        self._webcam.open()

    def _release(self) -> None:
        webcam, self._webcam = self._webcam, None
        self.frame = None
        if webcam is not None:
            # Its thread ends by itself; waiting for it would hold up the screens.
            webcam.close(0.0)

    # -- how it is -----------------------------------------------------------------------------

    @property
    def simulated(self) -> Any:
        """The demo's camera, which can be moved; None for a real one."""
        return getattr(self._services.devices, "simulated", None)

    @property
    def source(self) -> Source:
        """How the webcam is, as the guidance wants to know it."""
        if not self._wanted or self._webcam is None:
            return Source.NONE if self._looked or not self._wanted else Source.STARTING
        state = self._webcam.state
        if self.frame is not None:
            return Source.LIVE if state is WebcamState.LIVE else Source.AWAY
        if state in (WebcamState.RETRYING, WebcamState.LOST):
            return Source.NONE
        return Source.STARTING

    @property
    def error(self) -> WebcamError | None:
        """What is wrong with it, or with its pictures."""
        return None if self._webcam is None else self._webcam.error

    @property
    def name(self) -> str:
        """Its name; empty without one."""
        return "" if self._webcam is None else self._webcam.name

    @property
    def fov_deg(self) -> float:
        """Horizontal field of view: its own where it knows it, else the one that is set, deg."""
        webcam = self._webcam
        if webcam is not None and (webcam is self.simulated or getattr(webcam, "knows_fov", False)):
            return webcam.fov_deg
        return self._services.model.settings.webcam_fov_deg

    @property
    def distance_m(self) -> float:
        """From the sitter: its own where it knows it, else the one that is set, metres."""
        own = getattr(self._webcam, "distance_m", None)
        return float(own) if own else self._services.model.settings.camera_distance_m

    @property
    def looks(self) -> str:
        """Which way it looks: ``sitter``, ``me``, or ``ask`` while nobody knows."""
        hint = getattr(self._webcam, "looks_at", "")
        if hint in ("sitter", "me"):
            return str(hint)
        if self._webcam is not None and self._webcam is self.simulated:
            return "sitter"
        return self._services.model.settings.camera_looks
