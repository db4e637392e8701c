"""A server whose connections break, and which sends wrong lengths as they are."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from typing import Final

from app.devices.simulated.exchange import Piece, Reply
from app.devices.simulated.server import CameraHandler, CameraServer
from tests.faulty_camera.silence import Drop

_LINGER: Final = struct.pack("ii", 1, 0)  # closing resets the connection


class _Dropped(Exception):
    """The connection is reset here."""


class FaultyHandler(CameraHandler):
    """One connection, which a `Drop` or a reply with status 0 resets."""

    def play(self, reply: Reply, pieces: Iterator[Piece]) -> None:
        if reply.status == 0:
            self._reset()
            return
        try:
            super().play(reply, self._until_drop(pieces, reply))
        except _Dropped:
            self._reset()

    def _reset(self) -> None:
        self.close_connection = True
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER)

    def _until_drop(self, pieces: Iterator[Piece], reply: Reply) -> Iterator[Piece]:
        """Pass pieces on; close the connection after a body that does not have its length."""
        length = next((v for n, v in reply.headers if n.lower() == "content-length"), None)
        count = 0
        for piece in pieces:
            if isinstance(piece, Drop):
                yield b""  # The head is sent before the first piece.
                raise _Dropped
            count += len(piece) if isinstance(piece, bytes) else 0
            yield piece
        if length is not None and length != str(count):
            self.close_connection = True


class FaultyServer(CameraServer):
    """Serves a faulty camera."""

    handler = FaultyHandler
