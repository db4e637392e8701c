"""Cameras that announce themselves on the network through multicast DNS.

A Ricoh Theta that has joined a network announces itself as "THETA" and its serial number under
``_osc._tcp.local.``, without further data. Any device on the network can announce anything, so
names and addresses are only hints.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from app.core.text import tr
from app.devices.errors import Unreachable

if TYPE_CHECKING:
    from zeroconf import Zeroconf


SERVICE: Final = "_osc._tcp.local."
"""Service type of OSC cameras."""

_MOST_ADVERTS: Final = 32
_LONGEST_NAME: Final = 255
_TICK_S: Final = 0.1
_ASK_MS: Final = 400


@dataclass(frozen=True, slots=True)
class Advert:
    """One announcement by a camera."""

    name: str
    addresses: tuple[str, ...]
    port: int


def browse_network(
    on_advert: Callable[[Advert], None],
    stop: threading.Event,
    *,
    interfaces: Sequence[str] | None = None,
) -> None:
    """Listen for announcements, returning no later than half a second after `stop` is set.

    Raises:
        Unreachable: With the code "no-mdns" if this computer cannot listen because it has no
            network, or because another program or a firewall prevents it.
    """
    # The import takes a quarter of a second and is needed only here.
    from zeroconf import Error, InterfaceChoice, ServiceBrowser, Zeroconf

    names: SimpleQueue[str] = SimpleQueue()

    def on_service(service_type: str, name: str, **_: Any) -> None:
        if len(name) <= _LONGEST_NAME and name.endswith(f".{service_type}"):
            names.put(name)

    try:
        network = Zeroconf(interfaces=list(interfaces) if interfaces else InterfaceChoice.All)
    except (OSError, Error, RuntimeError, ValueError) as error:
        raise _deaf(error) from error
    try:
        ServiceBrowser(network, SERVICE, handlers=[on_service])
        _resolve(network, names, on_advert, stop)
    except (OSError, Error) as error:
        raise _deaf(error) from error
    finally:
        network.close()


def _resolve(
    network: Zeroconf,
    names: SimpleQueue[str],
    on_advert: Callable[[Advert], None],
    stop: threading.Event,
) -> None:
    """Look up the addresses of the announced names."""
    from zeroconf import BadTypeInNameException, ServiceInfo

    waiting: dict[str, None] = {}
    visited: set[str] = set()
    while not stop.wait(_TICK_S):
        for name in _drain(names):
            if name not in visited and len(visited) < _MOST_ADVERTS:
                visited.add(name)
                waiting[name] = None
        for name in tuple(waiting):
            try:
                info = ServiceInfo(SERVICE, name)
                is_resolved = info.load_from_cache(network) or info.request(network, _ASK_MS)
            except BadTypeInNameException:
                del waiting[name]
                continue
            if is_resolved and info.port:
                del waiting[name]
                addresses = sorted(info.parsed_scoped_addresses(), key=lambda text: ":" in text)
                label = name.removesuffix(f".{SERVICE}")
                on_advert(Advert(label, tuple(addresses), int(info.port)))
            if stop.is_set():
                return


def _drain(names: SimpleQueue[str]) -> list[str]:
    batch: list[str] = []
    while len(batch) < _MOST_ADVERTS:
        try:
            batch.append(names.get_nowait())
        except Empty:
            break
    return batch


def _deaf(error: BaseException) -> Unreachable:
    reason = error.strerror if isinstance(error, OSError) else str(error)
    return Unreachable(
        tr("The network cannot be searched for cameras: {reason}.", reason=reason.lower())
        if reason and not isinstance(error, socket.gaierror)
        else tr("The network cannot be searched for cameras."),
        tr("Type the camera’s address instead."),
        "no-mdns",
    )
