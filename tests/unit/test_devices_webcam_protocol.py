"""A webcam's thread on virtual time: it opens again by itself, and says what is wrong."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from app.devices.clock import Clock, SystemClock, VirtualClock
from app.devices.errors import DeviceError
from app.devices.webcam import WebcamError, WebcamState
from app.devices.webcam.protocol import LOST_S, WEBCAM, Manner, Webcam
from tests.helpers.waiting import PATIENCE_S, until

Bytes = NDArray[np.uint8]


def picture(seed: int) -> Bytes:
    return np.random.default_rng(seed).integers(0, 256, (48, 64, 3), np.uint8)


class Script:
    """A source that plays a list: pictures, None, errors, functions; then it waits for the end."""

    def __init__(self, clock: VirtualClock, *plays: list[object], every_s: float = 0.04) -> None:
        self.clock = clock
        self.plays = [list(play) for play in plays]
        self.every_s = every_s
        self.opened: list[float] = []
        self.closed = 0
        self.done = threading.Event()
        self.go_on = threading.Event()
        self.now: list[object] = []

    def open(self) -> None:
        self.opened.append(self.clock.now())
        self.now = self.plays.pop(0) if self.plays else [self.end]
        if self.now and isinstance(self.now[0], WebcamError):
            raise self.now.pop(0)  # type: ignore[misc]

    def read(self) -> Bytes | None:
        self.clock.sleep(self.every_s)
        what = self.now.pop(0) if self.now else self.end
        if isinstance(what, WebcamError):
            raise what
        if callable(what):
            what()
            return None
        assert what is None or isinstance(what, np.ndarray)
        return what

    def end(self) -> None:
        self.done.set()
        self.go_on.wait(PATIENCE_S)

    def close(self) -> None:
        self.closed += 1


class Played(Webcam):
    """A webcam that a script plays."""

    def __init__(
        self,
        script: Script,
        clock: Clock,
        manner: Manner = WEBCAM,
        cut: threading.Event | None = None,
    ) -> None:
        super().__init__("Trial", None, clock, manner)
        self.script = script
        self.was_cut = threading.Event()

    def connect(self) -> None:
        self.script.open()

    def read(self) -> Bytes | None:
        return self.script.read()

    def disconnect(self) -> None:
        self.script.close()

    def cut(self) -> None:
        self.was_cut.set()


def played(script: Script, *, still: bool = False) -> Webcam:
    """Open a webcam and wait until its script is over."""
    webcam = Played(script, script.clock, replace(WEBCAM, still=still))
    webcam.open()
    assert script.done.wait(PATIENCE_S)
    return webcam


def finish(webcam: Webcam, script: Script) -> None:
    script.go_on.set()
    webcam.close(PATIENCE_S)
    assert webcam.state is WebcamState.OFF
    assert script.closed >= len(script.opened)


def state_of(webcam: Webcam) -> WebcamState:
    return webcam.state


def gone() -> WebcamError:
    return WebcamError("Webcam disconnected.", "Plug it in.", "unplugged")


def test_the_newest_picture_is_at_hand() -> None:
    clock = VirtualClock()
    script = Script(clock, [picture(n) for n in range(60)])
    webcam = played(script)
    assert webcam.state is WebcamState.LIVE
    assert webcam.count == 60
    assert webcam.error is None
    assert webcam.fps == pytest.approx(25.0, abs=1.0)
    frame = webcam.frames.get()
    assert frame is not None
    assert frame.number == 59
    np.testing.assert_array_equal(frame.picture, picture(59))
    assert not frame.picture.flags.writeable
    finish(webcam, script)


def test_unplugged_and_back_by_itself() -> None:
    clock = VirtualClock()
    states: list[tuple[WebcamState, str]] = []

    def look() -> None:
        error = webcam.error
        states.append((webcam.state, error.code if error else ""))

    class Watched(Script):
        def open(self) -> None:
            look()
            super().open()

    script = Watched(clock, [picture(0), picture(1), gone()], [gone()], [gone()], [picture(2)])
    webcam = Played(script, clock)
    webcam.open()
    assert script.done.wait(PATIENCE_S)
    assert states == [
        (WebcamState.CONNECTING, ""),
        (WebcamState.RETRYING, "unplugged"),
        (WebcamState.RETRYING, "unplugged"),
        (WebcamState.RETRYING, "unplugged"),
    ]
    assert webcam.state is WebcamState.LIVE
    assert webcam.error is None
    assert webcam.count == 3
    pauses = np.diff(script.opened)
    assert 0.4 < pauses[0] < 0.8
    assert pauses[1] > pauses[0]
    assert pauses.max() < 2.5
    finish(webcam, script)


def test_just_lost_is_lost_and_not_retrying() -> None:
    clock = VirtualClock()
    seen: list[WebcamState] = []

    class Pausing(VirtualClock):
        def sleep(self, seconds: float) -> None:
            seen.append(webcam.state)
            super().sleep(seconds)

    clock = Pausing()
    script = Script(clock, [picture(0), gone()])
    webcam = Played(script, clock)
    webcam.open()
    assert script.done.wait(PATIENCE_S)
    order = [state for place, state in enumerate(seen) if place == 0 or seen[place - 1] != state]
    assert order == [
        WebcamState.CONNECTING,
        WebcamState.LIVE,
        WebcamState.LOST,
        WebcamState.RETRYING,
    ]
    finish(webcam, script)


def test_never_there() -> None:
    clock = VirtualClock()
    missing = WebcamError("None.", "Plug one in.", "no-webcam")
    script = Script(clock, [missing], [missing], [missing])
    webcam = played(script)
    assert webcam.state is WebcamState.RETRYING
    assert webcam.count == 0
    assert webcam.error is missing
    finish(webcam, script)


def test_silence_is_noticed_and_the_device_opened_again() -> None:
    clock = VirtualClock()
    script = Script(clock, [picture(0), *[None] * 200], [picture(1)])
    webcam = played(script)
    assert len(script.opened) == 2
    assert script.opened[1] > LOST_S
    assert webcam.state is WebcamState.LIVE
    finish(webcam, script)


def test_a_read_that_hangs_counts_as_lost() -> None:
    clock = VirtualClock()
    script = Script(clock, [picture(0)])
    webcam = played(script)
    script.plays.clear()
    assert state_of(webcam) is WebcamState.LIVE
    clock.sleep(LOST_S + 0.1)
    assert state_of(webcam) is WebcamState.LOST
    error = webcam.error
    assert error is not None
    assert error.code == "silent"
    # Closing does not wait for it, and what it still brings is dropped.
    webcam.close(0.05)
    assert state_of(webcam) is WebcamState.OFF
    script.now = [picture(9)]
    script.go_on.set()
    until(lambda: script.closed == 1)
    webcam.frames.get()
    assert webcam.count == 1


@pytest.mark.parametrize(
    ("plays", "every_s", "code"),
    [
        ([np.full((48, 64, 3), 5, np.uint8)] * 5, 0.04, "black"),
        ([picture(3)] * 150, 0.04, "frozen"),
        ([picture(n) for n in range(12)], 0.5, "slow"),
    ],
)
def test_pictures_of_no_use_are_said_to_be(plays: list[object], every_s: float, code: str) -> None:
    clock = VirtualClock()
    script = Script(clock, [p.copy() for p in plays if isinstance(p, np.ndarray)], every_s=every_s)
    webcam = played(script)
    assert webcam.state is WebcamState.LIVE
    error = webcam.error
    assert error is not None
    assert error.code == code
    assert error.hint
    finish(webcam, script)


def test_it_is_mended_when_pictures_are() -> None:
    clock = VirtualClock()
    script = Script(clock, [np.zeros((48, 64, 3), np.uint8), picture(1)])
    webcam = played(script)
    assert webcam.error is None
    finish(webcam, script)


def test_a_still_picture_may_be_meant() -> None:
    clock = VirtualClock()
    script = Script(clock, [picture(3) for _ in range(150)])
    webcam = played(script, still=True)
    assert webcam.error is None
    finish(webcam, script)


def test_open_and_close_any_number_of_times() -> None:
    clock = SystemClock()
    script = Script(VirtualClock())
    webcam = Played(script, clock)
    webcam.close()
    script.go_on.set()
    for _ in range(3):
        webcam.open()
        webcam.open()
        webcam.close(PATIENCE_S)
        webcam.close()
    assert webcam.state is WebcamState.OFF
    assert script.closed == len(script.opened) <= 3


def test_errors_are_device_errors() -> None:
    assert isinstance(gone(), DeviceError)
    assert gone().code == "unplugged"
    assert WebcamError("Something.").code == "webcam"


def test_a_manner_of_its_own() -> None:
    """Words and pauses of another kind of source; and a read that is cut off by closing."""
    clock = VirtualClock()
    manner = Manner("folder", "Choose another.", "Wait.", (1.0, 4.0, 9.0), still=True)
    missing = WebcamError("Not there.", "Wait.", "no-file")
    script = Script(clock, [missing], [missing], [missing], [picture(0), *[None] * 200])
    webcam = Played(script, clock, manner)
    assert webcam.fov_deg is None
    webcam.open()
    assert script.done.wait(PATIENCE_S)
    np.testing.assert_allclose(np.diff(script.opened[:4]), [4.0, 9.0, 9.0], atol=0.2)
    error = webcam.error
    assert error is not None
    assert error.code == "silent"
    assert manner.noun in error.message
    assert error.hint.startswith(f"{manner.revive} ")
    finish(webcam, script)
    assert webcam.was_cut.is_set()


def test_a_wrong_password_is_not_tried_again() -> None:
    clock = VirtualClock()
    wrong = WebcamError("Wrong.", "Type another.", "password-refused")
    script = Script(clock, [wrong], [wrong])
    webcam = Played(script, clock)
    webcam.open()
    until(lambda: webcam.error is wrong)
    until(lambda: not any(t.name == "webcam" for t in threading.enumerate()))
    assert state_of(webcam) is WebcamState.RETRYING
    assert len(script.opened) == 1
    webcam.open()
    until(lambda: len(script.opened) == 2)
    webcam.close(PATIENCE_S)
