"""Finds and selects the 360 camera, and reads its status, using a password if necessary."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

from app.core.base.errors import CoreError
from app.core.base.phrases import percent
from app.core.base.progress import PhraseReport, Token
from app.core.text import tr
from app.devices.clock import Clock, wait
from app.devices.errors import BadReply, DeviceError, NotACamera, PasswordNeeded, Unreachable
from app.devices.passwords import Credentials, default_password_hint
from app.devices.theta.camera_identity import FoundCamera, same_camera
from app.devices.theta.client import OscClient
from app.devices.theta.discovery import Discovery
from app.devices.theta.first_contact import FirstContact
from app.devices.theta.last_camera import remember
from app.ui.presenters.services import Services, T
from app.ui.presenters.window_frame import camera_warning
from app.ui.presenters.window_model import CameraSeen
from app.ui.screens.probe.capture.checklist import ChoiceRow


@dataclass(frozen=True, slots=True)
class CameraBlock:
    """The camera, and the panel for choosing another camera.

    Attributes:
        title, second: Display text such as "RICOH THETA V" and "Wi-Fi, battery 82%, 1.9 GB free".
        missing: Whether there is no camera, in which case `second` says what to do.
    """

    title: str = tr("No camera")
    second: str = ""
    short: str = ""
    warning: str = ""
    busy: str = ""
    missing: bool = True
    open: bool = False
    rows: tuple[ChoiceRow, ...] = ()
    chosen: str = ""
    note: str = ""
    address_error: str = ""
    asks_password: bool = False
    user: str = ""
    password_error: str = ""
    password_hint: str = ""


_LOOPBACK: Final = ("127.", "localhost", "::1")


def is_loopback(host: str) -> bool:
    """Return whether an address belongs to this computer."""
    return host.startswith(_LOOPBACK)


def camera_second(camera: CameraSeen, *, short: bool = False) -> str:
    """Return a camera's status, such as "Wi-Fi, battery 82%, 1.9 GB free" or "82%, 1.9 GB free"."""
    parts = []
    if not short:
        # Every 360 camera is on Wi-Fi, but a simulated one runs on this computer.
        parts.append(tr("Local") if is_loopback(camera.device.endpoint.host) else tr("Wi-Fi"))
    if camera.battery is not None:
        charge = percent(camera.battery)
        parts.append(charge if short else tr("battery {charge}", charge=charge))
    if camera.free_bytes is not None:
        parts.append(tr("{size} GB free", size=f"{camera.free_bytes / 1e9:.1f}"))
    return ", ".join(parts)


NO_CAMERA: Final = tr(
    "No camera found. Turn on the camera's Wi-Fi and join its network, or enter its address."
)

_SEVERAL: Final = tr("Several cameras were found. Choose yours.")

_BOTH: Final = tr("Enter both the user name and the password.")


class CameraFinder:
    """Finds cameras and keeps track of the one in use."""

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._cameras: tuple[FoundCamera, ...] = ()
        self._keys: dict[str, Credentials] = {}
        self._searched = False
        self._missing = ""
        self._block = CameraBlock()  # holds only the fields that do not come from the cameras

    # -- state ---------------------------------------------------------------------------------

    def block(self) -> CameraBlock:
        """Return the state of the camera block."""
        status, block = self._services.model.camera, self._block
        block = replace(block, rows=tuple(_row(camera) for camera in self._cameras))
        if status is None:
            second = self._missing or (
                "" if self._searched else tr("Turnlight has not looked for one yet.")
            )
            return replace(block, second=block.busy or second, asks_password=False)
        device, unsure = status.device, block.busy or self._missing
        return replace(
            block,
            title=device.model or device.name,
            second=unsure or camera_second(status),
            short="" if unsure else camera_second(status, short=True),
            warning=camera_warning(status),
            missing=False,
            chosen=_key(device),
            user=device.user,
            password_hint=default_password_hint(device.model, device.serial)
            if block.asks_password
            else "",
        )

    def _say(self, **changes: Any) -> None:
        """Change fields of the `CameraBlock` and show the result."""
        self._block = replace(self._block, **changes)
        self._changed()

    def credentials(self, camera: FoundCamera) -> Credentials | None:
        """Return a camera's stored credentials without blocking, or None if there are none."""
        return self._keys.get(_account(camera))

    # -- user actions --------------------------------------------------------------------------

    def toggle_panel(self) -> None:
        """Open or close the panel for choosing a camera."""
        self._say(open=not self._block.open, address_error="")

    def connect(self) -> None:
        """Open the camera panel and search again."""
        self._say(open=True, address_error="")
        self.search()

    def ask_password(self, error: Exception) -> None:
        """Ask for a password because the camera requires one or rejected the last one."""
        camera = self._services.model.camera
        again = camera is not None and self.credentials(camera.device) is not None
        wrong = getattr(error, "message", str(error)) if again else ""
        self._say(open=True, asks_password=True, password_error=wrong)

    def search(self) -> None:
        """Search for cameras."""
        devices = self._services.devices
        self._say(busy=tr("Looking for cameras…"), note="", address_error="")
        self._find(lambda token, _: devices.discover(token), self._discovered, self._not_found)

    def _find(
        self,
        work: Callable[[Token, PhraseReport], T],
        done: Callable[[T], None],
        failed: Callable[[Exception], None],
    ) -> None:
        on_cancel = partial(self._given_up, "cameras", "")
        self._services.runner.submit("cameras", work, done=done, failed=failed, cancelled=on_cancel)

    def pause(self) -> None:
        """Stop searching because the list has been closed."""
        self._services.runner.cancel("cameras")

    def begin(self) -> None:
        """Refresh the camera's status, or search for a camera if there is none yet."""
        if self._services.model.camera is None:
            if not self._services.runner.running("cameras"):
                self.search()
        else:
            self.refresh()

    def look_at(self, address: str) -> None:
        """Look for a camera at the typed address."""
        devices = self._services.devices
        if not address.strip():
            self._say(address_error=tr("Enter an address, for example 192.168.1.1."))
            return
        self._say(busy=tr("Contacting {address}…", address=address.strip()), address_error="")
        self._find(
            lambda token, _: devices.look_at(address.strip(), token),
            self._looked_at,
            self._not_there,
        )

    def choose(self, key: str) -> None:
        """Switch to a camera from the list."""
        for camera in self._cameras:
            if _key(camera) == key:
                self._use(camera)
                self._changed()

    def give_password(self, user: str, password: str) -> None:
        """Try a password. If it is correct, save it in the system's keyring and nowhere else."""
        camera = self._services.model.camera
        if camera is None:
            return
        if not user.strip() or not password:
            self._say(password_error=_BOTH)
            return
        self._keys[_account(camera.device)] = Credentials(user.strip(), password)
        self._block = replace(self._block, password_error="")
        self._read(camera.device, keep=True)

    def refresh(self) -> None:
        """Refresh the status of the camera in use."""
        camera = self._services.model.camera
        if camera is not None and not camera.busy:
            self._read(camera.device)

    def worked(self, camera: FoundCamera) -> None:
        """Remember a camera that has captured a bracket, so that the next session can find it."""
        # A simulated camera on this computer will not exist after a restart.
        if not is_loopback(camera.endpoint.host):
            home = self._services.folders.home
            self._services.runner.submit("remember-camera", lambda *_: remember(camera, home))

    # -- results -------------------------------------------------------------------------------

    def _discovered(self, discovery: Discovery) -> None:
        self._cameras = discovery.cameras
        self._block = replace(self._block, note=" ".join(discovery.notes), busy="")
        self._missing, self._searched = "", True
        before = self._services.model.camera
        same = None
        if before is not None:
            same = next((c for c in self._cameras if same_camera(c, before.device)), None)
        if same is not None:
            self._use(same)
        elif not self._cameras:
            self._lack(NO_CAMERA)
            if before is not None:
                self._services.model.update(camera=None)
        else:
            try:
                self._use(discovery.one())
            except DeviceError:
                self._lack(_SEVERAL)
        self._changed()

    def _not_found(self, error: Exception) -> None:
        self._searched = True
        self._lack(NO_CAMERA)
        self._say(busy="", note=str(error) if isinstance(error, (DeviceError, CoreError)) else "")

    def _lack(self, sentence: str) -> None:
        self._missing, self._block = sentence, replace(self._block, open=True)

    def _looked_at(self, camera: FoundCamera) -> None:
        self._missing, self._block = "", replace(self._block, busy="")
        others = (each for each in self._cameras if not same_camera(each, camera))
        self._cameras = (camera, *others)
        self._use(camera)
        self._changed()

    def _not_there(self, error: Exception) -> None:
        self._say(address_error=str(error), open=True, busy="")

    def _given_up(self, key: str, note: str) -> None:
        # A job that was replaced by a newer one must not change the status.
        if not self._services.runner.running(key):
            self._say(busy="", note=note)

    def _use(self, camera: FoundCamera) -> None:
        self._missing = ""
        is_open = self._block.open and camera.needs_password
        self._block = replace(self._block, password_error="", asks_password=False, open=is_open)
        self._services.model.update(camera=CameraSeen(camera))
        self._read(camera)

    def _read(self, camera: FoundCamera, *, keep: bool = False) -> None:
        devices, clock = self._services.devices, self._services.clock
        credentials = self.credentials(camera)

        def work(token: Token, _report: object) -> tuple[CameraSeen, Credentials | None]:
            keys = credentials
            if keys is None and camera.needs_password and camera.user:
                password = devices.passwords().get(camera.user)
                keys = None if password is None else Credentials(camera.user, password)
            if keys is None and camera.needs_password:
                raise PasswordNeeded(tr("{name} asks for a password.", name=camera.name))
            with contextlib.closing(devices.link(camera, keys)) as link:
                answer = _asked_again(OscClient(link, clock, token), camera, clock, token)
            if keep and keys is not None and camera.needs_password:
                devices.passwords().set(keys.user, keys.password)
            return answer, keys

        self._say(busy=tr("Contacting the camera…"))
        self._services.runner.submit(
            "camera-state",
            work,
            done=lambda answer: self._take_answer(camera, *answer),
            failed=lambda error: self._refused(camera, error),
            cancelled=lambda: self._given_up("camera-state", self._block.note),
        )

    def _take_answer(
        self, camera: FoundCamera, status: CameraSeen, keys: Credentials | None
    ) -> None:
        block, self._missing = self._block, ""
        if keys is not None:
            self._keys[_account(camera)] = keys
        is_open = block.open and not block.asks_password
        self._block = replace(block, busy="", password_error="", asks_password=False, open=is_open)
        model = self._services.model
        if model.camera is not None and same_camera(model.camera.device, camera):
            model.update(camera=replace(status, busy=model.camera.busy))
        self._changed()

    def _refused(self, camera: FoundCamera, error: Exception) -> None:
        if isinstance(error, PasswordNeeded):
            again = self._keys.pop(_account(camera), None) is not None
            self._missing = tr("The camera asks for a password.")
            wrong = error.message if again else ""
            self._say(busy="", open=True, asks_password=True, password_error=wrong)
        else:
            self._missing = getattr(error, "message", str(error))
            self._say(busy="")


def _asked_again(client: OscClient, camera: FoundCamera, clock: Clock, token: Token) -> CameraSeen:
    """Read a camera's status, retrying after an incomplete or garbled reply."""
    first = FirstContact(clock, silences=1)
    while True:
        try:
            return _ask(client, camera)
        except (Unreachable, BadReply, NotACamera) as error:
            if first.hopeless(error):
                raise
        wait(clock, first.pause_s(), token)


def _ask(client: OscClient, camera: FoundCamera) -> CameraSeen:
    """Read a camera's model, battery level and free space, omitting whatever it does not report."""
    info = client.info()
    with contextlib.suppress(DeviceError):
        client.use_api_2()
    state = client.state()
    free: int | None = None
    with contextlib.suppress(DeviceError):
        value = client.get_options(["remainingSpace"]).get("remainingSpace")
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value >= 0:
            free = int(value)
    name = " ".join(text for text in (info.model, info.serial_number) if text) or camera.name
    device = replace(camera, name=name, model=info.model, serial=info.serial_number)
    return CameraSeen(device, state.battery_level, free)


def _row(camera: FoundCamera) -> ChoiceRow:
    words = [camera.endpoint.host]
    words += [tr("last used")] if camera.used_last else []
    words += [tr("password")] if camera.needs_password else []
    return ChoiceRow(_key(camera), camera.name, ", ".join(words))


def _key(camera: FoundCamera) -> str:
    return camera.endpoint.base


def _account(camera: FoundCamera) -> str:
    return camera.serial or camera.endpoint.base
