"""Motion JPEG damaged in every way: no exception, no growth, and what is whole comes through.

Each case is a stream of parts, some of them as a camera sends them and some spoilt, cut into random
packets. Whatever is spoilt, every part that is as it should be must be delivered, in order.
"""

from __future__ import annotations

import random
import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from app.devices.mjpeg import MAX_FRAME_BYTES, MjpegParser, boundary_of, decode
from app.devices.simulated.exif import with_segments
from benchmarks.light.shots.brackets import jpeg

QUICK = 400
LONG = 12_000
LINE = b"---osclivepreview---"
PACKET = 64 << 10


def pictures() -> list[bytes]:
    """Small pictures of several kinds, some with a thumbnail inside."""
    made = []
    for seed in range(6):
        generator = np.random.default_rng(seed)
        shape = [(16, 32), (24, 48), (32, 64)][seed % 3]
        colours = generator.integers(0, 256, (*shape, 3), np.uint8)
        data = jpeg(colours, [60, 90][seed % 2], ["4:2:0", "4:4:4"][seed // 3])
        if seed % 2:
            thumbnail = jpeg(colours[:8, :8])
            data = with_segments(data, [b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2) + thumbnail])
        made.append(data)
    return made


PICTURES = pictures()


def part(data: bytes, length: int | None, line: bytes = LINE, end: bytes = b"\r\n") -> bytes:
    stated = b"" if length is None else b"Content-Length: %d\r\n" % length
    return line + b"\r\nContent-type: image/jpeg\r\n" + stated + b"\r\n" + data + end


def whole(dice: random.Random, data: bytes) -> bytes:
    """Frame a picture as it should be; which kind of camera sent it does not matter."""
    line = dice.choice([LINE, LINE, b"--" + LINE, b"\r\n--" + LINE, b"--" + LINE + b"--"])
    return part(data, len(data), line, dice.choice([b"\r\n", b"", b"\r\n\r\n", b"\n"]))


def truncated(dice: random.Random, data: bytes) -> bytes:
    return part(data[: dice.randrange(len(data))], dice.choice([len(data), None]))


def wrong_length(dice: random.Random, data: bytes) -> bytes:
    choices = [0, 1, dice.randrange(len(data)), len(data) + dice.randrange(1, 9000), 10**9]
    return part(data, dice.choice(choices))


def without_length(dice: random.Random, data: bytes) -> bytes:
    del dice
    return part(data, None)


def flipped(dice: random.Random, data: bytes) -> bytes:
    spoilt = bytearray(part(data, dice.choice([len(data), None])))
    for _ in range(dice.randint(1, 12)):
        spoilt[dice.randrange(len(spoilt))] = dice.randrange(256)
    return bytes(spoilt)


def deleted(dice: random.Random, data: bytes) -> bytes:
    spoilt = part(data, len(data))
    start = dice.randrange(len(spoilt))
    return spoilt[:start] + spoilt[start + dice.randint(1, 300) :]


def repeated(dice: random.Random, data: bytes) -> bytes:
    line = dice.choice([LINE, LINE + b"\r\n", LINE + b"\r\nContent-Length: 77\r\n", b"--" + LINE])
    return line * dice.randint(1, 6) + dice.choice([b"", b"\r\n"]) + data[: dice.randrange(200)]


def garbage(dice: random.Random, data: bytes) -> bytes:
    kinds = [
        dice.randbytes(dice.randrange(3000)),
        bytes(dice.choice([0, 255, 10, 13, 45])) * dice.randrange(30),
        b"\r\n" * dice.randrange(50),
        b"\xff\xd8\xff" * dice.randrange(1, 50),
        b"\xff\xd8\xff\xe1\xff\xff" + dice.randbytes(50),
        b"HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\n",
        b"X: " + b"y" * dice.randrange(3000) + b"\r\n",
        LINE[: dice.randrange(len(LINE))],
        data,
    ]
    return dice.choice(kinds)


DAMAGES: list[Callable[[random.Random, bytes], bytes]] = [
    truncated,
    wrong_length,
    without_length,
    flipped,
    deleted,
    repeated,
    garbage,
]


def check(seed: int) -> int:
    """Play one case; how many pictures came."""
    dice = random.Random(seed)
    stream, expected = b"", []
    for _ in range(dice.randint(1, 8)):
        data = dice.choice(PICTURES)
        if dice.random() < 0.5:
            stream += whole(dice, data)
            expected.append(data)
        else:
            stream += dice.choice(DAMAGES)(dice, data)
    boundary = dice.choice(["---osclivepreview---", "osclivepreview", "--osclivepreview--"])
    parser = MjpegParser(boundary)
    most = dice.choice([1, 20, 500, 2000, 100_000])
    frames, place = [], 0
    while place < len(stream):
        step = dice.randint(1, most) if most > 1 or len(stream) < 4000 else 64
        frames += parser.feed(stream[place : place + step])
        place += step
        assert len(parser._buffer) <= len(stream)
    came = iter(frames)
    assert all(any(frame == wanted for frame in came) for wanted in expected), f"seed {seed}"
    for frame in frames:
        assert frame[:2] == b"\xff\xd8"
        assert frame[-2:] == b"\xff\xd9"
        if frame not in PICTURES:
            look_at(frame)
    return len(frames)


def look_at(data: bytes) -> None:
    found = decode(data)
    assert found is None or (found.dtype == np.uint8 and found.ndim == 3)


def test_damaged_streams() -> None:
    assert sum(check(seed) for seed in range(QUICK)) > QUICK


@pytest.mark.slow
def test_many_damaged_streams_in_bounded_memory() -> None:
    for seed in range(1_000_000, 1_000_000 + 200):
        check(seed)
    tracemalloc.start()
    try:
        base = tracemalloc.get_traced_memory()[0]
        for seed in range(1_001_000, 1_001_300):
            check(seed)
        grown = tracemalloc.get_traced_memory()[0] - base
    finally:
        tracemalloc.stop()
    assert grown < 100_000
    for seed in range(2_000_000, 2_000_000 + LONG):
        check(seed)


@settings(max_examples=QUICK, deadline=None)
@given(stream=st.binary(max_size=2000), cut=st.integers(1, 300), boundary=st.text(max_size=20))
@example(stream=b"\xff" * 2000, cut=1, boundary="")
@example(stream=b"-" * 2000, cut=3, boundary="-")
@example(stream=b"--\r\n" * 500, cut=3, boundary="--")
def test_any_bytes_and_any_boundary(stream: bytes, cut: int, boundary: str) -> None:
    parser = MjpegParser(boundary)
    for start in range(0, len(stream), cut):
        for frame in parser.feed(stream[start : start + cut]):
            look_at(frame)
    assert len(parser._buffer) <= len(stream)


@settings(max_examples=QUICK, deadline=None)
@given(st.text(max_size=200))
def test_any_content_type(text: str) -> None:
    assert len(boundary_of(text)) <= 70
    assert len(boundary_of(f"multipart/x-mixed-replace; boundary={text}")) <= 70


@settings(max_examples=QUICK, deadline=None)
@given(st.data())
def test_damaged_pictures_decode_or_are_refused(data: st.DataObject) -> None:
    spoilt = bytearray(data.draw(st.sampled_from(PICTURES)))
    places = st.integers(0, len(spoilt) - 1)
    for place, value in data.draw(st.lists(st.tuples(places, st.integers(0, 255)), max_size=20)):
        spoilt[place] = value
    look_at(bytes(spoilt[: data.draw(st.integers(0, len(spoilt)))]))


@pytest.mark.slow
@pytest.mark.parametrize("unit", [b"\xff\xd8\xff", LINE + b"\r\n\r\n\xff\xd8\xff\x00", b"\xff\xd8"])
def test_floods_stay_within_one_picture(unit: bytes) -> None:
    parser = MjpegParser(LINE.decode())
    flood = unit * (PACKET // len(unit))
    for _ in range(2 * MAX_FRAME_BYTES // PACKET // 4):
        parser.feed(flood)
        assert len(parser._buffer) <= MAX_FRAME_BYTES + PACKET
    assert parser.feed(part(PICTURES[0], len(PICTURES[0])))[-1:] == PICTURES[:1]
