"""The preview: decoding of untrusted pictures, and the stream's patience."""

from __future__ import annotations

import contextlib
import itertools
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest

from app.devices.clock import VirtualClock
from app.devices.errors import BadReply, CameraRefused, DeviceError, PasswordNeeded, Unreachable
from app.devices.mailbox import Mailbox
from app.devices.simulated.exif import with_segments
from app.devices.simulated.exposure_maker import jpeg
from app.devices.theta.preview import PreviewFrame, PreviewState, PreviewStream, decode
from tests.helpers.scaled_clock import ScaledClock

RICOH = "---osclivepreview---"
SPEED = 50.0


def picture(number: int, shape: tuple[int, int] = (32, 64)) -> bytes:
    colours = np.random.default_rng(number).integers(0, 256, (*shape, 3), np.uint8)
    data = jpeg(colours)
    thumbnail = jpeg(colours[:8, :8])
    return with_segments(data, [b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2) + thumbnail])


PICTURES = [picture(number) for number in range(4)]


def part(data: bytes) -> bytes:
    head = b"---osclivepreview---\r\nContent-type: image/jpeg\r\nContent-Length: %d\r\n\r\n"
    return head % len(data) + data + b"\r\n"


class TestDecode:
    def frame(self, data: bytes) -> PreviewFrame:
        return PreviewFrame(data, 0, 0.0)

    def test_colours_and_size(self) -> None:
        colours = np.zeros((32, 64, 3), np.uint8)
        colours[..., 0] = 200
        found = decode(self.frame(jpeg(colours)))
        assert found.shape == (32, 64, 3)
        assert found.dtype == np.uint8
        assert abs(found.astype(int) - colours).max() < 4

    def test_grey_becomes_three_channels(self) -> None:
        done, data = cv2.imencode(".jpg", np.full((16, 32), 77, np.uint8))
        assert done
        assert decode(self.frame(data.tobytes())).shape == (16, 32, 3)

    @pytest.mark.parametrize("shape", [(2049, 4096), (2048, 4097), (65535, 65535)])
    def test_a_large_picture_is_refused_before_it_is_decoded(self, shape: tuple[int, int]) -> None:
        data = bytearray(PICTURES[0])
        place = data.rindex(b"\xff\xc0") + 5
        data[place : place + 4] = shape[0].to_bytes(2) + shape[1].to_bytes(2)
        with pytest.raises(BadReply, match="too large"):
            decode(self.frame(bytes(data)))

    def test_what_is_no_picture(self) -> None:
        progressive = cv2.imencode(
            ".jpg", np.zeros((16, 16, 3), np.uint8), [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]
        )[1].tobytes()
        scans = PICTURES[0].replace(b"\xff\xda", b"\xff\xda" * 20)
        for data in (b"", b"\xff\xd8\xff\xd9", b"GIF89a", bytes(5000), progressive, scans):
            with pytest.raises(BadReply):
                decode(self.frame(data))

    def test_a_cut_picture_never_fails_otherwise(self) -> None:
        for kept in range(2, len(PICTURES[0]), 37):
            with contextlib.suppress(BadReply):
                assert decode(self.frame(PICTURES[0][:kept])).shape == (32, 64, 3)

    def test_a_rotation_in_the_file_is_ignored(self) -> None:
        exif = (
            b"Exif\x00\x00MM\x00\x2a\x00\x00\x00\x08\x00\x01"
            b"\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00\x00\x00\x00\x00"
        )
        data = jpeg(np.zeros((16, 48, 3), np.uint8))
        turned = with_segments(data, [b"\xff\xe1" + (len(exif) + 2).to_bytes(2) + exif])
        assert decode(self.frame(turned)).shape == (16, 48, 3)


@dataclass
class Answer:
    """A camera's answer; `body` may raise, and may wait for `cut`."""

    body: Iterator[bytes]
    cut: threading.Event
    status: int = 200
    length: int | None = None
    headers: Mapping[str, str] = field(
        default_factory=lambda: {
            "content-type": f'multipart/x-mixed-replace; boundary="{RICOH}"',
        }
    )

    def chunks(self, size: int = 65536) -> Iterator[bytes]:
        del size
        return self.body

    def close(self) -> None:
        self.cut.set()


class Script:
    """A camera that answers one try after the other as it was told; then it refuses."""

    def __init__(self, clock: ScaledClock | VirtualClock, *answers: object) -> None:
        self.clock = clock
        self.answers = list(answers)
        self.tries: list[float] = []
        self.open = 0
        self.cut = threading.Event()

    @contextlib.contextmanager
    def preview(self) -> Iterator[Answer]:
        self.tries.append(self.clock.now())
        answer = self.answers.pop(0) if self.answers else refused()
        if isinstance(answer, DeviceError):
            raise answer
        assert callable(answer)
        self.open += 1
        try:
            yield Answer(answer(self), self.cut)
        finally:
            self.open -= 1


def refused() -> DeviceError:
    return CameraRefused("Not now.", code="disabledCommand", status=403)


def frames(count: int, *, fps: float = 30.0, last: DeviceError | None = None) -> object:
    def body(script: Script) -> Iterator[bytes]:
        for number in range(count):
            yield part(PICTURES[number % 4])
            script.clock.sleep(1.0 / fps)
        if last is not None:
            raise last

    return body


def endless(script: Script) -> Iterator[bytes]:
    for number in itertools.count():
        yield part(PICTURES[number % 4])
        script.clock.sleep(1 / 30)


def silence(script: Script) -> Iterator[bytes]:
    """Send nothing until somebody cuts the connection, as a socket does."""
    script.cut.wait(30.0)
    yield b""
    raise Unreachable("The connection was closed.")


def dribble(script: Script) -> Iterator[bytes]:
    while True:
        yield b"\x00"
        script.clock.sleep(0.5)


def stream_of(script: Script) -> tuple[PreviewStream, Mailbox[PreviewFrame]]:
    box: Mailbox[PreviewFrame] = Mailbox()
    return PreviewStream(script.preview, box, script.clock), box


def until(condition: Callable[[], bool], seconds: float = 10.0) -> bool:
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.002)
    return True


class TestStream:
    def test_pictures_arrive_and_rates_are_told(self) -> None:
        stream, box = stream_of(Script(ScaledClock(1.0), endless))
        stream.start()
        try:
            first = box.get(5.0)
            assert first is not None
            assert decode(first).shape == (32, 64, 3)
            assert until(lambda: stream.count > 35)
            assert 15.0 <= stream.fps <= 31.0
            assert stream.state is PreviewState.LIVE
            assert stream.error is None
        finally:
            stream.stop()
        assert stream.fps == 0.0
        assert not [thread for thread in threading.enumerate() if thread.name == "preview"]

    def test_off_before_and_after(self) -> None:
        script = Script(ScaledClock(SPEED), endless)
        stream, _ = stream_of(script)
        states = [stream.state]
        stream.start()
        assert until(lambda: stream.count > 0)
        stream.stop()
        assert [*states, stream.state] == [PreviewState.OFF] * 2
        script.clock.sleep(20.0)
        assert stream.state is PreviewState.OFF

    def test_numbers_go_on_over_connections(self) -> None:
        script = Script(ScaledClock(SPEED), frames(3), frames(2, last=Unreachable("x")), frames(2))
        stream, box = stream_of(script)
        stream.start()
        assert until(lambda: stream.count == 7)
        stream.stop()
        last = box.get()
        assert last is not None
        assert last.number == 6
        assert script.open == 0

    def test_after_an_end_it_asks_again_at_once(self) -> None:
        script = Script(ScaledClock(SPEED), frames(2), frames(2), endless)
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: len(script.tries) == 3)
        stream.stop()
        assert 0.1 <= script.tries[2] - script.tries[1] < 5.0

    def test_four_tries_half_a_second_apart_then_slower(self) -> None:
        script = Script(VirtualClock())
        stream, _ = stream_of(script)
        states = []

        @contextlib.contextmanager
        def watched() -> Iterator[Answer]:
            states.append(stream.state)
            with script.preview() as answer:
                yield answer

        stream = PreviewStream(watched, Mailbox(), script.clock)
        stream.start()
        assert until(lambda: len(script.tries) > 6)
        stream.stop()
        gaps = np.diff(script.tries[:7])
        assert np.allclose(gaps[:3], 0.5)
        assert np.allclose(gaps[3:], 2.0)
        assert states[:4] == [PreviewState.CONNECTING] * 4
        assert states[4] is PreviewState.LOST

    def test_refused_for_a_while_after_a_capture(self) -> None:
        script = Script(ScaledClock(SPEED), refused(), refused(), endless)
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: stream.state is PreviewState.LIVE)
        assert stream.error is None
        stream.stop()

    def test_pauses_grow_while_nobody_answers(self) -> None:
        script = Script(VirtualClock(), *[Unreachable("x") for _ in range(2000)])
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: len(script.tries) > 6)
        stream.stop()
        assert np.allclose(np.diff(script.tries[:6]), [0.5, 1.0, 2.0, 2.0, 2.0])

    def test_no_frame_for_five_seconds_is_lost(self) -> None:
        script = Script(ScaledClock(SPEED), dribble, endless)
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: isinstance(stream.error, Unreachable))
        assert stream.state is PreviewState.LOST
        assert until(lambda: stream.state is PreviewState.LIVE)
        stream.stop()
        assert 5.0 < script.tries[1] - script.tries[0] < 30.0

    def test_a_silent_connection_is_told_while_the_read_still_waits(self) -> None:
        script = Script(ScaledClock(SPEED), silence)
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: stream.state is PreviewState.LOST)
        assert len(script.tries) == 1
        stream.stop()

    def test_stopping_cuts_a_read_that_waits(self) -> None:
        script = Script(ScaledClock(1.0), silence)
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: script.open == 1)
        start = time.monotonic()
        stream.stop()
        assert time.monotonic() - start < 5.0
        assert script.open == 0

    def test_stopping_ends_an_opening_that_waits(self) -> None:
        cut = threading.Event()

        @contextlib.contextmanager
        def unanswered() -> Iterator[Answer]:
            if cut.wait(30.0):
                raise Unreachable("The connection was closed.")
            yield Answer(iter(()), cut)

        stream = PreviewStream(unanswered, Mailbox(), ScaledClock(1.0), cut.set)
        stream.start()
        start = time.monotonic()
        stream.stop()
        assert time.monotonic() - start < 5.0

    def test_stopping_at_any_time_and_starting_again(self) -> None:
        script = Script(ScaledClock(SPEED), *[endless] * 100)
        stream, box = stream_of(script)
        stream.stop()
        for round_ in range(20):
            stream.start()
            stream.start()
            if round_ % 3 == 0:
                assert until(lambda: stream.state is PreviewState.LIVE)
            stream.stop()
            stream.stop()
            assert script.open == 0
            box.get()
        assert box.get() is None
        stream.start()
        assert box.get(5.0) is not None
        stream.stop()

    @pytest.mark.parametrize(
        "error",
        [
            PasswordNeeded("Wrong password."),
            CameraRefused("No.", code="unknownCommand", status=400),
        ],
    )
    def test_gives_up_where_asking_again_is_no_use(self, error: DeviceError) -> None:
        script = Script(ScaledClock(SPEED), error)
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: stream.state is PreviewState.FAILED)
        assert stream.error is error
        script.answers = [endless]
        stream.start()
        assert until(lambda: stream.state is PreviewState.LIVE)
        stream.stop()
        assert stream.error is None

    def test_an_answer_without_pictures(self) -> None:
        script = Script(ScaledClock(SPEED), frames(0), endless)
        stream, _ = stream_of(script)
        stream.start()
        assert until(lambda: stream.state is PreviewState.LIVE)
        stream.stop()
