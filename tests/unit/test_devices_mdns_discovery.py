"""Announcements in the network: real ones on loopback, and hostile ones."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable

import pytest
from zeroconf import Error, ServiceInfo, Zeroconf

from app.devices.errors import Unreachable
from app.devices.theta.announcements import SERVICE, Advert, browse_network


@pytest.mark.slow
def test_real_announcements_on_this_machine() -> None:
    """A camera announced on loopback is heard; where the system forbids it, that is said."""
    name = "THETAYL00105377"
    info = ServiceInfo(
        SERVICE,
        f"{name}.{SERVICE}",
        addresses=[socket.inet_aton("127.0.0.1")],
        port=8080,
        server=f"{name}.local.",
    )
    heard: list[Advert] = []
    stop = threading.Event()

    def found(advert: Advert) -> None:
        heard.append(advert)
        if advert.name == name:
            stop.set()

    try:
        network = Zeroconf(interfaces=["127.0.0.1"])
    except (OSError, Error):
        with pytest.raises(Unreachable) as caught:
            browse_network(found, stop, interfaces=["127.0.0.1"])
        assert caught.value.code == "no-mdns"
        return
    alarm = threading.Timer(10.0, stop.set)
    alarm.start()
    try:
        network.register_service(info)
        browse_network(found, stop, interfaces=["127.0.0.1"])
    finally:
        alarm.cancel()
        network.close()
    assert Advert(name, ("127.0.0.1",), 8080) in heard


def test_a_machine_that_cannot_listen_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr("zeroconf.Zeroconf", refuse)
    with pytest.raises(Unreachable, match="operation not permitted") as caught:
        browse_network(lambda advert: None, threading.Event())
    assert caught.value.code == "no-mdns"


def test_names_of_other_kinds_and_without_end_are_not_resolved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []
    closed: list[bool] = []

    class Network:
        def close(self) -> None:
            closed.append(True)

    class Service:
        port = 80

        def __init__(self, kind: str, name: str) -> None:
            asked.append(name)

        def load_from_cache(self, network: object) -> bool:
            return True

        def parsed_scoped_addresses(self) -> list[str]:
            return ["fe80::1%2", "10.0.0.9"]

    def browser(network: object, kind: str, handlers: list[Callable[..., None]]) -> None:
        for name in ("a._http._tcp.local.", f"{'x' * 300}.{SERVICE}"):
            handlers[0](service_type=SERVICE, name=name, zeroconf=None, state_change=None)
        for k in range(200):
            handlers[0](service_type=SERVICE, name=f"t{k}.{SERVICE}", state_change=None)

    monkeypatch.setattr("zeroconf.Zeroconf", lambda **_: Network())
    monkeypatch.setattr("zeroconf.ServiceInfo", Service)
    monkeypatch.setattr("zeroconf.ServiceBrowser", browser)
    stop, heard = threading.Event(), []

    def found(advert: Advert) -> None:
        heard.append(advert)
        if len(heard) == 32:
            threading.Timer(0.3, stop.set).start()

    browse_network(found, stop)
    assert len(asked) == 32
    assert heard[0] == Advert("t0", ("10.0.0.9", "fe80::1%2"), 80)
    assert closed == [True]
    assert SERVICE == "_osc._tcp.local."
