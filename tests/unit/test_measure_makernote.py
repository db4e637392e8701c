"""The Ricoh maker note: what a Theta writes, and whatever else may stand there instead."""

from __future__ import annotations

import io
import math
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.measure.read.makernote import (
    RicohNote,
    exif_segment,
    parse_ricoh_note,
    read_ricoh_note,
)
from tests.helpers.exif_bytes import (
    LONG,
    RATIONAL,
    SHORT,
    SRATIONAL,
    THETA_V,
    Entry,
    camera_tags,
    exif,
    jpeg,
    segment,
)
from tests.helpers.shared import SHARED, needs_shared


@pytest.mark.parametrize("order", [">", "<"])
def test_all_values_of_a_note_are_read(order: str) -> None:
    assert parse_ricoh_note(exif(camera=camera_tags(), order=order)) == RicohNote(
        lens_isos=(64.0, 80.0),
        lens_shutters_s=(0.001, 0.001),
        zenith_corrected=True,
        tone_mapped=False,
        equirectangular=True,
    )


def test_the_newer_way_of_writing_lenses_is_read() -> None:
    theta: tuple[Entry, ...] = (
        (0x0101, SHORT, (50, 200)),
        (0x0103, SRATIONAL, (1, 8, 1, 4)),
    )
    note = parse_ricoh_note(exif(theta))
    assert note == RicohNote(lens_isos=(50.0, 200.0), lens_shutters_s=(0.125, 0.25))


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        (((0x0007, SHORT, (0,)),), RicohNote(zenith_corrected=False)),
        (((0x0007, SHORT, (7,)),), RicohNote(zenith_corrected=None)),
        (((0x0002, SHORT, (1,)),), RicohNote(tone_mapped=True)),
        (((0x0008, SHORT, (1,)),), RicohNote(tone_mapped=True)),
        (((0x000E, SHORT, (1,)),), RicohNote(tone_mapped=True)),
        (((0x0001, SHORT, (2,)),), RicohNote(equirectangular=False)),
        (((0x0001, SHORT, (0,)),), RicohNote(equirectangular=None)),
        (((0x0101, SHORT, (64, 1, 80, 1)),), RicohNote()),
        (((0x0101, SHORT, (64, 80, 100)),), RicohNote()),
        (((0x0101, SHORT, (0, 80)),), RicohNote()),
        (((0x0103, RATIONAL, (1, 0, 1, 8)),), RicohNote()),
        (((0x0103, SRATIONAL, (-1, 8, 1, 8)),), RicohNote()),
        (((0x0103, RATIONAL, (0, 8, 1, 8)),), RicohNote()),
        (((0x0103, RATIONAL, (1, 8)),), RicohNote()),
        (((0x0103, LONG, (1, 8)),), RicohNote(lens_shutters_s=(1.0, 8.0))),
    ],
)
def test_values_that_no_camera_has_count_as_not_stated(
    entries: tuple[Entry, ...], expected: RicohNote
) -> None:
    assert parse_ricoh_note(exif(entries)) == expected


def test_other_cameras_have_no_note() -> None:
    assert parse_ricoh_note(exif(theta=None, camera=camera_tags())) is None
    assert parse_ricoh_note(exif().replace(b"Ricoh\0\0\0", b"Nikon\0\2\0")) is None
    assert parse_ricoh_note(exif(theta=())) is None
    assert parse_ricoh_note(b"") is None


def test_directories_that_point_at_each_other_end() -> None:
    data = exif()
    pointer = data.index(struct.pack(">HHI", 0x4001, LONG, 1)) + 8
    for target in range(0, len(data) + 16):
        looped = data[:pointer] + struct.pack(">I", target) + data[pointer + 4 :]
        note = parse_ricoh_note(looped)
        assert note is None or isinstance(note, RicohNote)


def test_a_directory_with_too_many_entries_is_refused() -> None:
    many: list[Entry] = [(0x5000 + k, SHORT, (k,)) for k in range(256 - len(THETA_V))]
    assert parse_ricoh_note(exif([*THETA_V, *many])) is not None
    assert parse_ricoh_note(exif([*THETA_V, *many, (0x6000, SHORT, (0,))])) is None


@pytest.mark.parametrize("cut", range(1, len(exif()), 7))
def test_a_cut_segment_gives_less_and_never_fails(cut: int) -> None:
    note = parse_ricoh_note(exif()[:-cut])
    assert note is None or note.lens_shutters_s == ()


def _sane(note: RicohNote | None) -> None:
    if note is None:
        return
    for values in (note.lens_isos, note.lens_shutters_s):
        assert len(values) in (0, 2)
        assert all(value > 0.0 and math.isfinite(value) for value in values)


@given(st.binary(max_size=600), st.sampled_from([b"MM\0*", b"II*\0", b""]))
@settings(max_examples=300, deadline=None)
def test_any_bytes_are_survived(data: bytes, start: bytes) -> None:
    _sane(parse_ricoh_note(start + data))


@given(
    st.lists(st.tuples(st.integers(0, 399), st.integers(0, 255)), min_size=1, max_size=12),
    st.sampled_from([">", "<"]),
)
@settings(max_examples=500, deadline=None)
def test_any_damage_is_survived(changes: list[tuple[int, int]], order: str) -> None:
    data = bytearray(exif(camera=camera_tags(), order=order))
    for place, value in changes:
        data[place % len(data)] = value
    _sane(parse_ricoh_note(bytes(data)))


@given(
    st.lists(
        st.tuples(
            st.sampled_from([1, 2, 7, 8, 14, 0x101, 0x103, 0x4001, 0x8769, 0x927C]),
            st.integers(0, 0xFFFF),
            st.integers(0, 0xFFFFFFFF),
            st.integers(0, 0xFFFFFFFF),
        ),
        max_size=20,
    )
)
@settings(max_examples=300, deadline=None)
def test_any_entries_are_survived(entries: list[tuple[int, int, int, int]]) -> None:
    whole = exif()
    at = whole.index(struct.pack(">HHI", 0x0001, SHORT, 1)) - 2
    table = b"".join(struct.pack(">HHII", *entry) for entry in entries)
    _sane(parse_ricoh_note(whole[:at] + struct.pack(">H", len(entries)) + table))


def test_the_segment_is_found_behind_others() -> None:
    data = exif()
    plain = jpeg(None)
    behind = plain[:2] + segment(0xE0, b"JFIF\0" + bytes(9)) + segment(0xE1, b"http://x\0")
    whole = behind + b"\xff\xff" + segment(0xE1, b"Exif\0\0" + data) + plain[2:]
    assert exif_segment(io.BytesIO(whole)) == data


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff",
        b"\xff\xd8",
        b"\xff\xd8\xff",
        b"\xff\xd8\xff\xe1\x00",
        b"\xff\xd8\xff\xe1\x00\x01",
        b"\xff\xd8\xff\xe1\xff\xffExif\0\0MM",
        b"\xff\xd8" + b"\xff" * 4000,
        b"\xff\xd8\x00\xe1\x00\x08Exif\0\0",
        b"\xff\xd8\xff\xd9\x00\x08Exif\0\0",
        b"\x89PNG\r\n\x1a\n",
        b"\xff\xd8" + segment(0xE2, b"") * 5000 + segment(0xE1, b"Exif\0\0MM\0*"),
    ],
    ids=range(12),
)
def test_files_without_a_whole_segment_have_none(data: bytes) -> None:
    assert exif_segment(io.BytesIO(data)) is None


@given(st.binary(max_size=300))
@settings(max_examples=300, deadline=None)
def test_any_file_is_survived(data: bytes) -> None:
    found = exif_segment(io.BytesIO(b"\xff\xd8" + data))
    assert found is None or found in data


def test_a_missing_file_has_no_note(tmp_path: Path) -> None:
    assert read_ricoh_note(tmp_path / "none.jpg") is None


@needs_shared
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (
            "theta_s_tilted_R0010298.JPG",
            RicohNote((100.0, 140.0), (0.002, 0.002), False, False, True),
        ),
        ("theta_v_R0014760.JPG", RicohNote((64.0, 64.0), (0.001, 0.001), True, False, True)),
        ("theta_x_thumb_R0010001.JPG", RicohNote((50.0, 50.0), (0.000625,) * 2, True, False, True)),
        ("theta_x_thumb_R0010005.JPG", RicohNote((50.0, 50.0), (0.125,) * 2, True, False, True)),
        ("theta_x_thumb_R0010016.JPG", RicohNote((50.0, 50.0), (0.02,) * 2, True, True, True)),
    ],
)
def test_real_files_are_understood(name: str, expected: RicohNote) -> None:
    assert read_ricoh_note(SHARED / "theta" / name) == expected
