"""What is tried again, what is not, for how long, and how frames are found again."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, cast

import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.capture.reconnection import (
    NOT_NOW,
    PATIENCE_S,
    RECONNECTED,
    REJOIN_S,
    Contact,
    find_frames,
    newest_address,
    shooting_order,
)
from app.devices.clock import VirtualClock
from app.devices.errors import (
    BadReply,
    CameraNotReady,
    CameraRefused,
    DeviceError,
    NotACamera,
    PasswordNeeded,
    Unreachable,
)
from app.devices.theta.messages import FileEntry, Info, State

LOST = Unreachable("gone")


class Client:
    """Answers what it is given; errors are raised."""

    def __init__(self, hello: list[object] | None = None, *, old: bool = False) -> None:
        self.hello = hello or []
        self.serial = "1"
        self.old = old
        self.uptime_s: float | None = None
        self.switched = 0
        self.files: list[FileEntry] = []
        self.options: dict[str, Any] = {}

    def info(self) -> Info:
        if self.hello:
            answer = self.hello.pop(0)
            if isinstance(answer, Exception):
                raise answer
        return Info(
            "RICOH THETA S", serial_number=self.serial, api_level=(1, 2), uptime_s=self.uptime_s
        )

    def state(self) -> State:
        return State(api_version=1 if self.old else 2)

    def use_api_2(self) -> bool:
        self.switched += 1
        return True

    def get_options(self, names: tuple[str, ...]) -> dict[str, Any]:
        return {name: self.options[name] for name in names}

    def list_files(self, count: int) -> tuple[FileEntry, ...]:
        return tuple(self.files[:count])


def quiet(message: str, left_s: float | None, *, seeking: bool = False) -> None:
    """Show nothing."""
    del message, left_s, seeking


def contact(client: Client, token: Token | None = None) -> Contact:
    """A camera that has answered before."""
    hello, client.hello = client.hello, []
    made = Contact(cast("Any", client), VirtualClock(), token or Token(), quiet)
    made.hello()
    made.losses = client.switched = 0
    client.hello = hello
    return made


def script(*answers: object) -> Callable[[], object]:
    left = list(answers)

    def call() -> object:
        answer = left.pop(0) if len(left) > 1 else left[0]
        if isinstance(answer, Exception):
            raise answer
        return answer

    return call


def refused(code: str, status: int = 400) -> CameraRefused:
    return CameraRefused("No.", "", code, status)


def test_a_lost_question_is_put_again_after_reconnecting() -> None:
    client = Client([LOST, NotACamera("router"), BadReply("garbage")])
    camera = contact(client)
    assert camera.ask(script(LOST, 7)) == 7
    assert camera.losses == 0


@pytest.mark.parametrize(
    "loss", [LOST, BadReply("?"), PasswordNeeded("Who?"), NotACamera("router")]
)
def test_a_single_loss_after_the_first_contact_is_not_the_end(loss: DeviceError) -> None:
    assert contact(Client()).ask(script(loss, loss, 7)) == 7


def test_an_old_api_a_restart_and_a_forgetful_camera_are_noticed() -> None:
    client = Client(old=True)
    camera = contact(client)
    camera.ask(script(LOST, 7))
    assert (camera.losses, client.switched) == (1, 1)
    client = Client()
    client.uptime_s = 1000.0
    camera = contact(client)
    camera.ask(script(LOST, 7))
    assert camera.losses == 0
    client.uptime_s = 3.0
    camera.clock.sleep(20.0)
    camera.ask(script(LOST, 7))
    assert camera.losses == 1
    camera.forgets = True
    camera.ask(script(LOST, 7))
    assert camera.losses == 2


def test_a_forgetful_camera_that_states_its_settings_has_not_forgotten() -> None:
    client = Client()
    camera = contact(client)
    camera.forgets = True
    client.options = {"exposureProgram": 1, "sleepDelay": 65535, "iso": 0}
    camera.note_settings({"exposureProgram": 2, "iso": 100})
    camera.note_settings({"exposureProgram": 1, "sleepDelay": 65535})
    camera.ask(script(LOST, LOST, 7))
    assert camera.losses == 0
    client.options["exposureProgram"] = 2
    camera.ask(script(LOST, 7))
    assert camera.losses == 1
    camera.ask(script(LOST, 7))  # Nothing is known to have been set since.
    assert camera.losses == 2


def test_the_first_contact_gets_several_tries_but_a_router_is_said_soon() -> None:
    router = NotACamera("router")

    def first(*hello: object) -> Contact:
        client = cast("Any", Client(list(hello)))
        return Contact(client, VirtualClock(), Token(), quiet)

    assert first(router, PasswordNeeded("Who?"), LOST, router, BadReply("?")).meet().model
    camera = first(*[router] * 9)
    with pytest.raises(NotACamera):
        camera.meet()
    assert camera.clock.now() < 3.0
    camera = first(*[LOST] * 1000)
    with pytest.raises(Unreachable):
        camera.meet()
    assert camera.clock.now() <= 61.0


def test_the_search_is_counted_down() -> None:
    camera = contact(Client([LOST] * 20))
    said: list[tuple[str, float | None, bool]] = []
    camera.say = lambda words, left, *, seeking=False: said.append((words, left, seeking))
    camera.ask(script(LOST, 7))
    left = [seconds for _, seconds, seeking in said if seeking and seconds is not None]
    assert left == sorted(left, reverse=True)
    assert max(a - b for a, b in itertools.pairwise(left)) <= 1.0 + 1e-6
    assert 170.0 < left[0] < 180.0
    assert said[-1] == (RECONNECTED, None, False)


def test_a_camera_that_stays_away_is_given_up_after_three_minutes() -> None:
    client = Client([LOST] * 1000)
    camera = contact(client)
    with pytest.raises(Unreachable, match="lost") as caught:
        camera.ask(script(LOST))
    assert "Wi-Fi" in caught.value.hint
    assert REJOIN_S - 5.0 < camera.clock.now() <= REJOIN_S + 1.0
    # Whoever has waited in vain does not wait again.
    with pytest.raises(Unreachable):
        camera.ask(script(LOST))
    assert camera.clock.now() <= REJOIN_S + 2.0


def test_all_waiting_together_is_bounded() -> None:
    client = Client()
    camera = contact(client)
    for _ in range(50):
        client.hello = [LOST] * 16
        try:
            camera.reconnect()
        except Unreachable:
            continue
    assert camera.clock.now() <= PATIENCE_S + REJOIN_S


def test_a_link_that_breaks_every_time_ends() -> None:
    camera = contact(Client())
    with pytest.raises(Unreachable):
        camera.ask(script(LOST))
    assert camera.clock.now() < 10.0


def test_starting_is_never_repeated_after_silence() -> None:
    client = Client()
    camera = contact(client)
    with pytest.raises(Unreachable):
        camera.once(script(LOST, 7))


@pytest.mark.parametrize(
    "busy", [refused("serviceUnavailable", 503), refused("unexpected", 200), refused("x", 503)]
)
def test_a_busy_camera_is_asked_again(busy: CameraRefused) -> None:
    assert contact(Client()).once(script(busy, busy, busy, 7)) == 7


def test_a_camera_that_stays_busy_is_given_up() -> None:
    camera = contact(Client())
    with pytest.raises(CameraRefused):
        camera.ask(script(refused("serviceUnavailable", 503)))
    assert 20.0 < camera.clock.now() <= 30.5


def test_not_now_passes_only_where_it_may() -> None:
    not_now = refused("disabledCommand", 403)
    assert contact(Client()).once(script(not_now, 7), NOT_NOW) == 7
    with pytest.raises(CameraRefused):
        contact(Client()).once(script(not_now, 7))
    camera = contact(Client())
    with pytest.raises(CameraRefused):
        camera.once(script(not_now), NOT_NOW)
    assert camera.clock.now() <= 8.5


def test_what_never_passes_is_raised_at_once() -> None:
    camera = contact(Client())
    with pytest.raises(CameraRefused):
        camera.ask(script(refused("invalidParameterValue"), 7))
    assert camera.clock.now() == 0.0


def test_garbled_replies_are_asked_for_eight_times() -> None:
    bad = BadReply("?")
    assert contact(Client()).ask(script(*[bad] * 7, 7)) == 7
    with pytest.raises(BadReply):
        contact(Client()).ask(script(*[bad] * 8, 7))


def test_another_camera_is_not_taken_for_this_one() -> None:
    client = Client()
    camera = contact(client)
    camera.serial = "2"
    with pytest.raises(CameraNotReady, match="A different camera"):
        camera.reconnect()


def test_a_password_ends_the_search() -> None:
    with pytest.raises(PasswordNeeded):
        contact(Client([PasswordNeeded("Who?")] * 3)).reconnect()


def test_cancelling_ends_every_wait() -> None:
    token = Token()
    client = Client([LOST] * 1000)
    camera = contact(client, token)
    camera.say = lambda words, left, *, seeking=False: token.cancel()
    with pytest.raises(Cancelled):
        camera.ask(script(LOST))
    assert camera.clock.now() < 10.0


def test_what_must_be_done_at_the_end_cannot_be_cancelled() -> None:
    token = Token()
    token.cancel()
    last = contact(Client(), token).unstoppable(5.0)
    assert last.ask(script(refused("serviceUnavailable", 503), 7)) == 7


def test_an_old_api_that_does_not_go_away_ends() -> None:
    camera = contact(Client(old=True))
    old = refused("unknownCommand")
    assert camera.once(script(old, old, 7)) == 7
    with pytest.raises(CameraRefused):
        camera.once(script(old, old, old, 7))


def entry(number: int, folder: int = 100, group: str | None = None) -> FileEntry:
    name = f"R{number:07d}.JPG"
    url = f"http://192.168.1.1/files/ab/{folder}RICOH/{name}"
    return FileEntry(name, url, 10, "2026:01:02 03:04:05", group)


def found(client: Client, wanted: int, **how: Any) -> list[int]:
    return [int(each.name[1:8]) for each in find_frames(contact(client), wanted, **how)]


def test_frames_are_found_by_their_addresses() -> None:
    client = Client()
    client.files = [entry(n) for n in (9, 8, 7, 6, 5)]
    assert found(client, 3, urls=[entry(n).url for n in (7, 6, 8)]) == [6, 7, 8]


def test_frames_are_found_by_their_group() -> None:
    client = Client()
    client.files = [entry(9), entry(8, group="b"), entry(7, group="b"), entry(6, group="a")]
    assert found(client, 3, previous=entry(6).url) == [7, 8]
    assert found(client, 3, group_id="a", previous=entry(5).url) == [6]


def test_frames_are_found_by_what_is_newer() -> None:
    client = Client()
    client.files = [entry(n) for n in (9, 8, 7, 6, 5)]
    assert found(client, 3, previous=entry(6).url) == [7, 8, 9]
    assert found(client, 3, previous=entry(9).url) == []
    assert found(client, 5, previous="") == [5, 6, 7, 8, 9]


def test_frames_are_found_at_another_address_of_the_camera() -> None:
    client = Client()
    client.files = [entry(n) for n in (9, 8, 7, 6, 5)]
    old = [entry(n).url.replace("192.168.1.1", "10.0.0.7:8080") for n in range(10)]
    assert found(client, 5, previous=old[6]) == [7, 8, 9]
    assert found(client, 2, urls=[old[7], old[8]]) == [7, 8]
    assert newest_address(client.files, old[7]) == old[7]
    client.files = [entry(n) for n in (9, 8, 5)]
    assert found(client, 5, previous=old[6]) == [8, 9]
    client.files = [entry(5)]
    assert found(client, 3, previous=old[6].replace("10.0.0.7", "1.0.0.7")) == []


def test_raw_files_and_repeated_entries_do_not_count() -> None:
    client = Client()
    raw = FileEntry("R0000009.DNG", "http://192.168.1.1/x/R0000009.DNG", 1)
    client.files = [raw, entry(8), entry(8), entry(7)]
    assert found(client, 3) == [7, 8]


def test_numbers_that_begin_anew_come_last() -> None:
    files = [entry(10001, 101), entry(19999, 100), entry(19998, 100)]
    assert [each.name for each in shooting_order(files)] == [
        "R0019998.JPG",
        "R0019999.JPG",
        "R0010001.JPG",
    ]
