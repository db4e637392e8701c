"""A small RTSP camera for tests: one client, JPEG over RTP (RFC 2435) within the connection.

It can stand still for a while, or for ever, in the middle of its pictures.
"""

from __future__ import annotations

import contextlib
import re
import socket
import struct
import threading
import time
from typing import Self

import cv2
import numpy as np

_SDP = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=-\r\nt=0 0\r\nm=video 0 RTP/AVP 26\r\na=control:1\r\n"
_RATE = 20


class RtspServer:
    """Serves one connection after the other; more than one at a time is refused.

    Args:
        stalls: Seconds for which it stands still after its 30th picture.
    """

    def __init__(self, stalls: float = 0.0) -> None:
        self.played = self.sent = 0
        self._stalls = stalls
        self._stop = threading.Event()
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._socket.settimeout(0.1)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        port = self._socket.getsockname()[1]
        self.url = f"rtsp://127.0.0.1:{port}/live"

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *args: object) -> None:
        self._stop.set()
        self._thread.join()
        self._socket.close()

    def _serve(self) -> None:
        while not self._stop.is_set():
            with contextlib.suppress(OSError):
                connection, _ = self._socket.accept()
                with connection:
                    connection.settimeout(5.0)
                    self._talk(connection)

    def _talk(self, connection: socket.socket) -> None:
        heard = b""
        while not self._stop.is_set():
            while b"\r\n\r\n" not in heard:
                data = connection.recv(4096)
                if not data:
                    return
                heard += data
            head, _, heard = heard.partition(b"\r\n\r\n")
            verb = head.partition(b" ")[0].decode()
            found = re.search(rb"CSeq: *(\d+)", head, re.IGNORECASE)
            number = found[1].decode() if found else "0"
            lines, body = [f"RTSP/1.0 200 OK\r\nCSeq: {number}"], ""
            if verb == "OPTIONS":
                lines.append("Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN")
            elif verb == "DESCRIBE":
                body = _SDP
                lines += ["Content-Type: application/sdp", f"Content-Length: {len(body)}"]
            elif verb == "SETUP":
                lines += ["Transport: RTP/AVP/TCP;unicast;interleaved=0-1", "Session: 1"]
            elif verb == "PLAY":
                lines.append("Session: 1")
            connection.sendall(("\r\n".join(lines) + "\r\n\r\n" + body).encode())
            if verb == "PLAY":
                self.played += 1
                self._play(connection)
                return

    def _play(self, connection: socket.socket) -> None:
        sequence = 0
        for number in range(100_000):
            if number == 30:
                self._stop.wait(self._stalls)
            if self._stop.is_set():
                return
            for packet in _packets(number, sequence):
                connection.sendall(b"$\x00" + struct.pack(">H", len(packet)) + packet)
                sequence += 1
            self.sent += 1
            time.sleep(1.0 / _RATE)


def _packets(number: int, sequence: int) -> list[bytes]:
    """Cut a picture into RTP packets."""
    picture = np.random.default_rng(number).integers(60, 200, (8, 10, 3), np.uint8)
    large = cv2.resize(picture, (160, 128), interpolation=cv2.INTER_LINEAR)
    data = cv2.imencode(".jpg", large)[1].tobytes()
    tables = b"".join(_segments(data, 0xDB))
    tables = b"".join(tables[k + 1 : k + 65] for k in (0, 65))
    start = data.index(b"\xff\xda")
    scan = data[start + 2 + int.from_bytes(data[start + 2 : start + 4], "big") :]
    packets: list[bytes] = []
    for offset in range(0, len(scan), 1200):
        piece, last = scan[offset : offset + 1200], offset + 1200 >= len(scan)
        kind = 26 | (128 if last else 0)
        head = struct.pack(
            ">BBHII", 128, kind, (sequence + len(packets)) & 0xFFFF, number * 4500, 7
        )
        head += struct.pack(">I", offset) + bytes((1, 255, 160 // 8, 128 // 8))
        if offset == 0:
            head += struct.pack(">BBH", 0, 0, 128) + tables
        packets.append(head + piece)
    return packets


def _segments(data: bytes, marker: int) -> list[bytes]:
    """Contents of all segments of a kind before the scan."""
    place, found = 2, []
    while data[place + 1] != 0xDA:
        length = int.from_bytes(data[place + 2 : place + 4], "big")
        if data[place + 1] == marker:
            found.append(data[place + 4 : place + 2 + length])
        place += 2 + length
    return found
