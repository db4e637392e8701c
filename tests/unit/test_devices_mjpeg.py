"""Motion JPEG: parts, packets, lengths, garbage, limits."""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np
import pytest

from app.devices.mjpeg import MAX_FRAME_BYTES, MjpegParser, boundary_of, decode, jpeg_size
from app.devices.simulated.exif import with_segments
from app.devices.simulated.exposure_maker import jpeg
from tests.helpers.pace import units

RICOH = "---osclivepreview---"


def picture(number: int, shape: tuple[int, int] = (32, 64)) -> bytes:
    colours = np.random.default_rng(number).integers(0, 256, (*shape, 3), np.uint8)
    data = jpeg(colours)
    thumbnail = jpeg(colours[:8, :8])
    return with_segments(data, [b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2) + thumbnail])


PICTURES = [picture(number) for number in range(4)]


def part(data: bytes, *, line: str = RICOH, length: int | None = -1, end: bytes = b"\r\n") -> bytes:
    header = b"Content-type: image/jpeg\r\n"
    if length is not None:
        header += b"Content-Length: %d\r\n" % (len(data) if length < 0 else length)
    return line.encode() + b"\r\n" + header + b"\r\n" + data + end


def parse(stream: bytes, step: int = 0, boundary: str = RICOH) -> list[bytes]:
    parser = MjpegParser(boundary)
    step = step or len(stream)
    return [
        frame
        for start in range(0, len(stream), step)
        for frame in parser.feed(stream[start : start + step])
    ]


class TestBoundary:
    @pytest.mark.parametrize(
        ("text", "boundary"),
        [
            ('multipart/x-mixed-replace; boundary="---osclivepreview---"', RICOH),
            ("multipart/x-mixed-replace;boundary=---osclivepreview---", RICOH),
            ("multipart/x-mixed-replace; BOUNDARY = frame; charset=x", "frame"),
            ("image/jpeg", ""),
            ("", ""),
            ("multipart/x-mixed-replace; boundary=" + "x" * 2000, ""),
        ],
    )
    def test_read_from_the_header(self, text: str, boundary: str) -> None:
        found = boundary_of(text)
        assert found == boundary or (not boundary and found == "x" * 70)

    @pytest.mark.parametrize("line", [RICOH, "--" + RICOH, "--" + RICOH + "--", "osclivepreview"])
    def test_dashes_do_not_matter(self, line: str) -> None:
        stream = b"".join(part(data, line=line) for data in PICTURES)
        assert parse(stream) == PICTURES

    @pytest.mark.parametrize("boundary", ["f", "frame", "--frame", "b-b", "-----"])
    def test_short_ones(self, boundary: str) -> None:
        stream = b"".join(part(data, line="--" + boundary) for data in PICTURES)
        assert parse(stream, 0, boundary) == PICTURES
        assert parse(stream, 7, boundary) == PICTURES


class TestParser:
    @pytest.mark.parametrize("length", [-1, None])
    def test_cut_at_every_byte(self, length: int | None) -> None:
        first, second = part(PICTURES[0], length=length), part(PICTURES[1], length=length)
        stream = first + second + RICOH.encode()
        for cut in range(1, len(stream)):
            parser = MjpegParser(RICOH)
            assert parser.feed(stream[:cut]) + parser.feed(stream[cut:]) == PICTURES[:2], cut

    @pytest.mark.parametrize("length", [-1, None, 0, 10, 900, 10**9])
    @pytest.mark.parametrize("step", [1, 2, 3, 1000, 10**6])
    def test_any_packets_and_lengths(self, step: int, length: int | None) -> None:
        stream = b"".join(part(data, length=length) for data in PICTURES)
        assert parse(stream, step) == PICTURES

    def test_a_frame_is_there_with_its_last_byte(self) -> None:
        for length in (-1, None):
            parser = MjpegParser(RICOH)
            stream = part(PICTURES[0], length=length, end=b"")
            assert parser.feed(stream[:-1]) == []
            assert parser.feed(stream[-1:]) == PICTURES[:1]
            assert len(parser._buffer) == 0

    @pytest.mark.parametrize("step", [1, 999, 10**6])
    def test_a_length_that_is_too_long_costs_no_frame(self, step: int) -> None:
        # Longer by up to more than a part: the boundary inside tells.
        for more in (1, 2, 20, 60, 500, 5000):
            parts = [part(data, length=len(data) + more) for data in PICTURES]
            assert parse(b"".join(parts), step)[:3] == PICTURES[:3], more

    def test_a_length_that_is_too_long_costs_no_time(self) -> None:
        parser = MjpegParser(RICOH)
        stream = part(PICTURES[0], length=MAX_FRAME_BYTES) + RICOH.encode() + b"\r\n"
        assert parser.feed(stream) == PICTURES[:1]

    def test_lengths_that_are_too_short(self) -> None:
        for less in (1, 2, 3, 100, 500):
            stream = b"".join(part(data, length=len(data) - less) for data in PICTURES)
            assert parse(stream) == PICTURES, less

    @pytest.mark.parametrize("step", [1, 10**6])
    def test_garbage_everywhere(self, step: int) -> None:
        rubbish = [
            b"\r\n\r\n",
            bytes(range(256)) * 9,
            b"Content-Length: 7\r\n\r\n",
            b"--",
            PICTURES[3],
        ]
        for garbage in rubbish:
            stream = garbage + garbage.join(part(data) for data in PICTURES) + garbage
            assert parse(stream, step) == PICTURES, garbage[:20]

    def test_repeated_boundaries(self) -> None:
        line = RICOH.encode() + b"\r\n"
        stream = line * 5 + part(PICTURES[0]) + line + b"Content-Length: 5\r\n" + part(PICTURES[1])
        assert parse(stream) == parse(stream, 1) == PICTURES[:2]

    def test_a_truncated_picture_is_dropped_and_the_next_one_comes(self) -> None:
        for length in (-1, None, len(PICTURES[0])):
            for kept in (1, 2, 3, 20, 300, len(PICTURES[0]) - 1):
                stream = part(PICTURES[0][:kept], length=length) + part(PICTURES[1])
                assert parse(stream) == PICTURES[1:2], (length, kept)
                assert parse(stream, 5) == PICTURES[1:2], (length, kept)

    def test_an_embedded_thumbnail_does_not_end_it(self) -> None:
        assert PICTURES[0].count(b"\xff\xd9") == 2
        assert parse(part(PICTURES[0], length=None)) == PICTURES[:1]
        assert parse(PICTURES[0] + PICTURES[1], 11, "") == PICTURES[:2]

    def test_padding_behind_a_picture(self) -> None:
        stream = b"".join(part(data + bytes(50)) for data in PICTURES)
        assert parse(stream) == PICTURES

    def test_line_ends_of_another_kind(self) -> None:
        stream = b"".join(part(data).replace(b"\r\n", b"\n", 4) for data in PICTURES)
        assert parse(stream) == parse(stream, 1) == PICTURES

    def test_no_empty_line_before_the_picture(self) -> None:
        stream = b"".join(part(data).replace(b"\r\n\r\n", b"\r\n", 1) for data in PICTURES)
        assert parse(stream) == parse(stream, 1) == PICTURES

    def test_another_boundary_than_announced(self) -> None:
        # After a while pictures are taken as they come.
        stream = b"".join(part(data, line="--something-else") for data in PICTURES * 200)
        frames = parse(stream, 5000)
        assert len(frames) > 300
        assert set(frames) <= set(PICTURES)

    def test_headers_without_end(self) -> None:
        parser = MjpegParser(RICOH)
        parser.feed(RICOH.encode() + b"\r\n")
        for _ in range(2000):
            assert parser.feed(b"X-Header: " + b"y" * 500 + b"\r\n") == []
            assert len(parser._buffer) < 20_000
        assert parser.feed(b"\r\n" + part(PICTURES[0])) == PICTURES[:1]

    @pytest.mark.parametrize("stated", [True, False])
    def test_a_frame_over_the_limit_is_dropped(self, stated: bool) -> None:
        scan = PICTURES[0].rindex(b"\xff\xd9")
        huge = PICTURES[0][:scan] + b"\x55" * (MAX_FRAME_BYTES + (1 << 20)) + b"\xff\xd9"
        parser = MjpegParser(RICOH)
        stream = part(huge, length=-1 if stated else None) + part(PICTURES[1])
        frames = []
        for start in range(0, len(stream), 65536):
            frames += parser.feed(stream[start : start + 65536])
            assert len(parser._buffer) <= MAX_FRAME_BYTES + 2 * 65536
        assert frames == PICTURES[1:2]
        assert parser.dropped == 1

    def test_a_picture_has_few_segments(self) -> None:
        for count, frames in ((100, 1), (300, 0)):
            data = PICTURES[0][:2] + b"\xff\xfe\x00\x02" * count + PICTURES[0][2:]
            assert len(parse(part(data, length=None))) == frames

    def test_memory_is_bounded_whatever_comes_in_one_piece(self) -> None:
        for content in (
            b"\xff",
            b"\xff\xd8\xff",
            b"\x00",
            b"\r\n",
            b"-",
            b"\xff\xd8\xff\xe1\x00\x02",
        ):
            for boundary in (RICOH, ""):
                parser = MjpegParser(boundary)
                parser.feed(content * (3 * MAX_FRAME_BYTES // len(content)))
                assert len(parser._buffer) <= MAX_FRAME_BYTES + 65536

    @pytest.mark.slow
    @pytest.mark.alone
    def test_work_grows_with_the_bytes_only(self) -> None:
        """Floods that would take 16 times as long if anything were searched again and again."""
        head = RICOH.encode() + b"\r\n\r\n\xff\xd8"
        for content in (
            b"\xff\xc4\x00\x02",
            b"\xff",
            RICOH.encode(),
            b"\xff\xd8\xff\xda\x00\x02\x01",
        ):
            long, short = (
                units(partial(parse, head + content * (size // len(content)), 1500))
                for size in (4 << 20, 1 << 20)
            )
            assert long < 8 * short, content


def test_size() -> None:
    assert jpeg_size(PICTURES[0]) == (32, 64)


class TestDecode:
    def test_colours_and_size(self) -> None:
        colours = np.zeros((32, 64, 3), np.uint8)
        colours[..., 0] = 200
        found = decode(jpeg(colours))
        assert found is not None
        assert found.shape == (32, 64, 3)
        assert found.dtype == np.uint8
        assert abs(found.astype(int) - colours).max() < 4

    def test_grey_becomes_three_channels(self) -> None:
        done, data = cv2.imencode(".jpg", np.full((16, 32), 77, np.uint8))
        assert done
        found = decode(data.tobytes())
        assert found is not None
        assert found.shape == (16, 32, 3)

    @pytest.mark.parametrize("shape", [(2049, 4096), (2048, 4097), (65535, 65535)])
    def test_a_large_picture_is_refused_before_it_is_decoded(self, shape: tuple[int, int]) -> None:
        data = bytearray(PICTURES[0])
        place = data.rindex(b"\xff\xc0") + 5
        data[place : place + 4] = shape[0].to_bytes(2) + shape[1].to_bytes(2)
        assert jpeg_size(bytes(data)) == shape
        assert decode(bytes(data)) is None

    def test_what_is_not_a_picture(self) -> None:
        progressive = cv2.imencode(
            ".jpg", np.zeros((16, 16, 3), np.uint8), [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]
        )[1].tobytes()
        scans = PICTURES[0].replace(b"\xff\xda", b"\xff\xda" * 20)
        for data in (b"", b"\xff\xd8\xff\xd9", b"GIF89a", bytes(5000), progressive, scans):
            assert decode(data) is None

    def test_a_cut_picture_never_fails_otherwise(self) -> None:
        for kept in range(2, len(PICTURES[0]), 37):
            found = decode(PICTURES[0][:kept])
            assert found is None or found.shape == (32, 64, 3)

    def test_a_rotation_in_the_file_is_ignored(self) -> None:
        exif = (
            b"Exif\x00\x00MM\x00\x2a\x00\x00\x00\x08\x00\x01"
            b"\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00\x00\x00\x00\x00"
        )
        data = jpeg(np.zeros((16, 48, 3), np.uint8))
        turned = with_segments(data, [b"\xff\xe1" + (len(exif) + 2).to_bytes(2) + exif])
        found = decode(turned)
        assert found is not None
        assert found.shape == (16, 48, 3)
