"""The live camera: the list of webcams, the open source and its state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from app.core.guidance.guide import HeadingSource
from app.devices.passwords import Credentials
from app.devices.webcam import (
    GUESS_FOV_DEG,
    LiveSource,
    SourceView,
    SourceViews,
    Webcam,
    WebcamError,
    WebcamFrame,
    WebcamState,
)
from app.devices.webcam.sources import FOV_RANGE_DEG, WIDTHS, make_source
from app.ui.presenters.services import Services

_LIST: Final = "turn-webcams"
_KEEP: Final = "turn-camera-password"
_LOOK_AGAIN_S: Final = 5.0
_LARGEST_INDEX: Final = 15
_LEARN_DEG: Final = 1.0  # a smaller change is noise in the estimate


class LiveCamera:
    """Runs one live source while the screen is visible.

    Attributes:
        listed: Index and name of each webcam on this computer.
        looked: Whether the webcams have been listed since `start`.
        frame: The newest picture, or None before the first one.
        chosen: The source in use.
    """

    def __init__(
        self,
        services: Services,
        changed: Callable[[], None],
        make: Callable[..., Webcam] = make_source,
    ) -> None:
        self._services = services
        self._changed = changed
        self._make = make
        self._webcam: Webcam | None = None
        self._is_on = False
        self.looked = False
        self._again_s = 0.0
        self._signed: dict[str, Credentials] = {}  # by host, until the program ends
        self._unkept: tuple[str, Credentials] | None = None
        self.listed: tuple[tuple[int, str], ...] = ()
        self.frame: WebcamFrame | None = None
        settings = services.model.settings
        # The demo has its own camera, so its choice is not saved.
        self._demo = getattr(services.devices, "simulated", None) is not None
        remembered = _source_of(settings.live_source, settings.webcam)
        self.chosen = LiveSource.webcam(0) if self._demo else remembered
        self._views = SourceViews.parse(settings.live_views)

    # -- start and stop ------------------------------------------------------------------------

    def start(self) -> None:
        """List the webcams and open the source, unless the camera is already running."""
        if self._is_on:
            return
        self._is_on, self.looked = True, False
        self._take_demo(self._services.model.demo_open and not self._demo)
        if self.chosen.kind != "webcam":
            self._open(self.chosen)
        self._list()

    def _take_demo(self, on: bool) -> None:
        """Use the demo's simulated webcam while the demo place is open."""
        if on:
            self.chosen = LiveSource("demo", str(self._services.folders.demo))
        elif self.chosen.kind == "demo":
            settings = self._services.model.settings
            self.chosen = _source_of(settings.live_source, settings.webcam)

    def stop(self) -> None:
        """Close the source without waiting for its thread."""
        self._is_on = False
        self._services.runner.cancel(_LIST)
        self._release()
        self._keep_views()

    def choose(self, index: int) -> None:
        """Switch to another webcam."""
        if 0 <= index <= _LARGEST_INDEX:
            self.use(LiveSource.webcam(index))

    def use(self, source: LiveSource) -> None:
        """Switch to another source, and remember it for the next start."""
        same = source == self.chosen and self._webcam is not None
        self._keep_source(source)
        self.chosen = source
        if self._is_on and not same:
            self._open(source)
        self._changed()

    def again(self) -> None:
        """Reopen the source, unless the screen is hidden."""
        if self._is_on:
            self._open(self.chosen)
            self._changed()

    def list_again(self) -> None:
        """Refresh the list of webcams."""
        if self._is_on and not self._services.runner.running(_LIST):
            self._list()

    def tick(self) -> bool:
        """Read the newest picture, or look for a webcam. Return whether a picture has arrived."""
        if not self._is_on:
            return False
        if self._webcam is None:
            if self.looked and self._services.clock.now() >= self._again_s:
                self._list()
            return False
        newest = self._webcam.frames.get()
        if newest is None:
            return False
        self.frame = newest
        self._keep_password()
        return True

    def _list(self) -> None:
        devices = self._services.devices
        self._again_s = self._services.clock.now() + _LOOK_AGAIN_S
        self._services.runner.submit(
            _LIST,
            lambda token, report: tuple(devices.webcams()),
            done=self._listed,
            # The screen already shows that there is no webcam, so skip the message.
            failed=lambda error: self._listed(()),
        )

    def _listed(self, webcams: Sequence[tuple[int, str]]) -> None:
        self.listed, self.looked = tuple(webcams), True
        self._again_s = self._services.clock.now() + _LOOK_AGAIN_S
        if not self._is_on:
            return
        indices = [index for index, _ in self.listed]
        if indices and self._webcam is None:
            remembered_index = self._services.model.settings.webcam
            self.chosen = LiveSource.webcam(
                remembered_index if remembered_index in indices else indices[0]
            )
            self._open(self.chosen)
        self._changed()

    def _open(self, source: LiveSource) -> None:
        self._release()
        if source.kind == "webcam":
            self._webcam = self._services.devices.webcam(source.index)
            ask = getattr(self._webcam, "ask_width", None)
            if ask is not None:
                ask(self.view.width)
        else:
            address = source.address
            host = "" if address is None else address.host
            self._webcam = self._make(
                source, self._services.clock, width=self.view.width, keys=lambda: self._keys(host)
            )
        self._webcam.open()

    def _release(self) -> None:
        webcam, self._webcam = self._webcam, None
        self.frame = None
        if webcam is not None:
            # The source's thread ends by itself, and waiting would block the window.
            webcam.close(0.0)

    # -- saved settings ------------------------------------------------------------------------

    @property
    def index(self) -> int:
        """Index of the webcam in use, or -1 for any other source."""
        return self.chosen.index if self.chosen.kind == "webcam" else -1

    @property
    def view(self) -> SourceView:
        """Field of view and resolution saved for the source in use."""
        return self._views.of(self.chosen)

    def set_fov(self, fov_deg: float | None) -> None:
        """Set the source's horizontal field of view in degrees, or None to estimate it."""
        if fov_deg is None or FOV_RANGE_DEG[0] <= fov_deg <= FOV_RANGE_DEG[1]:
            self._views = self._views.with_(self.chosen, fov_deg=fov_deg)
            self._keep_views()
            self._changed()

    def set_width(self, width: int) -> None:
        """Set the width in pixels of the source's pictures, or 0 for the default."""
        if width != self.view.width and width in (0, *WIDTHS):
            self._views = self._views.with_(self.chosen, width=width)
            self._keep_views()
            self.again()

    def learn_fov(self, fov_deg: float) -> None:
        """Remember an estimated horizontal field of view, in degrees, for use in drawing only."""
        before = self.view.learnt_deg
        inside = FOV_RANGE_DEG[0] <= fov_deg <= FOV_RANGE_DEG[1]
        if inside and (before is None or abs(fov_deg - before) >= _LEARN_DEG):
            self._views = self._views.with_(self.chosen, learnt_deg=fov_deg)

    def sign_in(self, user: str, password: str) -> None:
        """Sign in to the network camera in use."""
        address = self.chosen.address
        if address is not None:
            keys = Credentials(user, password)
            self._signed[address.host], self._unkept = keys, (address.host, keys)
            self.again()

    def _keys(self, host: str) -> Credentials | None:
        """Return the user name and password for a host. This runs on the source's own thread."""
        credentials = self._signed.get(host)
        if credentials is not None:
            return credentials
        saved = self._services.devices.passwords().get(host)
        user, colon, password = (saved or "").partition(":")
        return Credentials(user, password) if colon else None

    def _keep_password(self) -> None:
        if self._unkept is None:
            return
        (host, keys), self._unkept = self._unkept, None
        address = self.chosen.address
        if address is not None and address.host == host:
            devices = self._services.devices
            self._services.runner.submit(
                _KEEP,
                lambda token, report: devices.passwords().set(host, f"{keys.user}:{keys.password}"),
            )

    def _keep_source(self, source: LiveSource) -> None:
        model = self._services.model
        settings = model.settings
        if self._demo:
            return
        if source.kind == "webcam":
            settings = settings.with_("webcam", source.index).with_("live_source", "")
        elif source.keepable:
            settings = settings.with_("live_source", source.text)
        if settings != model.settings:
            model.update(settings=settings)

    def _keep_views(self) -> None:
        model = self._services.model
        text = self._views.view_of(self.chosen).text
        if text != model.settings.live_views:
            model.set("live_views", text)

    # -- state of the camera -------------------------------------------------------------------

    @property
    def simulated(self) -> Any:
        """The demo's camera, which the screen can move, or None for a real camera."""
        if getattr(self._webcam, "set_turn", None) is not None:
            return self._webcam
        if self.chosen.kind != "webcam":
            return None
        return getattr(self._services.devices, "simulated", None)

    @property
    def source(self) -> HeadingSource:
        """State of the source, in the form required by the guidance."""
        if not self._is_on or self._webcam is None:
            return HeadingSource.NONE if self.looked or not self._is_on else HeadingSource.STARTING
        state = self._webcam.state
        if self.frame is not None:
            return HeadingSource.LIVE if state is WebcamState.LIVE else HeadingSource.AWAY
        if state in (WebcamState.RETRYING, WebcamState.LOST):
            return HeadingSource.NONE
        return HeadingSource.STARTING

    @property
    def error(self) -> WebcamError | None:
        """The problem with the camera or its pictures, or None if there is no problem."""
        return None if self._webcam is None else self._webcam.error

    @property
    def fps(self) -> float:
        """Current frame rate in pictures per second."""
        return 0.0 if self._webcam is None else self._webcam.fps

    @property
    def name(self) -> str:
        """Name of the camera, which may be empty."""
        if self._webcam is None:
            return ""
        listed = dict(self.listed) if self.chosen.kind == "webcam" else {}
        return listed.get(self.chosen.index, self._webcam.name)

    @property
    def fov_deg(self) -> float | None:
        """Horizontal field of view in degrees, from the settings or the source.

        It is None if the field of view must be estimated from the pictures.
        """
        set_deg = self.view.fov_deg
        return self.own_fov_deg if set_deg is None else set_deg

    @property
    def own_fov_deg(self) -> float | None:
        """Horizontal field of view in degrees as reported by the source, or None if unreported."""
        return None if self._webcam is None else self._webcam.fov_deg

    @property
    def fov_guess_deg(self) -> float:
        """Field of view for drawing in degrees: the actual, last estimated or default value."""
        return self.fov_deg or self.view.learnt_deg or GUESS_FOV_DEG

    @property
    def distance_m(self) -> float:
        """Distance from the sitter in metres, reported by the camera or else set by the user."""
        own = getattr(self._webcam, "distance_m", None)
        return float(own) if own else self._services.model.settings.camera_distance_m

    @property
    def looks(self) -> str:
        """The person that the camera faces: ``sitter``, ``me``, or ``ask`` if that is unknown."""
        hint = getattr(self._webcam, "looks_at", "")
        if hint in ("sitter", "me"):
            return str(hint)
        if self._webcam is not None and self._webcam is self.simulated:
            return "sitter"
        return self._services.model.settings.camera_looks


def _source_of(text: str, index: int) -> LiveSource:
    """Parse a saved source, falling back to a webcam if the text is invalid."""
    try:
        return LiveSource.parse(text) if text else LiveSource.webcam(index)
    except WebcamError:
        return LiveSource.webcam(index)
