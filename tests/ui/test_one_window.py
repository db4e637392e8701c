"""What the window takes from a later start: only what is whole, small and has the key."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtNetwork import QLocalSocket
from pytestqt.qtbot import QtBot

from app.core.storage.data_lock import Owner, lock_window
from app.ui.shell.one_window import ADDRESS, WindowServer


class Opened:
    def __init__(self, home: Path) -> None:
        self.paths: list[list[Path]] = []
        self.server = WindowServer(home, self.paths.append)
        facts = json.loads((home / ADDRESS).read_text())
        self.name, self.key = facts["name"], facts["key"]

    def send(self, qtbot: QtBot, message: bytes) -> bytes:
        socket = QLocalSocket()
        socket.connectToServer(self.name)
        socket.write(message)
        gone = QLocalSocket.LocalSocketState.UnconnectedState
        qtbot.waitUntil(lambda: socket.state() == gone)
        return bytes(socket.readAll().data())


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Opened]:
    one = Opened(tmp_path)
    yield one
    one.server.close()
    assert not (tmp_path / ADDRESS).exists()


def test_files_come_with_the_key(qtbot: QtBot, opened: Opened, tmp_path: Path) -> None:
    paths = [str(tmp_path / "caf\udce9.exr"), "relative.exr", "/a\0b"]
    message = json.dumps({"key": opened.key, "paths": paths}).encode()
    assert opened.send(qtbot, message + b"\n") == b"shown\n"
    assert opened.paths == [[tmp_path / "caf\udce9.exr"]]


@pytest.mark.parametrize(
    "message",
    [
        b"\n",
        b"{}\n",
        b"[" * 100_000 + b"\n",
        b'{"key": "KEY"}\n',
        b'{"key": "KEY", "paths": "/etc"}\n',
        b'{"key": "KEY", "paths": [1]}\n',
        b'{"key": "wrong", "paths": []}\n',
        b'{"key": "\xc3\xa9", "paths": []}\n',
        b'{"key": null, "paths": []}\n',
        b"\xff\xfe\n",
        b"x" * (1 << 19),
    ],
)
def test_anything_else_is_dropped(qtbot: QtBot, opened: Opened, message: bytes) -> None:
    assert opened.send(qtbot, message.replace(b"KEY", opened.key.encode())) == b""
    assert opened.paths == []


def test_a_data_folder_has_one_window(tmp_path: Path) -> None:
    first = lock_window(tmp_path)
    assert first.owner is Owner.US
    assert lock_window(tmp_path).owner is Owner.ANOTHER_PROCESS
    first.release()
    again = lock_window(tmp_path)
    assert again.owner is Owner.US
    again.release()


def test_a_folder_that_takes_no_lock_is_used_without(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert lock_window(tmp_path / "file" / "home").owner is Owner.NOBODY
