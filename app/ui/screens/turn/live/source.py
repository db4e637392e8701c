"""The choice of the live camera: its source, address, field of view and resolution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol, TypeAlias

from app.core.guidance.guide import HeadingSource
from app.core.measure.film.movie_header import VIDEO_ENDINGS
from app.core.text import tr
from app.devices.webcam import LiveSource, WebcamError
from app.devices.webcam.files import check_video
from app.devices.webcam.network_connection import LONGEST_ADDRESS
from app.devices.webcam.sources import FOV_RANGE_DEG, WIDTHS
from app.ui.presenters.services import Services
from app.ui.screens.turn.live.camera import LiveCamera

Item: TypeAlias = tuple[str, str, str, str]
"""An entry in the list, given by its key, its text, its second line and its icon."""

VIDEO_FILES: Final = tr("Videos") + f" ({' '.join('*' + ending for ending in VIDEO_ENDINGS)})"
"""File filter for the dialog."""

_ITEMS: Final[tuple[Item, ...]] = (
    ("network", tr("Network camera…"), "", "wifi"),
    ("video", tr("Video file…"), "", "play"),
)
_SIZES: Final[dict[int, str]] = {640: "640 × 480", 1280: "1280 × 720", 1920: "1920 × 1080"}
NO_WEBCAMS: Final = (tr("No webcam found"), tr("Plug in a webcam."))
"""Text for a list without webcams, and advice on what to do."""
_CHECK: Final = "turn-source-check"
_STATUS_S: Final = 0.5
_LONGEST: Final = 128
_BOTH: Final = tr("Enter both the user name and the password.")
_UNSOUND: Final = tr("The user name or password contains invalid characters or is too long.")
_OVERHEARD: Final = tr(
    "Others on this Wi-Fi network could read it, because the connection is not encrypted."
)


@dataclass(frozen=True, slots=True)
class SourcesState:
    """The contents of the sheet.

    Attributes:
        key: Key of the selected entry.
        fov_deg: Field of view in degrees, whether set by the user or estimated.
        status, status_icon: Text on the state of the source, and its icon, which is "check",
            "error" or an empty string.
    """

    items: tuple[Item, ...] = _ITEMS
    key: str = "network"
    webcams: bool = False
    address: str = ""
    address_error: str = ""
    asks_password: bool = False
    password_error: str = ""
    password_hint: str = ""
    file: str = ""
    file_error: str = ""
    adjustable: bool = True
    known_fov: str = ""
    estimate: bool = True
    fov_deg: float = 65.0
    fov_words: str = ""
    widths: tuple[tuple[str, str], ...] = ()
    width: str = "0"
    status: str = ""
    status_icon: str = ""


class SourcesView(Protocol):
    """A view that shows a `SourcesState`."""

    def show_state(self, state: SourcesState) -> None:
        """Show the state."""


class SourcesPresenter:
    """Lets the user choose the live camera."""

    def __init__(
        self, services: Services, camera: LiveCamera, on_take: Callable[[], None] = lambda: None
    ) -> None:
        self._services = services
        self._camera = camera
        self._on_take = on_take
        self._view: SourcesView | None = None
        self._key = ""  # another kind, on display before it is used
        self._address_text = ""
        self._address_error = ""
        self._file_error = ""
        self._password_error = ""
        self._next_s = 0.0

    # -- the view ------------------------------------------------------------------------------

    def attach(self, view: SourcesView) -> None:
        """Start showing the state in `view`."""
        self._view = view
        self._forget()
        self._camera.list_again()
        self._show()

    def detach(self, view: SourcesView) -> None:
        """Stop showing the state in `view`, unless another view has replaced it."""
        if view is self._view:
            self._view = None

    def tick(self) -> None:
        """Refresh the state twice a second while the sheet is open."""
        now = self._services.clock.now()
        if self._view is not None and now >= self._next_s:
            self._show()

    # -- actions -------------------------------------------------------------------------------

    def show_kind(self, key: str) -> None:
        """Select an entry in the list. If it is a webcam, switch to it at once."""
        self._forget()
        kind, _, index = key.partition(":")
        if kind == "webcam":
            self._use(LiveSource.webcam(int(index)))
        else:
            self._key = key
        self._show()

    def type_address(self, text: str) -> None:
        """Store the address as it is typed, for `connect` to check later."""
        self._address_text, self._address_error = text[: 2 * LONGEST_ADDRESS], ""

    def connect(self, text: str) -> None:
        """Switch to a network camera."""
        self._address_text = text[: 2 * LONGEST_ADDRESS]
        try:
            source = LiveSource.network(text)
        except WebcamError as error:
            self._address_error = str(error)
        else:
            self._forget()
            self._use(source)
        self._show()

    def sign_in(self, user: str, password: str) -> None:
        """Sign in to the network camera in use."""
        user = user.strip()
        self._password_error = ""
        if not user or not password:
            self._password_error = _BOTH
        elif ":" in user or not all(
            text.isprintable() and len(text) < _LONGEST for text in (user, password)
        ):
            self._password_error = _UNSOUND
        else:
            self._camera.sign_in(user, password)
            self._on_take()
        self._show()

    def choose_video(self, path: Path | str) -> None:
        """Switch to a video file after checking it."""
        whole = Path(path).absolute()
        self._check(whole)

    def estimate(self, on: bool) -> None:
        """Estimate the field of view, or fix it at the last estimate."""
        self.set_fov(None if on else self._camera.fov_guess_deg)

    def set_fov(self, fov_deg: float | None) -> None:
        """Set the source's horizontal field of view in degrees, or None to estimate it."""
        if fov_deg is not None:
            fov_deg = min(max(fov_deg, FOV_RANGE_DEG[0]), FOV_RANGE_DEG[1])
        if fov_deg != self._camera.view.fov_deg:
            self._camera.set_fov(fov_deg)
            self._on_take()
        self._show()

    def set_width(self, key: str) -> None:
        """Set the width of the source's pictures in pixels, or "0" for the default."""
        if key.isdecimal() and int(key) in (0, *WIDTHS):
            self._camera.set_width(int(key))
            self._on_take()
        self._show()

    # -- state ---------------------------------------------------------------------------------

    def resolve(self) -> SourcesState:
        """Return the current contents of the sheet."""
        camera = self._camera
        source = camera.chosen
        current = source.text if source.kind == "webcam" else source.kind
        key = self._key or current
        in_use = key == current
        view = camera.view
        own_fov_deg = camera.own_fov_deg if in_use and view.fov_deg is None else None
        asks = in_use and self._asks_password()
        status, icon = self._status() if in_use else ("", "")
        if asks and self._password_trouble():
            status = ""  # reported beside the password instead
        return SourcesState(
            items=self._items(current),
            key=key,
            webcams=bool(camera.listed),
            address=self._address_text or (source.where if source.kind == "network" else ""),
            address_error=self._address_error,
            asks_password=asks,
            password_error=self._password_trouble() if asks else "",
            password_hint=self._password_hint() if asks else "",
            file=source.title if in_use and source.kind not in ("webcam", "network") else "",
            file_error=self._file_error,
            adjustable=in_use and not asks,
            known_fov=""
            if own_fov_deg is None
            else tr("{degrees:.0f}°, reported by the camera", degrees=own_fov_deg),
            estimate=view.fov_deg is None,
            fov_deg=camera.fov_guess_deg,
            fov_words=_learnt(view.learnt_deg),
            widths=_widths(source.kind),
            width=str(view.width),
            status=status,
            status_icon=icon,
        )

    def _items(self, current: str) -> tuple[Item, ...]:
        webcams = [(f"webcam:{index}", name, "", "webcam") for index, name in self._camera.listed]
        keys = {key for key, *_ in (*webcams, *_ITEMS)}
        if current not in keys:
            webcams.append((current, *self._missing(), "webcam"))
        return (*webcams, *_ITEMS)

    def _missing(self) -> tuple[str, str]:
        """Return the text and the second line for the source in use while it is unavailable."""
        camera = self._camera
        if camera.chosen.kind != "webcam":
            return camera.chosen.title, ""
        if not camera.looked:
            return tr("Looking for webcams…"), ""
        if not camera.listed:
            return NO_WEBCAMS
        return camera.chosen.title, tr("disconnected")

    def _status(self) -> tuple[str, str]:
        camera = self._camera
        if camera.error is not None:
            return str(camera.error), "error"
        if camera.source is HeadingSource.LIVE and camera.frame is not None:
            rows, columns = camera.frame.picture.shape[:2]
            return tr(
                "Live, {columns} × {rows}, {fps:.0f} frames per second",
                columns=columns,
                rows=rows,
                fps=camera.fps,
            ), "check"
        return (tr("Connecting…") if camera.source is HeadingSource.STARTING else ""), ""

    def _asks_password(self) -> bool:
        error = self._camera.error
        needs_password = error is not None and error.code in ("password", "password-refused")
        return self._camera.chosen.kind == "network" and (
            needs_password or bool(self._password_error)
        )

    def _password_trouble(self) -> str:
        error = self._camera.error
        is_refused = error is not None and error.code == "password-refused"
        return self._password_error or (str(error) if is_refused else "")

    def _password_hint(self) -> str:
        address = self._camera.chosen.address
        plain = address is not None and address.scheme != "https"
        hint = tr("The password is saved only in this computer’s keyring.")
        return f"{hint} {_OVERHEARD}" if plain else hint

    # -- video ---------------------------------------------------------------------------------

    def _check(self, path: Path) -> None:
        """Check a video, which may be on a slow disk, then switch to it."""
        self._forget()
        self._key = "video"
        self._services.runner.submit(
            _CHECK,
            lambda token, report: _video_source(path),
            done=self._checked,
            failed=self._unfit,
        )
        self._show()

    def _checked(self, source: LiveSource) -> None:
        self._forget()
        self._use(source)
        self._show()

    def _unfit(self, error: Exception) -> None:
        is_webcam_error = isinstance(error, WebcamError)
        self._file_error = (
            str(error) if is_webcam_error else tr("This file cannot be used. Choose another.")
        )
        self._show()

    def _use(self, source: LiveSource) -> None:
        if source == self._camera.chosen:
            self._camera.again()
        else:
            self._camera.use(source)
        self._on_take()

    def _forget(self) -> None:
        self._key = self._address_text = ""
        self._address_error = self._file_error = self._password_error = ""

    def _show(self) -> None:
        self._next_s = self._services.clock.now() + _STATUS_S
        if self._view is not None:
            self._view.show_state(self.resolve())


def _video_source(path: Path) -> LiveSource:
    check_video(path)
    return LiveSource.parse(f"video:{path}")


def _learnt(learnt_deg: float | None) -> str:
    return (
        tr("not yet known")
        if learnt_deg is None
        else tr("{degrees:.0f}° so far", degrees=learnt_deg)
    )


def _widths(kind: str) -> tuple[tuple[str, str], ...]:
    """Return the available resolutions. Pictures not from a webcam are scaled down."""
    exact = kind == "webcam"
    sizes = (
        (str(w), _SIZES[w] if exact else tr("At most {pixels} px wide", pixels=w)) for w in WIDTHS
    )
    return (("0", tr("Automatic")), *sizes)
