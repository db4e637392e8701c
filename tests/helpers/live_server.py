"""A network camera of the tests' own on loopback: it answers each connection as it was told."""

from __future__ import annotations

import contextlib
import socket
import ssl
import threading
import time
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from app.devices.simulated.exposure_maker import jpeg

__all__ = ["Answer", "LiveServer", "head", "jpegs", "part", "stream"]

Answer: TypeAlias = Callable[[socket.socket, bytes], None]
"""Gets the connection and the request; it is closed when this returns."""

BOUNDARY = b"frame0boundary"


class LiveServer:
    """Serves until it is closed.

    Args:
        *answers: One for each connection; the last for all further ones.
        context: Encrypts.
    """

    def __init__(self, *answers: Answer, context: ssl.SSLContext | None = None) -> None:
        self._context = context
        self._answers = list(answers)
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._socket.settimeout(0.05)
        self._threads: list[threading.Thread] = []
        self._open: list[socket.socket] = []
        self.ending = threading.Event()
        self.requests: list[bytes] = []
        self.port = int(self._socket.getsockname()[1])
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def __enter__(self) -> LiveServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def url(self, path: str = "/video", scheme: str = "http") -> str:
        return f"{scheme}://127.0.0.1:{self.port}{path}"

    def close(self) -> None:
        self.ending.set()
        self._listener.join(120.0)
        self._socket.close()
        self.drop()
        for thread in self._threads:
            thread.join(120.0)

    def drop(self) -> None:
        """Break every connection, as a phone that leaves the Wi-Fi."""
        for connection in self._open:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _listen(self) -> None:
        while not self.ending.is_set():
            try:
                connection, _ = self._socket.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            connection.settimeout(10.0)
            self._open.append(connection)
            answer = self._answers.pop(0) if len(self._answers) > 1 else self._answers[0]
            thread = threading.Thread(target=self._serve, args=(connection, answer), daemon=True)
            self._threads.append(thread)
            thread.start()

    def _serve(self, connection: socket.socket, answer: Answer) -> None:
        with contextlib.suppress(OSError), self._wrapped(connection) as connection:
            request = b""
            while b"\r\n\r\n" not in request and not request.startswith(b"\x16"):
                data = connection.recv(4096)
                if not data:
                    return
                request += data
            self.requests.append(request)
            answer(connection, request)

    def _wrapped(self, connection: socket.socket) -> socket.socket:
        if self._context is None:
            return connection
        return self._context.wrap_socket(connection, server_side=True)

    def wait(self, seconds: float) -> bool:
        """Wait; whether it is to end meanwhile."""
        return self.ending.wait(seconds)


def jpegs(count: int, shape: tuple[int, int] = (48, 64)) -> list[bytes]:
    """Give different pictures."""
    return [
        jpeg(np.random.default_rng(n).integers(30, 256, (*shape, 3), np.uint8))
        for n in range(count)
    ]


def head(status: str = "200 OK", kind: str = "", **more: str) -> bytes:
    """Give the head of an answer."""
    kind = kind or f"multipart/x-mixed-replace; boundary={BOUNDARY.decode()}"
    lines = [f"HTTP/1.1 {status}", f"Content-Type: {kind}"]
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in more.items()]
    return ("\r\n".join(lines) + "\r\n\r\n").encode()


def part(data: bytes) -> bytes:
    """Give one picture of a stream."""
    size = str(len(data)).encode()
    return b"--" + BOUNDARY + b"\r\nContent-Length: " + size + b"\r\n\r\n" + data + b"\r\n"


def stream(pictures: list[bytes], every_s: float = 0.01, count: int = 100_000) -> Answer:
    """Answer with a stream of pictures."""

    def answer(connection: socket.socket, _request: bytes) -> None:
        connection.sendall(head())
        for number in range(count):
            connection.sendall(part(pictures[number % len(pictures)]))
            time.sleep(every_s)

    return answer
