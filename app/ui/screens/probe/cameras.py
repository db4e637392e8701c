"""Finding the 360 camera, choosing it, and asking how it is."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.devices.errors import DeviceError, PasswordNeeded
from app.devices.passwords import default_password_hint
from app.devices.theta.client import OscClient
from app.devices.theta.found import remember, same_camera
from app.devices.theta.link import Credentials
from app.ui.presenters.frame import camera_warning
from app.ui.presenters.model import CameraSeen
from app.ui.screens.probe.state import CameraBlock, CameraRow
from app.ui.screens.probe.words import camera_second, is_loopback

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.base.progress import Token
    from app.devices.theta.discovery import Discovery
    from app.devices.theta.found import FoundCamera
    from app.ui.presenters.services import Services

_NONE: Final = "No camera found. Switch its Wi-Fi on and join it, or type its address."
_SEVERAL: Final = "Several cameras were found. Choose yours."
_BOTH: Final = "Type both the user name and the password."


class CameraFinder:
    """Which camera is used."""

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._found: tuple[FoundCamera, ...] = ()
        self._keys: dict[str, Credentials] = {}
        self._searched = False
        self._busy = ""
        self._note = ""
        self._missing = ""
        self._open = False
        self._address_error = ""
        self._asks = False
        self._password_error = ""

    # -- what is shown -------------------------------------------------------------------------

    def block(self) -> CameraBlock:
        """Work out what is shown of the camera."""
        seen = self._services.model.camera
        found = None if seen is None else seen.found
        second = self._missing or ("" if self._searched else "Not looked for yet.")
        if seen is not None:
            second = self._missing or camera_second(seen)
        hint = "" if found is None else default_password_hint(found.model, found.serial)
        return CameraBlock(
            title="No camera" if found is None else found.model or found.name,
            second=self._busy or second,
            short="" if seen is None or self._busy or self._missing else _short(seen),
            warning=camera_warning(seen),
            busy=self._busy,
            missing=seen is None,
            open=self._open,
            rows=tuple(_row(camera) for camera in self._found),
            chosen="" if found is None else _key(found),
            note=self._note,
            address_error=self._address_error,
            asks_password=self._asks and found is not None,
            user="" if found is None else found.user,
            password_error=self._password_error,
            password_hint=hint if self._asks else "",
        )

    def credentials(self, camera: FoundCamera) -> Credentials | None:
        """Return user name and password for a camera, where they are known; never waits."""
        return self._keys.get(_account(camera))

    # -- what the user does --------------------------------------------------------------------

    def toggle_panel(self) -> None:
        """Open or close the panel in which the camera is chosen."""
        self._open = not self._open
        self._address_error = ""
        self._changed()

    def ask_password(self, error: Exception) -> None:
        """Ask for a password: the camera wants one, or did not take it."""
        known = self._services.model.camera
        again = known is not None and self.credentials(known.found) is not None
        self._open = self._asks = True
        self._password_error = getattr(error, "message", str(error)) if again else ""
        self._changed()

    def search(self) -> None:
        """Look for cameras."""
        devices = self._services.devices
        self._busy, self._note, self._address_error = "Looking for cameras…", "", ""
        self._services.runner.submit(
            "cameras",
            lambda token, report: devices.discover(token),
            done=self._discovered,
            failed=self._not_found,
            cancelled=lambda: self._given_up("cameras", ""),
        )
        self._changed()

    def pause(self) -> None:
        """Stop searching; nobody looks."""
        self._services.runner.cancel("cameras")

    def begin(self) -> None:
        """Search when there is no camera yet, else ask how the one in use is."""
        if self._services.model.camera is None:
            if not self._services.runner.running("cameras"):
                self.search()
        else:
            self.refresh()

    def look_at(self, address: str) -> None:
        """Ask an address that was typed."""
        devices = self._services.devices
        if not address.strip():
            self._address_error = "Type an address, for example 192.168.1.1."
            self._changed()
            return
        self._busy, self._address_error = f"Asking {address.strip()}…", ""
        self._services.runner.submit(
            "cameras",
            lambda token, report: devices.look_at(address.strip()),
            done=self._looked_at,
            failed=self._not_there,
            cancelled=lambda: self._given_up("cameras", ""),
        )
        self._changed()

    def choose(self, key: str) -> None:
        """Use one of the cameras that were found."""
        for camera in self._found:
            if _key(camera) == key:
                self._use(camera)
                self._changed()

    def give_password(self, user: str, password: str) -> None:
        """Try a password; one that is right goes into the system's keyring and nowhere else."""
        seen = self._services.model.camera
        if seen is None:
            return
        if not user.strip() or not password:
            self._password_error = _BOTH
            self._changed()
            return
        self._keys[_account(seen.found)] = Credentials(user.strip(), password)
        self._password_error = ""
        self._read(seen.found, keep=True)

    def refresh(self) -> None:
        """Ask the camera in use how it is."""
        seen = self._services.model.camera
        if seen is not None and not seen.busy:
            self._read(seen.found)

    def worked(self, camera: FoundCamera) -> None:
        """Remember a camera that took a bracket, for the next start."""
        # A simulated camera on this computer is not there the next time.
        if not is_loopback(camera.endpoint.host):
            home = self._services.folders.home
            self._services.runner.submit(
                "remember-camera", lambda token, report: remember(camera, home)
            )

    # -- answers -------------------------------------------------------------------------------

    def _discovered(self, discovery: Discovery) -> None:
        self._found = discovery.cameras
        self._note = " ".join(discovery.notes)
        self._busy, self._missing, self._searched = "", "", True
        before = self._services.model.camera
        same = None
        if before is not None:
            same = next((c for c in self._found if same_camera(c, before.found)), None)
        if same is not None:
            self._use(same)
        elif not self._found:
            self._missing, self._open = _NONE, True
            if before is not None:
                self._services.model.update(camera=None)
        else:
            try:
                self._use(discovery.one())
            except DeviceError:
                self._missing, self._open = _SEVERAL, True
        self._changed()

    def _not_found(self, error: Exception) -> None:
        self._searched, self._missing, self._open = True, _NONE, True
        self._end(str(error) if isinstance(error, (DeviceError, CoreError)) else "")

    def _looked_at(self, camera: FoundCamera) -> None:
        self._busy, self._missing = "", ""
        others = (each for each in self._found if not same_camera(each, camera))
        self._found = (camera, *others)
        self._use(camera)
        self._changed()

    def _not_there(self, error: Exception) -> None:
        self._address_error, self._open = str(error), True
        self._end(self._note)

    def _given_up(self, key: str, note: str) -> None:
        # One that a newer one has followed has nothing to say of it.
        if not self._services.runner.running(key):
            self._end(note)

    def _end(self, note: str) -> None:
        self._busy, self._note = "", note
        self._changed()

    def _use(self, camera: FoundCamera) -> None:
        self._missing = self._password_error = ""
        self._asks = False
        if not camera.needs_password:
            self._open = False
        self._services.model.update(camera=CameraSeen(camera))
        self._read(camera)

    def _read(self, camera: FoundCamera, *, keep: bool = False) -> None:
        devices, clock = self._services.devices, self._services.clock
        given = self.credentials(camera)

        def work(token: Token, report: object) -> tuple[CameraSeen, Credentials | None]:
            del report
            keys = given
            if keys is None and camera.needs_password and camera.user:
                kept = devices.passwords().get(camera.user)
                keys = None if kept is None else Credentials(camera.user, kept)
            if keys is None and camera.needs_password:
                raise PasswordNeeded(f"{camera.name} asks for a password.")
            with contextlib.closing(devices.link(camera, keys)) as link:
                seen = _asked(OscClient(link, clock, token), camera)
            if keep and keys is not None and camera.needs_password:
                devices.passwords().set(keys.user, keys.password)
            return seen, keys

        self._busy = "Asking the camera…"
        self._services.runner.submit(
            "camera-state",
            work,
            done=lambda answer: self._told(camera, *answer),
            failed=lambda error: self._refused(camera, error),
            cancelled=lambda: self._given_up("camera-state", self._note),
        )
        self._changed()

    def _told(self, camera: FoundCamera, seen: CameraSeen, keys: Credentials | None) -> None:
        self._busy = self._missing = self._password_error = ""
        if keys is not None:
            self._keys[_account(camera)] = keys
        self._open = self._open and not self._asks
        self._asks = False
        model = self._services.model
        if model.camera is not None and same_camera(model.camera.found, camera):
            model.update(camera=replace(seen, busy=model.camera.busy))
        self._changed()

    def _refused(self, camera: FoundCamera, error: Exception) -> None:
        self._busy = ""
        if isinstance(error, PasswordNeeded):
            again = self._keys.pop(_account(camera), None) is not None
            self._asks = self._open = True
            self._missing = "It asks for a password."
            self._password_error = error.message if again else ""
        else:
            self._missing = getattr(error, "message", str(error))
        self._changed()


def _asked(client: OscClient, camera: FoundCamera) -> CameraSeen:
    """Ask a camera who and how it is; what it does not tell is left out."""
    info = client.info()
    with contextlib.suppress(DeviceError):
        client.use_api_2()
    state = client.state()
    free: int | None = None
    with contextlib.suppress(DeviceError):
        stated = client.get_options(["remainingSpace"]).get("remainingSpace")
        if isinstance(stated, (int, float)) and not isinstance(stated, bool) and stated >= 0:
            free = int(stated)
    name = " ".join(text for text in (info.model, info.serial_number) if text) or camera.name
    found = replace(camera, name=name, model=info.model, serial=info.serial_number)
    return CameraSeen(found, state.battery_level, free)


def _short(seen: CameraSeen) -> str:
    return camera_second(seen).partition(", ")[2].replace("battery ", "")


def _row(camera: FoundCamera) -> CameraRow:
    second = camera.endpoint.host
    if camera.used_last:
        second = f"{second}, last"
    if camera.needs_password:
        second = f"{second}, password"
    return CameraRow(_key(camera), camera.name, second)


def _key(camera: FoundCamera) -> str:
    return camera.endpoint.base


def _account(camera: FoundCamera) -> str:
    return camera.serial or camera.endpoint.base
