"""What is announced in the network: cameras in client mode, by multicast DNS.

A Ricoh Theta that has joined a network announces itself as "THETA" and its serial number under
``_osc._tcp.local.``, without further facts. Anybody in the network can announce anything, so names
and addresses are only hints here; whoever uses them asks at the address what is there.
"""

from __future__ import annotations

import socket
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from app.devices.errors import Unreachable

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence

    from zeroconf import Zeroconf

SERVICE: Final = "_osc._tcp.local."
"""Type under which cameras of this kind announce themselves."""

_MOST: Final = 32
_LONGEST: Final = 255
_STEP_S: Final = 0.1
_ASK_MS: Final = 400


@dataclass(frozen=True, slots=True)
class Advert:
    """One announcement, as it came."""

    name: str
    addresses: tuple[str, ...]
    port: int


def browse_network(
    found: Callable[[Advert], None],
    stop: threading.Event,
    *,
    interfaces: Sequence[str] | None = None,
) -> None:
    """Listen to announcements until told to stop; blocks.

    Parameters
    ----------
    stop : threading.Event
        Ends it, within half a second.

    Raises
    ------
    Unreachable
        When this machine cannot listen: no network, or another program or a firewall forbids it.
        The code is "no-mdns".
    """
    # Takes a quarter of a second and is needed only here.
    from zeroconf import Error, InterfaceChoice, ServiceBrowser, Zeroconf

    names: SimpleQueue[str] = SimpleQueue()

    def heard(service_type: str, name: str, **_: Any) -> None:
        if len(name) <= _LONGEST and name.endswith(f".{service_type}"):
            names.put(name)

    try:
        network = Zeroconf(interfaces=list(interfaces) if interfaces else InterfaceChoice.All)
    except (OSError, Error, RuntimeError, ValueError) as error:
        raise _deaf(error) from error
    try:
        ServiceBrowser(network, SERVICE, handlers=[heard])
        _resolve(network, names, found, stop)
    except (OSError, Error) as error:
        raise _deaf(error) from error
    finally:
        network.close()


def _resolve(
    network: Zeroconf,
    names: SimpleQueue[str],
    found: Callable[[Advert], None],
    stop: threading.Event,
) -> None:
    """Find out the addresses behind the names that are heard."""
    from zeroconf import BadTypeInNameException, ServiceInfo

    waiting: dict[str, None] = {}
    known: set[str] = set()
    while not stop.wait(_STEP_S):
        for name in _taken(names):
            if name not in known and len(known) < _MOST:
                known.add(name)
                waiting[name] = None
        for name in tuple(waiting):
            try:
                info = ServiceInfo(SERVICE, name)
                resolved = info.load_from_cache(network) or info.request(network, _ASK_MS)
            except BadTypeInNameException:
                del waiting[name]
                continue
            if resolved and info.port:
                del waiting[name]
                addresses = sorted(info.parsed_scoped_addresses(), key=lambda text: ":" in text)
                label = name.removesuffix(f".{SERVICE}")
                found(Advert(label, tuple(addresses), int(info.port)))
            if stop.is_set():
                return


def _taken(names: SimpleQueue[str]) -> list[str]:
    taken: list[str] = []
    while len(taken) < _MOST:
        try:
            taken.append(names.get_nowait())
        except Empty:
            break
    return taken


def _deaf(error: BaseException) -> Unreachable:
    reason = error.strerror if isinstance(error, OSError) else str(error)
    words = f": {reason.lower()}" if reason and not isinstance(error, socket.gaierror) else ""
    return Unreachable(
        f"The network cannot be searched for cameras{words}.",
        "Type the camera's address instead.",
        "no-mdns",
    )
