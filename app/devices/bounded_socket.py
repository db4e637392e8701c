"""Connections whose deadline holds however slowly a camera sends.

The timeouts of `requests` restart with every byte, even inside a header, so a camera that sends
only a trickle could hold up its client for hours. Here every read from the socket has a deadline on
the injected clock, and another thread can end the read.
"""

from __future__ import annotations

import socket
import ssl
import time
from collections.abc import Callable
from typing import Any, Final

from requests.adapters import HTTPAdapter
from urllib3 import HTTPConnectionPool, PoolManager
from urllib3.connection import HTTPConnection
from urllib3.util.wait import wait_for_read

from app.devices.clock import Clock

_STEP_S: Final = 0.1  # seconds of real time until a closed stream ends


class Watch:
    """A deadline for a connection.

    The deadline expires on `clock` or in real time, whichever comes first, since a virtual clock
    does not advance while a real connection is slow.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._deadline = self._real_deadline = 0.0
        self._closed = False

    def allow(self, seconds: float) -> None:
        """Set the deadline to `seconds` from now."""
        self._deadline = self._clock.now() + seconds
        self._real_deadline = time.monotonic() + seconds

    def close(self) -> None:
        """End the current wait and all later ones. This may be called from any thread."""
        self._closed = True

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    @property
    def late(self) -> bool:
        """Whether the deadline has passed."""
        return self._clock.now() > self._deadline or time.monotonic() > self._real_deadline

    def wait_for(self, connection: socket.socket, silence_s: float | None) -> None:
        """Wait until there is something to read.

        Args:
            silence_s: Timeout in seconds, or None if the deadline is the only limit.

        Raises:
            ConnectionAbortedError: If the watch is closed.
            TimeoutError: After the deadline or the timeout.
        """
        start, real_start = self._clock.now(), time.monotonic()
        while True:
            if self._closed:
                raise ConnectionAbortedError("closed by its reader")
            if wait_for_read(connection, timeout=0.0):
                break
            silent = max(self._clock.now() - start, time.monotonic() - real_start)
            if self.late or (silence_s is not None and silent > silence_s):
                raise TimeoutError("silent for too long")
            if wait_for_read(connection, timeout=_STEP_S):
                break
        if self.late:
            raise TimeoutError("the deadline has passed")


class BoundedSocket(socket.socket):
    """A connected socket with a `Watch`.

    Args:
        patient: Whether to ignore the socket's own timeout.
    """

    watch: Watch | None = None
    patient = False

    def __init__(self, plain: socket.socket) -> None:
        limit = plain.gettimeout()
        super().__init__(plain.family, plain.type, plain.proto, fileno=plain.detach())
        self.settimeout(limit)

    def recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
        """Read bytes, waiting for them if necessary."""
        return _receive(self, lambda: super(BoundedSocket, self).recv_into(buffer, nbytes, flags))


class BoundedTls(ssl.SSLSocket):
    """An encrypted socket with a `Watch`, for use as the `sslsocket_class` of an SSL context."""

    watch: Watch | None = None
    patient = False

    def recv_into(self, buffer: Any, nbytes: int | None = None, flags: int = 0) -> int:
        """Read bytes, waiting for them if necessary."""
        return _receive(self, lambda: super(BoundedTls, self).recv_into(buffer, nbytes, flags))


def _receive(connection: BoundedSocket | BoundedTls, receive: Callable[[], int]) -> int:
    watch = connection.watch
    while watch is not None:
        if not pending(connection):
            watch.wait_for(connection, None if connection.patient else connection.gettimeout())
        elif watch.closed or watch.late:
            raise TimeoutError("the deadline has passed")
        try:
            return receive()
        except (TimeoutError, ssl.SSLWantReadError):
            # Only part of an encrypted record has arrived; the rest may take until the deadline.
            continue
    return receive()


def pending(connection: socket.socket) -> bool:
    """Return whether received bytes are waiting to be decrypted."""
    return isinstance(connection, ssl.SSLSocket) and connection.pending() > 0


class WatchedAdapter(HTTPAdapter):
    """Sends requests, without retries, over kept-alive connections that have a `Watch`."""

    def __init__(self) -> None:
        self.watch: Watch | None = None
        super().__init__(pool_connections=1, pool_maxsize=2, max_retries=0)

    def init_poolmanager(
        self, connections: int, maxsize: int, block: bool = False, **pool_kwargs: Any
    ) -> None:
        """Create the pool of bounded connections. This is called by `requests`."""
        transport = self

        class Connection(HTTPConnection):
            def connect(self) -> None:
                super().connect()
                self.sock = BoundedSocket(self.sock)

            def request(self, *args: Any, **keywords: Any) -> None:
                super().request(*args, **keywords)
                if isinstance(self.sock, BoundedSocket):
                    self.sock.watch = transport.watch

        class Pool(HTTPConnectionPool):
            ConnectionCls = Connection

        self.poolmanager = PoolManager(
            num_pools=connections, maxsize=maxsize, block=block, **pool_kwargs
        )
        self.poolmanager.pool_classes_by_scheme = {"http": Pool}

    def close(self) -> None:
        """Close all connections immediately, whereas urllib3 would wait for every reply to end."""
        pools = self.poolmanager.pools
        for key in pools.keys():  # noqa: SIM118 - keys() is a safe copy; pools cannot be iterated
            pool = pools.get(key)
            if pool is not None:
                pool.close()
        super().close()
