"""Allows only one window per data folder.

If the app is started a second time, its files open in the first window. That window listens on a
local socket with a random name. The name and a key are stored in a file that only the user can
read. Other users can therefore neither guess the socket nor send it requests.
"""

from __future__ import annotations

import contextlib
import hmac
import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from PySide6.QtCore import QDeadlineTimer, QObject, QThread, QTimer
from PySide6.QtNetwork import QLocalServer, QLocalSocket

from app.core.base.atomic_files import atomic_write_bytes
from app.core.base.errors import CoreError
from app.core.storage.data_lock import Owner, WindowLock, lock_window
from app.core.storage.json_file import (
    Facts,
    Unfit,
    dump,
    entries,
    listed,
    read_json,
    record,
    text,
)
from app.core.text import tr

ADDRESS: Final = "window.json"
"""Name of the file that contains the socket's name and key."""

_ADDRESS_BYTES: Final = 4096
_MESSAGE_BYTES: Final = 1 << 18
_MOST_PATHS: Final = 200
_LONGEST_PATH: Final = 4096
_MOST_CALLERS: Final = 8
_CALL_MS: Final = 5_000  # a caller that stays silent for this long is dropped
_REPLY_MS: Final = 3_000
_PATIENCE_MS: Final = 30_000  # the first window may have only just started
_AGAIN_MS: Final = 100
_REPLY: Final = b"shown\n"


@dataclass(frozen=True, slots=True)
class _Address:
    name: str
    key: str


@dataclass(frozen=True, slots=True)
class _Request:
    key: str
    paths: tuple[str, ...]


_address: Final = record(_Address, {"name": text(200, r"[\w.-]+"), "key": text(200, r"\w+")})
_request: Final = record(
    _Request, {"key": text(200), "paths": listed(text(_LONGEST_PATH), _MOST_PATHS)}
)


class WindowServer(QObject):
    """Listens for later starts of the app, and calls `show` with the files that they send.

    Any program run by the user can send messages. Messages are therefore limited in size,
    validated, and accepted only with the key.
    """

    def __init__(self, home: Path, show: Callable[[list[Path]], None]) -> None:
        super().__init__()
        self._show = show
        self._address = _Address(f"turnlight-{secrets.token_hex(16)}", secrets.token_hex(32))
        self._callers: dict[QLocalSocket, bytearray] = {}
        self._server = QLocalServer(self)
        self._server.setSocketOptions(QLocalServer.SocketOption.UserAccessOption)
        self._server.setMaxPendingConnections(_MOST_CALLERS)
        self._server.newConnection.connect(self._answer)
        former = _read_address(home)
        if former is not None:
            # A killed process leaves its socket behind.
            QLocalServer.removeServer(former.name)
        self._file = home / ADDRESS
        facts: Facts = {"name": self._address.name, "key": self._address.key}
        if self._server.listen(self._address.name):
            # Without the file, a later start reports that the window does not respond.
            with contextlib.suppress(CoreError):
                atomic_write_bytes(self._file, dump(facts))

    def close(self) -> None:
        """Stop listening."""
        for caller in tuple(self._callers):
            self._drop(caller)
        self._server.close()
        with contextlib.suppress(OSError):
            self._file.unlink()

    def _answer(self) -> None:
        while (caller := self._server.nextPendingConnection()) is not None:
            if len(self._callers) >= _MOST_CALLERS:
                caller.abort()
                caller.deleteLater()
                continue
            self._callers[caller] = bytearray()
            caller.readyRead.connect(lambda caller=caller: self._read(caller))
            caller.disconnected.connect(lambda caller=caller: self._drop(caller))
            QTimer.singleShot(_CALL_MS, caller, lambda caller=caller: self._drop(caller))
            self._read(caller)

    def _read(self, caller: QLocalSocket) -> None:
        message = self._callers.get(caller)
        if message is None:
            return
        message += caller.read(_MESSAGE_BYTES + 1 - len(message)).data()
        line, end, _ = bytes(message).partition(b"\n")
        if len(message) > _MESSAGE_BYTES or (end and not self._obey(line)):
            self._drop(caller)
        elif end:
            caller.write(_REPLY)
            caller.flush()
            caller.disconnectFromServer()

    def _obey(self, line: bytes) -> bool:
        try:
            request: _Request = _request(entries(json.loads(line)))
        except (ValueError, RecursionError):
            return False
        if not hmac.compare_digest(request.key.encode("utf-8", "replace"), self._key):
            return False
        paths = [Path(each) for each in request.paths if "\0" not in each]
        self._show([each for each in paths if each.is_absolute()])
        return True

    @property
    def _key(self) -> bytes:
        return self._address.key.encode()

    def _drop(self, caller: QLocalSocket) -> None:
        if self._callers.pop(caller, None) is not None:
            caller.abort()
            caller.deleteLater()


def enter(home: Path, paths: Sequence[Path], patience_ms: int = _PATIENCE_MS) -> WindowLock | None:
    """Claim a data folder for a new window, or pass the files to the window that is already open.

    Returns:
        The lock, or None if the open window has accepted the files and come to the front.

    Raises:
        CoreError: If another process uses the folder and does not respond.
    """
    deadline = QDeadlineTimer(patience_ms)
    while (lock := lock_window(home)).owner is Owner.ANOTHER_PROCESS:
        if _hand_over(home, paths):
            return None
        if deadline.hasExpired():
            raise CoreError(
                tr(
                    "Turnlight is already open with the data folder {home}, but its window does "
                    "not respond.",
                    home=home,
                ),
                tr("Wait a moment, or end the other process."),
            )
        QThread.msleep(_AGAIN_MS)
    return lock


def _hand_over(home: Path, paths: Sequence[Path]) -> bool:
    """Ask the open window to open these files, and return whether it has done so."""
    address = _read_address(home)
    if address is None:
        return False
    texts = [str(each.absolute()) for each in paths][:_MOST_PATHS]
    message = json.dumps({"key": address.key, "paths": texts}).encode() + b"\n"
    socket = QLocalSocket()
    socket.connectToServer(address.name)
    try:
        if not socket.waitForConnected(_REPLY_MS):
            return False
        socket.write(message)
        deadline = QDeadlineTimer(_REPLY_MS)
        while not socket.canReadLine():
            if not socket.waitForReadyRead(max(deadline.remainingTime(), 1)):
                return False
        return socket.readLine(len(_REPLY) + 1).data() == _REPLY
    finally:
        socket.abort()


def _read_address(home: Path) -> _Address | None:
    try:
        address: _Address = _address(read_json(home / ADDRESS, _ADDRESS_BYTES).facts)
    except Unfit:
        return None
    return address
