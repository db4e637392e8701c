"""The files of a simulated camera."""

from __future__ import annotations

import base64
import threading
from typing import TYPE_CHECKING, Final

from app.devices.simulated.replies import CommandRefused

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from app.devices.simulated.personality import Personality
    from app.devices.simulated.replies import JsonValue
    from app.devices.simulated.scene import Take

TOTAL_BYTES: Final = 14_000_000_000
STORAGE_ID: Final = "5ca1ab1e0ddba11c0ffee0000b0bb1e0"
_MOST_DELETED: Final = 128


class StoredFile:
    """A file that the camera has written.

    Its bytes are made when somebody first asks for them, and then kept.

    Parameters
    ----------
    shape : tuple[int, int]
        Rows and columns.
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

        Parameters
        ----------
        urls : sequence
            URLs of files, or one of "all", "image", "video".

        Raises
        ------
        CommandRefused
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
