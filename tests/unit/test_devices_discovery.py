"""Looking for cameras: everything at once, nothing from the network believed, time bounded."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.clock import SystemClock, VirtualClock
from app.devices.errors import (
    BadReply,
    CameraRefused,
    DeviceError,
    NotACamera,
    PasswordNeeded,
    Unreachable,
)
from app.devices.theta.announcements import Advert
from app.devices.theta.camera_identity import described, merged
from app.devices.theta.discovery import Discovery, discover, look_at
from app.devices.theta.endpoint import ACCESS_POINT, Endpoint, check_address, is_near
from app.devices.theta.last_camera import remember
from app.devices.theta.link import Link
from app.devices.theta.messages import Info
from app.devices.theta.reply import Timeouts
from tests.faulty_camera.server import FaultyServer
from tests.helpers.camera_adapter import CameraAdapter
from tests.helpers.simulated import Talker
from tests.helpers.waiting import PATIENCE_S

Answer = dict[str, Any] | Exception


def theta(model: str = "Z1", serial: str = "10010104") -> dict[str, Any]:
    return {
        "manufacturer": "RICOH",
        "model": f"RICOH THETA {model}",
        "serialNumber": serial,
        "firmwareVersion": "3.10.2",
        "apiLevel": [2],
    }


class Net:
    """Links into an imaginary network: host -> answer, or what to do."""

    def __init__(self, **hosts: Answer | list[Answer]) -> None:
        self.hosts: dict[str, Answer | list[Answer]] = {}
        self.asked: list[str] = []
        self.open = 0

    def at(self, host: str, *answers: Answer) -> Net:
        self.hosts[host] = list(answers)
        return self

    def __call__(self, endpoint: Endpoint) -> Wire:
        self.asked.append(endpoint.host)
        self.open += 1
        return Wire(self, endpoint)


class Wire:
    def __init__(self, net: Net, endpoint: Endpoint) -> None:
        self.net, self.host = net, endpoint.host

    def get(self, path: str) -> Any:
        assert path == "/osc/info"
        answers = self.net.hosts.get(self.host)
        if not answers:
            raise Unreachable("No answer.")
        assert isinstance(answers, list)
        answer = answers.pop(0) if len(answers) > 1 else answers[0]
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        self.net.open -= 1


def adverts(*heard: Advert) -> Callable[[Callable[[Advert], None], threading.Event], None]:
    """A browser that hears these, in its own thread, and then nothing more."""

    def browse(found: Callable[[Advert], None], stop: threading.Event) -> None:
        del stop
        for advert in heard:
            found(advert)

    return browse


silence = adverts()


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def search(net: Net, *heard: Advert, timeout_s: float = 3.0, **more: Any) -> Discovery:
    clock = VirtualClock()
    return discover(clock, timeout_s, link_factory=net, browse=adverts(*heard), **more)


def test_a_camera_in_its_own_wifi() -> None:
    net = Net().at("192.168.1.1", theta())
    result = search(net)
    assert result.notes == ()
    (camera,) = result.cameras
    assert camera.endpoint == ACCESS_POINT
    assert (camera.model, camera.serial, camera.source) == (
        "RICOH THETA Z1",
        "10010104",
        "access point",
    )
    assert not camera.needs_password
    assert camera.name == "RICOH THETA Z1 10010104"
    assert camera.user == "THETAYN10010104"
    assert net.open == 0
    assert result.one() is camera


def test_nothing_found_says_what_to_do_next() -> None:
    result = search(Net())
    assert result == Discovery()
    with pytest.raises(Unreachable, match=r"No camera was found\. Switch on the camera’s Wi-Fi"):
        result.one()


@pytest.mark.parametrize(
    "answer",
    [
        NotACamera("Something answers, but no camera."),
        PasswordNeeded("A router wants one too."),
        {"model": "MegaRouter 3000"},  # JSON without anything of the protocol
        {"apiLevel": [2], "firmwareVersion": "1.0"},
        [],
    ],
)
def test_a_router_in_place_of_the_camera_is_said_and_not_offered(answer: Any) -> None:
    result = search(Net().at("192.168.1.1", answer))
    assert result.cameras == ()
    (note,) = result.notes
    assert "probably your router" in note
    with pytest.raises(Unreachable, match="probably your router"):
        result.one()


def test_nobody_hears_of_the_router_at_home_when_there_is_a_camera() -> None:
    net = Net().at("192.168.1.1", NotACamera("A router.")).at("192.168.1.77", theta())
    result = search(net, Advert("THETAYN10010104", ("192.168.1.77",), 80))
    assert [camera.source for camera in result.cameras] == ["network"]
    assert result.notes == ()


def test_a_camera_that_is_busy_is_asked_again_until_the_time_is_over() -> None:
    busy = CameraRefused("Busy.", "Wait.", "serviceUnavailable", 503)
    net = Net().at("192.168.1.1", busy, busy, theta())
    assert search(net).cameras[0].serial == "10010104"

    result = search(Net().at("192.168.1.1", busy))
    assert result.cameras == ()
    assert result.notes == (f"At 192.168.1.1: {busy}",)


def test_the_announced_name_gives_the_user_name_before_the_password() -> None:
    net = Net().at("10.0.0.9", PasswordNeeded("Needs a password."))
    result = search(net, Advert("THETAYL00105377", ("10.0.0.9",), 80))
    (camera,) = result.cameras
    assert camera.needs_password
    assert camera.user == "THETAYL00105377"
    assert (camera.model, camera.serial) == ("RICOH THETA V", "00105377")
    assert camera.endpoint == Endpoint("10.0.0.9")


def test_several_cameras_are_kept_and_none_is_chosen() -> None:
    net = Net().at("10.0.0.8", theta("V", "00105377")).at("10.0.0.9", theta("X", "10200301"))
    result = search(
        net,
        Advert("THETAYL00105377", ("10.0.0.8",), 80),
        Advert("THETAYR10200301", ("10.0.0.9",), 80),
    )
    assert {camera.serial for camera in result.cameras} == {"00105377", "10200301"}
    with pytest.raises(DeviceError, match="Several cameras") as caught:
        result.one()
    assert caught.value.code == "several-cameras"
    assert "http://10.0.0.8" in str(caught.value)


def test_of_several_cameras_the_last_used_one_is_chosen_wherever_it_is_now() -> None:
    old = described(Endpoint("10.0.0.50"), "network", Info("RICOH THETA X", "10200301"))
    remember(old)
    net = Net().at("10.0.0.8", theta("V", "00105377")).at("10.0.0.9", theta("X", "10200301"))
    result = search(
        net,
        Advert("THETAYL00105377", ("10.0.0.8",), 80),
        Advert("THETAYR10200301", ("10.0.0.9",), 80),
    )
    assert result.one().endpoint == Endpoint("10.0.0.9")
    assert "10.0.0.50" in net.asked


def test_one_camera_at_two_addresses_is_one_camera() -> None:
    net = Net().at("192.168.1.1", theta()).at("10.0.0.9", theta())
    result = search(net, Advert("THETAYN10010104", ("10.0.0.9",), 80))
    (camera,) = result.cameras
    assert camera.endpoint == ACCESS_POINT
    assert camera.user == "THETAYN10010104"


def test_an_address_that_needs_no_password_is_nearer() -> None:
    here = described(Endpoint("10.0.0.9"), "network", Info("RICOH THETA Z1", "10010104"))
    shut = described(Endpoint("10.0.0.8"), "remembered", None, "THETAYN10010104")
    (camera,) = merged([shut, here])
    assert camera.endpoint == Endpoint("10.0.0.9")
    assert not camera.needs_password


def test_equal_digits_of_different_models_are_two_cameras() -> None:
    one = described(Endpoint("10.0.0.9"), "network", Info("RICOH THETA Z1", "00105377"))
    two = described(Endpoint("10.0.0.8"), "network", Info("RICOH THETA V", "00105377"))
    assert len(merged([one, two])) == 2


def test_the_remembered_camera_is_asked_and_needs_its_password_again() -> None:
    remember(described(Endpoint("10.0.0.9"), "network", Info("RICOH THETA V", "00105377")))
    result = search(Net().at("10.0.0.9", PasswordNeeded("A password.")))
    (camera,) = result.cameras
    assert (camera.source, camera.needs_password) == ("remembered", True)
    assert camera.user == "THETAYL00105377"
    assert camera.used_last


def test_the_access_point_is_asked_once_where_it_was_used_last() -> None:
    remember(described(ACCESS_POINT, "access point", Info("RICOH THETA V", "00105377")))
    net = Net().at("192.168.1.1", theta("V", "00105377"))
    assert len(search(net).cameras) == 1
    assert net.asked == ["192.168.1.1"]
    # A router that asks for a password there is no camera, though one was there before.
    assert search(Net().at("192.168.1.1", PasswordNeeded("Admin?"))).cameras == ()


def test_another_camera_at_the_same_address_is_not_the_last_one() -> None:
    remember(described(ACCESS_POINT, "access point", Info("RICOH THETA V", "00105377")))
    (camera,) = search(Net().at("192.168.1.1", theta("V", "00999999"))).cameras
    assert not camera.used_last


@pytest.mark.parametrize(
    "advert",
    [
        Advert("THETAYL00105377", ("8.8.8.8",), 80),
        Advert("THETAYL00105377", ("::ffff:8.8.8.8",), 80),
        Advert("THETAYL00105377", ("224.0.0.1",), 80),
        Advert("THETAYL00105377", ("0.0.0.0",), 80),
        Advert("THETAYL00105377", ("evil.example",), 80),
        Advert("THETAYL00105377", ("10.0.0.9/../x",), 80),
        Advert("THETAYL00105377", ("10.0.0.9",), 0),
        Advert("THETAYL00105377", ("10.0.0.9",), 70000),
        Advert("THETAYL00105377", (), 80),
    ],
)
def test_announced_addresses_outside_the_own_network_are_never_asked(advert: Advert) -> None:
    net = Net()
    assert search(net, advert).cameras == ()
    assert net.asked == ["192.168.1.1"]


def test_hostile_names_from_the_network_are_cleaned_and_cut() -> None:
    name = "THETA\x1b[31m\n\u202eevil" + "x" * 5000
    net = Net().at("10.0.0.9", theta("\x07" + "Q" * 5000, "1\r\n2" + "3" * 500))
    (camera,) = search(net, Advert(name, ("10.0.0.9",), 80)).cameras
    for text in (camera.name, camera.model, camera.serial, camera.user):
        assert text.isprintable()
        assert len(text) <= 130
    net = Net().at("10.0.0.9", PasswordNeeded("?"))
    (camera,) = search(net, Advert(name, ("10.0.0.9",), 80)).cameras
    assert camera.name.isprintable()
    assert len(camera.name) <= 64
    assert camera.user == ""


def test_an_announced_name_that_contradicts_the_camera_gives_no_user_name() -> None:
    net = Net().at("10.0.0.9", theta("V", "00105377"))
    (camera,) = search(net, Advert("THETAYL99999999", ("10.0.0.9",), 80)).cameras
    assert camera.serial == "00105377"
    assert camera.user == "THETAYL00105377"


def test_a_flood_of_announcements_is_bounded() -> None:
    net = Net()
    heard = [Advert(f"cam{k}", (f"10.0.{k // 250}.{k % 250 + 1}",), 80) for k in range(3000)]
    assert search(net, *heard).cameras == ()
    assert len(net.asked) <= 16


def test_ipv6_is_asked_only_where_there_is_nothing_else() -> None:
    net = Net().at("10.0.0.9", theta())
    search(net, Advert("a", ("10.0.0.9", "fe80::1%eth0"), 80), Advert("b", ("fe80::2%eth0",), 80))
    assert sorted(net.asked) == ["10.0.0.9", "192.168.1.1", "fe80::2%eth0"]


def test_a_deaf_network_is_said() -> None:
    deaf = Unreachable("No network.", "Type it.", "no-mdns")

    def browse(found: object, stop: object) -> None:
        raise deaf

    net = Net().at("192.168.1.1", theta())
    result = discover(VirtualClock(), link_factory=net, browse=browse)
    assert len(result.cameras) == 1
    assert result.notes == (str(deaf),)


def test_addresses_that_swallow_everything_cost_bounded_time() -> None:
    overdue: list[str] = []
    release = threading.Event()

    class Hole:
        def get(self, path: str) -> Any:
            if not release.wait(PATIENCE_S):
                overdue.append(path)
            raise Unreachable("Too late.")

        def close(self) -> None:
            pass

    def links(endpoint: Endpoint) -> Any:
        return Wire(net, endpoint) if endpoint.host == "10.0.0.9" else Hole()

    net = Net().at("10.0.0.9", theta())
    net.open = 1
    heard = [Advert("THETAYN10010104", ("10.0.0.9",), 80)]
    heard += [Advert(f"hole{k}", (f"10.0.1.{k}",), 80) for k in range(1, 9)]
    try:
        result = discover(SystemClock(), 0.3, link_factory=links, browse=adverts(*heard))
        assert not overdue
        assert [camera.serial for camera in result.cameras] == ["10010104"]
    finally:
        release.set()
        _join("turnlight-discovery")


def test_cancelling_is_felt_at_once_and_ends_the_browser() -> None:
    token, ended = Token(), threading.Event()

    def browse(found: object, stop: threading.Event) -> None:
        token.cancel()
        if stop.wait(PATIENCE_S):
            ended.set()

    with pytest.raises(Cancelled):
        discover(SystemClock(), 10 * PATIENCE_S, token=token, link_factory=Net(), browse=browse)
    assert ended.wait(PATIENCE_S)
    _join("turnlight-discovery")


def test_the_search_ends_on_the_clock_while_the_network_is_listened_to() -> None:
    clock = VirtualClock()

    def browse(found: Callable[[Advert], None], stop: threading.Event) -> None:
        clock.sleep(3.0)
        assert stop.wait(PATIENCE_S)

    result = discover(clock, 3.0, link_factory=Net().at("192.168.1.1", theta()), browse=browse)
    assert len(result.cameras) <= 1
    assert clock.now() < 5.0
    _join("turnlight-discovery")


def test_real_links_ask_an_address_and_give_up_in_time() -> None:
    # A socket that accepts and never answers.
    with socket.create_server(("127.0.0.1", 0)) as server:
        host, port = server.getsockname()[:2]
        with pytest.raises(Unreachable):
            look_at(Endpoint(host, port), SystemClock(), timeout_s=0.3)
    with pytest.raises(Unreachable):
        look_at(Endpoint(host, port), SystemClock(), timeout_s=0.3)


def test_looking_at_a_typed_address() -> None:
    net = Net().at("10.0.0.9", theta("V", "00105377"))
    camera = look_at(Endpoint("10.0.0.9"), VirtualClock(), link_factory=net)
    assert (camera.source, camera.serial) == ("typed", "00105377")
    net.at("10.0.0.9", PasswordNeeded("?"))
    camera = look_at(Endpoint("10.0.0.9"), VirtualClock(), link_factory=net)
    assert camera.needs_password
    assert (camera.model, camera.user, camera.name) == ("", "", "10.0.0.9")
    remember(described(Endpoint("10.0.0.9"), "network", Info("RICOH THETA V", "00105377")))
    camera = look_at(Endpoint("10.0.0.9"), VirtualClock(), link_factory=net)
    assert (camera.source, camera.user) == ("typed", "THETAYL00105377")
    net.at("10.0.0.9", NotACamera("A web page."))
    with pytest.raises(NotACamera):
        look_at(Endpoint("10.0.0.9"), VirtualClock(), link_factory=net)
    assert net.open == 0


@pytest.mark.parametrize(
    ("text", "base"),
    [
        ("192.168.1.1", "http://192.168.1.1"),
        (" http://cam.local:8080/ ", "http://cam.local:8080"),
        ("8.8.8.8", "http://8.8.8.8"),  # the user asked for it
        ("[::1]:8000", "http://[::1]:8000"),
        ("localhost", "http://localhost"),
    ],
)
def test_typed_addresses(text: str, base: str) -> None:
    assert check_address(text).base == base


@pytest.mark.parametrize(
    "text", ["", "https://192.168.1.1", "0.0.0.0", "239.1.2.3", "255.255.255.255", "[ff02::1]"]
)
def test_typed_addresses_that_no_camera_can_have(text: str) -> None:
    with pytest.raises(DeviceError) as caught:
        check_address(text)
    assert caught.value.code == "bad-address"


@pytest.mark.parametrize(
    ("host", "near"),
    [
        ("192.168.1.1", True),
        ("172.31.0.1", True),
        ("172.32.0.1", False),
        ("169.254.3.4", True),
        ("127.0.0.1", True),
        ("fe80::1%eth0", True),
        ("fd00::2", True),
        ("2001:db8::1", False),
        ("100.64.0.1", False),
        ("camera.local", False),
    ],
)
def test_near_addresses(host: str, near: bool) -> None:
    assert is_near(host) is near


# --- with the simulated camera ---


def lodged(model: str, **options: Any) -> tuple[VirtualClock, Callable[[Endpoint], Link]]:
    """Links of which every address leads to one simulated camera."""
    talker = Talker(model, **options)

    def links(endpoint: Endpoint) -> Link:
        adapter = CameraAdapter(talker.camera)
        limits = Timeouts(connect_s=2.5, read_s=3.0, whole_s=3.0)
        return Link(endpoint, talker.clock, adapter=adapter, timeouts=limits)

    return talker.clock, links


@pytest.mark.parametrize("model", ["S", "SC", "SC2", "V", "V-old", "Z1", "X", "A1", "generic"])
def test_every_model_is_found(model: str) -> None:
    clock, links = lodged(model)
    (camera,) = discover(clock, 3.0, link_factory=links, browse=silence).cameras
    assert camera.model
    assert not camera.needs_password


@pytest.mark.parametrize("seed", range(3))
def test_a_simulated_router_is_named(seed: int) -> None:
    clock, links = lodged("V", faults=["404-router-in-place-of-the-camera"], seed=seed)
    result = discover(clock, 3.0, link_factory=links, browse=silence)
    assert result.cameras == ()
    assert "probably your router" in result.notes[0]


@pytest.mark.parametrize(
    "fault", ["endless-response", "wrong-content-length", "503-bursts", "error-in-a-200", "sleep"]
)
@pytest.mark.parametrize("seed", range(3))
def test_troubles_of_the_camera_end_in_time(fault: str, seed: int) -> None:
    clock, links = lodged("Z1", faults=[fault], seed=seed)
    start = clock.now()
    result = discover(clock, 3.0, link_factory=links, browse=silence)
    assert len(result.cameras) <= 1
    assert all(note.isprintable() for note in result.notes)
    assert clock.now() - start < 30.0
    _join("turnlight-discovery")


def test_a_camera_in_client_mode_is_found_over_a_real_connection() -> None:
    talker = Talker("Z1", user="THETAYN10010104", password="10010104")
    with FaultyServer(talker.camera, 0, clock=SystemClock()) as server:
        advert = Advert("THETAYN10010104", ("127.0.0.1",), server.port)

        def links(endpoint: Endpoint) -> Any:
            if endpoint == ACCESS_POINT:
                return Wire(Net(), endpoint)
            return Link(endpoint, SystemClock(), timeouts=Timeouts(connect_s=2.0, read_s=2.0))

        result = discover(SystemClock(), 3.0, link_factory=links, browse=adverts(advert))
        (camera,) = result.cameras
        assert camera.needs_password
        assert camera.user == "THETAYN10010104"
        assert look_at(camera.endpoint, SystemClock()).needs_password


def _join(name: str) -> None:
    for thread in threading.enumerate():
        if thread.name == name:
            thread.join(PATIENCE_S)


class Flaky:
    """An address that answers wrongly at first."""

    def __init__(self, *answers: object) -> None:
        self.answers = list(answers)

    def get(self, path: str) -> Any:
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        pass


@pytest.mark.parametrize(
    "loss", [Unreachable("Lost."), NotACamera("A page."), PasswordNeeded("Who?"), BadReply("?")]
)
def test_a_single_loss_at_a_typed_address_is_not_the_end(loss: DeviceError) -> None:
    said = {"model": "RICOH THETA V", "serialNumber": "1", "firmwareVersion": "3.82.1"}
    link: Any = Flaky(loss, said)
    found = look_at(Endpoint("192.168.1.1"), VirtualClock(), link_factory=lambda _: link)
    assert (found.model, found.needs_password) == ("RICOH THETA V", False)
    gone: Any = Flaky(*[Unreachable("Gone.")] * 3)
    with pytest.raises(Unreachable):
        look_at(Endpoint("192.168.1.1"), VirtualClock(), link_factory=lambda _: gone)
    assert len(gone.answers) == 1  # Silence is waited for twice.
