"""The simulated preview: its pictures, their numbers, and the pace at which they are sent."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest

from app.devices.clock import VirtualClock
from app.devices.simulated.exchange import Pause
from app.devices.simulated.preview import (
    LOOP,
    PREVIEW_HEADERS,
    LivePicture,
    preview_pieces,
)
from tests.helpers.live_marks import read_number

SHAPE = (160, 320)


@pytest.fixture(scope="module")
def live() -> LivePicture:
    light = np.random.default_rng(1).gamma(0.3, 1.0, (64, 128, 3)).astype(np.float32)
    light[20:22, 30:32] = 5000.0
    return LivePicture(light, SHAPE)


def decoded(data: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR_RGB)
    assert picture is not None
    return np.asarray(picture, np.uint8)


def test_every_picture_tells_its_number(live: LivePicture) -> None:
    assert [read_number(decoded(live.frame(number))) for number in range(LOOP)] == [*range(LOOP)]
    assert live.frame(LOOP + 3) is live.frame(3)


@pytest.mark.parametrize("shape", [(320, 640), (512, 1024), (512, 512), (960, 1920), (32, 64)])
def test_numbers_are_read_at_every_size(live: LivePicture, shape: tuple[int, int]) -> None:
    light = np.full((32, 64, 3), 2.0, np.float32)
    picture = decoded(LivePicture(light, shape).frame(21))
    assert picture.shape == (*shape, 3)
    assert read_number(picture) == 21


def test_numbers_survive_a_smaller_view(live: LivePicture) -> None:
    small = cv2.resize(decoded(live.frame(9)), (128, 64), interpolation=cv2.INTER_AREA)
    assert read_number(np.asarray(small, np.uint8)) == 9


def test_no_number_in_other_pictures() -> None:
    generator = np.random.default_rng(2)
    pictures = generator.integers(0, 256, (200, 64, 128, 3), np.uint8)
    assert sum(read_number(picture) is not None for picture in pictures) < 3
    assert read_number(np.zeros((64, 128, 3), np.uint8)) is None


def test_the_scene_is_seen_and_something_moves(live: LivePicture) -> None:
    first, second = decoded(live.frame(0)), decoded(live.frame(LOOP // 2))
    assert 20 < first[:100].mean() < 200
    changed = np.abs(first.astype(int) - second).max(axis=-1) > 60
    assert changed[60:100].any()
    assert not changed[:50].any()


def test_one_lens_sees_the_middle() -> None:
    light = np.zeros((32, 64, 3), np.float32)
    light[:, 16:48, 0] = 1.0
    picture = decoded(LivePicture(light, (64, 64)).frame(0))
    assert (picture[:20, :, 0].astype(int) - picture[:20, :, 1]).min() > 20


def test_parts_as_ricoh_sends_them(live: LivePicture) -> None:
    head, body, pause = itertools.islice(preview_pieces(live, 30, VirtualClock()), 3)
    data = live.frame(0)
    assert isinstance(head, bytes)
    assert head.startswith(b"---osclivepreview---\r\n")
    assert head.endswith(b"Content-Length: %d\r\n\r\n" % len(data))
    assert body == data + b"\r\n"
    assert isinstance(pause, Pause)
    assert dict(PREVIEW_HEADERS)["Content-Type"].endswith('boundary="---osclivepreview---"')


def played(live: LivePicture, clock: VirtualClock, sending_s: float, count: int) -> list[bytes]:
    sent = []
    for piece in preview_pieces(live, 30, clock):
        if isinstance(piece, Pause):
            clock.sleep(piece.seconds)
        elif piece.startswith(b"\xff\xd8"):
            clock.sleep(sending_s)
            sent.append(piece[:-2])
        if len(sent) == count:
            break
    return sent


def test_pace(live: LivePicture) -> None:
    for sending_s in (0.0, 0.01, 0.03):
        clock = VirtualClock()
        played(live, clock, sending_s, 91)
        assert clock.now() == pytest.approx(90 / 30 + sending_s, abs=1e-6)


def test_a_slow_reader_misses_pictures(live: LivePicture) -> None:
    clock = VirtualClock()
    sent = played(live, clock, 0.3, 20)
    numbers = np.array([read_number(decoded(data)) for data in sent])
    steps = np.diff(numbers) % LOOP
    assert steps.max() > 5
    assert steps.mean() == pytest.approx(9.0, abs=1.5)


def test_pictures_are_made_once(live: LivePicture) -> None:
    first, second = (played(live, VirtualClock(), 0.0, LOOP) for _ in range(2))
    assert first == second
    assert all(live.frame(number) is live.frame(number) for number in range(LOOP))


def test_too_small() -> None:
    with pytest.raises(ValueError, match="at least"):
        LivePicture(np.ones((8, 16, 3), np.float32), (16, 32))
