"""The files of a simulated camera."""

from __future__ import annotations

import base64
import threading
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Final

from app.devices.simulated.exchange import CommandRefused

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from app.devices.simulated.camera import SimulatedCamera
    from app.devices.simulated.exchange import JsonValue
    from app.devices.simulated.personality import Personality
    from app.devices.simulated.scene import Take


_FORM: Final = "%Y:%m:%d %H:%M:%S"
_START: Final = datetime(2026, 6, 21, 12, 0, 0)


class CameraDate:
    """Local time with an offset that is only ever repeated.

    `now`: the clock's reading at which the date begins, in seconds.
    """

    def __init__(self, now: float, year: int | None = None) -> None:
        self._base = _START if year is None else datetime(year, 1, 1)
        self._since = now
        self._offset = "+02:00" if year is None else "+00:00"
        self.unset = year is not None

    def set(self, text: str, now: float) -> None:
        """Set date and time.

        Raises `ValueError` for a day or an hour that there is none of.
        """
        self._base = datetime.strptime(text[:19], _FORM)
        self._since = now
        self._offset = text[19:] or self._offset
        self.unset = False

    def stamp(self, now: float) -> str:
        """Local time as EXIF writes it."""
        return (self._base + timedelta(seconds=now - self._since)).strftime(_FORM)

    def text(self, now: float) -> str:
        """Local time with its offset, as options and file lists have it."""
        return self.stamp(now) + self._offset

    @property
    def offset(self) -> str:
        """Offset from UTC, "+02:00"."""
        return self._offset


_BYTES_PER_PICTURE = 5_000_000
_PATHS = ("info", "state", "checkForUpdates", "commands/execute", "commands/status")


def info_of(camera: SimulatedCamera) -> dict[str, JsonValue]:
    """Say what the camera is."""
    person = camera.personality
    info: dict[str, JsonValue] = {
        "manufacturer": person.manufacturer,
        "model": person.model,
        "serialNumber": person.serial,
        "firmwareVersion": person.firmware,
        "supportUrl": "https://example.com/support/",
        "gps": person.camera.lens_words == 1,
        "gyro": not person.switches_api,
        "uptime": int(camera.clock.now() - camera.started) + 30,
        "api": [f"/osc/{path}" for path in _PATHS],
        "endpoints": {"httpPort": camera.port, "httpUpdatesPort": camera.port},
        "apiLevel": list(person.api_levels),
    }
    if person.ricoh and not person.switches_api:
        info["_wlanMacAddress"] = "58:38:79:00:00:01"
        info["_bluetoothMacAddress"] = "58:38:79:00:00:02"
    return info


def state_of(camera: SimulatedCamera) -> dict[str, JsonValue]:
    """Say how the camera does."""
    person = camera.personality
    if camera.api_version == 1:
        return _old_state(camera)
    folder = person.folder.rpartition("/")[0]
    state: dict[str, JsonValue] = {
        "batteryLevel": camera.trouble.battery(camera.battery),
        "storageUri": f"http://{camera.host}/files/{folder + '/' if folder else ''}",
    }
    if person.ricoh:
        state |= _ricoh_state(camera)
        if person.camera.lens_words == 1:
            state |= {"_batteryInsert": True, "_currentStorage": "IN"}
            state |= {"_currentMicrophone": "Internal", "_storageID": STORAGE_ID}
        if person.name in {"X", "X-old", "A1", "Z1"}:
            state["_boardTemp"] = camera.trouble.temperature()
    elif person.insta:
        state["_cardState"] = "pass"
    return state


def _ricoh_state(camera: SimulatedCamera) -> dict[str, JsonValue]:
    job = camera.shooter.job
    latest = camera.storage.files[-1:]
    state: dict[str, JsonValue] = {
        "_apiVersion": camera.api_version,
        "_batteryState": "disconnect",
        "_captureStatus": _capture_status(camera),
        "_latestFileUrl": camera.trouble.poisoned_url(camera.url(latest[0])) if latest else "",
        "_recordedTime": 0,
        "_recordableTime": 0,
    }
    if camera.personality.camera.lens_words > 1:
        state["_compositeShootingElapsedTime"] = 0
    if not camera.personality.switches_api:
        under_way = job is not None and not job.done
        state["_capturedPictures"] = len(job.written) if job is not None and under_way else 0
        state["_cameraError"] = list(camera.trouble.errors(camera))
        state["_function"] = camera.options.get("_function", "normal")
    if camera.personality.digest:
        state |= {"_pluginRunning": False, "_pluginWebServer": True, "_mySettingChanged": False}
    return state


def _old_state(camera: SimulatedCamera) -> dict[str, JsonValue]:
    latest = camera.storage.files[-1:]
    return {
        "sessionId": camera.session or "SID_0000",
        "batteryLevel": camera.trouble.battery(camera.battery),
        "storageChanged": False,
        "_captureStatus": _capture_status(camera),
        "_recordedTime": 0,
        "_recordableTime": 0,
        "_compositeShootingElapsedTime": 0,
        "_latestFileUri": latest[0].path.removeprefix("/files/") if latest else "",
        "_batteryState": "disconnect",
        "_apiVersion": 1,
    }


def _capture_status(camera: SimulatedCamera) -> str:
    job = camera.shooter.job
    return "idle" if job is None else job.status(camera.clock.now())


def live_options(camera: SimulatedCamera) -> dict[str, JsonValue]:
    """Give the options that nobody sets: the date and what is left of the storage."""
    free = camera.trouble.free_bytes(camera)
    return {
        "dateTimeZone": camera.date.text(camera.clock.now()),
        "remainingSpace": free,
        "remainingPictures": free // _BYTES_PER_PICTURE,
        "remainingVideoSeconds": free // 7_000_000,
        "totalSpace": 14_000_000_000,
    }


TOTAL_BYTES: Final = 14_000_000_000
STORAGE_ID: Final = "5ca1ab1e0ddba11c0ffee0000b0bb1e0"
_MOST_DELETED: Final = 128


class StoredFile:
    """A file that the camera has written.

    Its bytes are made when somebody first asks for them, and then kept.

    `shape`: rows and columns.
    """

    def __init__(
        self,
        name: str,
        path: str,
        taken: str,
        shape: tuple[int, int],
        group: str,
        render: Callable[[], bytes],
        thumb: Callable[[], bytes],
        take: Take | None = None,
    ) -> None:
        self.name = name
        self.path = path
        self.taken = taken
        self.shape = shape
        self.group = group
        self.take = take
        self._makers = {"file": render, "thumb": thumb}
        self._made: dict[str, bytes] = {}
        self._lock = threading.Lock()

    @property
    def data(self) -> bytes:
        """The whole file."""
        return self._get("file")

    @property
    def thumb(self) -> bytes:
        """Its thumbnail, a JPEG file."""
        return self._get("thumb")

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return len(self.data)

    def _get(self, which: str) -> bytes:
        with self._lock:
            if which not in self._made:
                self._made[which] = self._makers[which]()
            return self._made[which]


class Storage:
    """All files, oldest first."""

    def __init__(self, person: Personality) -> None:
        self._person = person
        self.files: list[StoredFile] = []
        self.count = 0

    def next_name(self) -> tuple[str, str]:
        """Give the next file its name and path; a number is never used twice."""
        self.count += 1
        name = f"{self._person.stem}{self.count:04d}.JPG"
        return name, f"/files/{self._person.folder}/{name}"

    def add(self, file: StoredFile) -> None:
        """Store a file."""
        self.files.append(file)

    def find(self, path: str) -> StoredFile | None:
        """Find a file by the path of its URL, without the query."""
        return next((file for file in self.files if file.path == path), None)

    @property
    def free_bytes(self) -> int:
        """Roughly what is left; every file counts as 4 MB, so that none must be made for it."""
        return TOTAL_BYTES - 4_000_000 * len(self.files)

    def delete(self, urls: Sequence[JsonValue]) -> None:
        """Delete files, all or none.

        `urls`: URLs of files, or one of "all", "image", "video". Raises `CommandRefused`:
        invalidParameterValue for one that is not there, too many, or a wrong type.
        """
        if list(urls) in (["all"], ["image"]):
            self.files.clear()
            return
        if list(urls) == ["video"]:
            return
        if not 1 <= len(urls) <= _MOST_DELETED:
            raise CommandRefused("invalidParameterValue")
        doomed = []
        for url in urls:
            file = self.find("/" + url.partition("://")[2].partition("/")[2]) if (
                isinstance(url, str)
            ) else None  # fmt: skip
            if file is None:
                raise CommandRefused("invalidParameterValue", "There is no such file.")
            doomed.append(file)
        self.files[:] = [file for file in self.files if file not in doomed]

    def entry(
        self, file: StoredFile, url: str, *, detail: bool, thumb_size: int
    ) -> dict[str, JsonValue]:
        """Describe a file as camera.listFiles does."""
        entry: dict[str, JsonValue] = {
            "name": file.name,
            "fileUrl": url,
            "size": file.size,
            "isProcessed": True,
            "previewUrl": "",
        }
        if not detail:
            entry["dateTime"] = file.taken[:19]
            return entry
        rows, columns = file.shape
        entry |= {"dateTimeZone": file.taken, "width": columns, "height": rows}
        if self._person.ricoh:
            entry["_thumbSize"] = len(file.thumb)
            if not self._person.switches_api:
                entry["_projectionType"] = "Equirectangular"
            if self._person.camera.lens_words == 1:
                entry |= {"_favorite": False, "_imageDescription": "", "_uploaded": False}
                entry["_storageID"] = STORAGE_ID
            if file.group:
                entry["_autoBracketGroupId"] = file.group
        if thumb_size:
            entry["thumbnail"] = base64.b64encode(file.thumb).decode()
        return entry
