"""Brackets from files: order, copies, strays, and exposures that are missing or contradict."""

from __future__ import annotations

import itertools
import math
import shutil
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.core.base.errors import ProbeError
from app.core.measure.bracket.grouping import MAX_FRAMES, read_bracket
from app.core.measure.bracket.remarks import (
    Copies,
    FileLeftOut,
    NoteContradiction,
    NotOfBracket,
    PicturesTaken,
    SameExposure,
    TagAssumed,
    TagsUnstated,
)
from app.core.measure.read.remarks import TwoTimes
from app.words.remarks import sentences
from tests.helpers.exif_bytes import (
    RATIONAL,
    SHORT,
    SRATIONAL,
    THETA_V,
    Entry,
    camera_tags,
    exif,
    jpeg,
    tagged,
    text,
)
from tests.helpers.shared import SHARED, needs_shared

LEVEL: tuple[Entry, ...] = ((0x0007, SHORT, (1,)),)


def theta(
    path: Path,
    shutter: tuple[int, int] | None,
    iso: int | None = 64,
    aperture: tuple[int, int] | None = (20, 10),
    *,
    model: bytes = b"RICOH THETA V   ",
    note: Sequence[Entry] | None = LEVEL,
    more: Sequence[Entry] = (),
    shape: tuple[int, int] = (32, 64),
) -> Path:
    """One frame of random pixels, no two files alike."""
    main = [tagged(0x0110, text(model))] if model else []
    data = exif(note, [*camera_tags(shutter, iso, aperture), *more], main)
    path.write_bytes(jpeg(data, shape=shape, seed=sum(path.name.encode())))
    return path


@pytest.fixture
def three(tmp_path: Path) -> list[Path]:
    """Three frames 0, +2, -2 EV around 1/60 s."""
    return [
        theta(tmp_path / f"R{k}.JPG", shutter)
        for k, shutter in enumerate(((1, 60), (1, 15), (1, 250)))
    ]


def names(paths: Sequence[Path], times: Sequence[float] | None = None) -> list[str]:
    return [frame.path.name for frame in read_bracket(paths, times).frames]


def refusal(paths: Sequence[Path], times: Sequence[float] | None = None) -> str:
    with pytest.raises(ProbeError) as caught:
        read_bracket(paths, times)
    return str(caught.value)


def test_frames_in_any_order_come_brightest_first(three: list[Path]) -> None:
    first = read_bracket(three)
    assert [frame.path.name for frame in first.frames] == ["R1.JPG", "R0.JPG", "R2.JPG"]
    assert first.warnings == ()
    assert first.shape == (32, 64)
    assert first.panorama
    expected = [math.log2(time * 0.64 / 4.0) for time in (1 / 15, 1 / 60, 1 / 250)]
    assert first.stops == pytest.approx(expected, abs=1e-12)
    for order in itertools.permutations(three):
        assert read_bracket(order) == first


def test_a_folder_is_the_same_as_its_files(three: list[Path]) -> None:
    folder = three[0].parent
    (folder / "notes.txt").write_text("under the bridge")
    (folder / "R0.DNG").write_bytes(b"II*\0")
    (folder / ".hidden.jpg").write_bytes(b"no picture")
    (folder / "._R0.JPG").write_bytes(b"\0\5\26\7")
    (folder / "thumbs.jpg").mkdir()
    (folder / "more").mkdir()
    theta(folder / "more" / "R9.JPG", (1, 8))
    assert read_bracket([folder]) == read_bracket(three)


def test_what_does_not_belong_to_the_bracket_of_a_folder_is_left_out(three: list[Path]) -> None:
    folder = three[0].parent
    theta(folder / "selfie.jpg", (1, 30), shape=(48, 64))
    theta(folder / "phone.jpg", (1, 30), model=b"Pixel 9", note=None)
    cv2.imwrite(str(folder / "merged.hdr"), np.ones((32, 64, 3), np.float32))
    (folder / "zero.jpg").touch()
    bracket = read_bracket([folder])
    assert [frame.path.name for frame in bracket.frames] == ["R1.JPG", "R0.JPG", "R2.JPG"]
    said = " ".join(sentences(bracket.warnings))
    assert PicturesTaken(3, folder.name, "R0.JPG", "R2.JPG") in bracket.warnings
    assert any(
        isinstance(one, FileLeftOut) and "zero.jpg" in one.message for one in bracket.warnings
    )
    for name in ("selfie.jpg", "phone.jpg", "merged.hdr"):
        assert name in said
    assert read_bracket(three).warnings == ()


def test_of_two_sets_that_are_as_good_neither_is_guessed(three: list[Path]) -> None:
    for number, shutter in enumerate(((1, 60), (1, 15), (1, 250))):
        theta(three[0].parent / f"P{number}.jpg", shutter, model=b"Pixel 9", note=None)
    assert "from a RICOH THETA V" in refusal([three[0].parent])


def test_a_picture_that_does_not_fit_is_named(three: list[Path]) -> None:
    selfie = theta(three[0].parent / "selfie.jpg", (1, 30), shape=(48, 64))
    said = refusal([*three, selfie])
    assert "selfie.jpg is 64 x 48 pixels, but the other frames are 64 x 32 pixels" in said
    phone = theta(three[0].parent / "phone.jpg", (1, 30), model=b"Pixel 9", note=None)
    said = refusal([*three, phone])
    assert "phone.jpg is from a Pixel 9, but the other frames are from a RICOH THETA V" in said


def test_padding_of_the_camera_s_name_is_no_difference(tmp_path: Path) -> None:
    files = [
        theta(tmp_path / "a.jpg", (1, 60), model=b"RICOH THETA S" + b" " * 40),
        theta(tmp_path / "b.jpg", (1, 15), model=b"RICOH THETA S\0\0"),
    ]
    assert names(files) == ["b.jpg", "a.jpg"]


def test_a_merged_result_among_the_files_is_named(three: list[Path]) -> None:
    merged = three[0].parent / "merged.hdr"
    cv2.imwrite(str(merged), np.ones((32, 64, 3), np.float32))
    said = refusal([*three, merged])
    assert "merged.hdr is stored as floating point, but the other frames are" in said


def test_a_frame_held_another_way_is_named(three: list[Path]) -> None:
    data = exif(LEVEL, camera_tags((1, 8)), [(0x0112, SHORT, (6,))])
    upright = three[0].parent / "upright.jpg"
    upright.write_bytes(jpeg(data))
    assert "upright.jpg is in another orientation" in refusal([*three, upright])


def test_two_frames_of_two_sizes_name_both(tmp_path: Path) -> None:
    files = [
        theta(tmp_path / "a.jpg", (1, 60)),
        theta(tmp_path / "b.jpg", (1, 15), shape=(16, 32)),
    ]
    assert "b.jpg is 32 x 16 pixels, but a.jpg is 64 x 32 pixels" in refusal(files)


def test_copies_are_left_out(three: list[Path]) -> None:
    copy = three[1].parent / "copy of R1.JPG"
    shutil.copyfile(three[1], copy)
    bracket = read_bracket([*three, copy, three[0]])
    assert [frame.path.name for frame in bracket.frames] == ["R1.JPG", "R0.JPG", "R2.JPG"]
    assert bracket.warnings == (
        Copies("R1.JPG", ("copy of R1.JPG",)),
        Copies("R0.JPG", ("R0.JPG",)),
    )


def test_files_that_differ_in_their_last_byte_are_no_copies(three: list[Path]) -> None:
    data = three[0].read_bytes() + bytes(100_000)
    for k in range(3):
        (three[0].parent / f"long{k}.jpg").write_bytes(data + bytes((k // 2,)))
    bracket = read_bracket([three[0].parent])
    assert len(bracket.frames) == 5
    assert bracket.warnings[0] == Copies("long0.jpg", ("long1.jpg",))


def test_a_lone_frame_is_no_bracket(three: list[Path]) -> None:
    assert "R0.JPG is a single frame" in refusal(three[:1])
    assert "at least two exposures" in refusal(three[:1], [1.0])
    said = refusal([three[0], three[0]])
    assert "All files are copies of R0.JPG" in said


def test_names_that_lead_nowhere(three: list[Path]) -> None:
    folder = three[0].parent
    (folder / "empty").mkdir()
    (folder / "zero.jpg").touch()
    assert "no pictures to merge" in refusal([])
    assert "contains no pictures" in refusal([folder / "empty"])
    assert "other paths were chosen too" in refusal([folder, three[0]])
    assert "no file" in refusal([*three, folder / "none.jpg"])
    assert "zero.jpg is empty" in refusal([*three, folder / "zero.jpg"])
    (folder / "empty" / "zero.jpg").touch()
    assert "zero.jpg is empty" in refusal([folder / "empty"])
    assert "cannot be read" in refusal([*three, Path("a\0.jpg")])


def test_a_damaged_frame_is_named(three: list[Path]) -> None:
    three[1].write_bytes(three[1].read_bytes()[:60])
    assert "R1.JPG is damaged or incomplete" in refusal(three)


def test_too_many_files(tmp_path: Path) -> None:
    files = [theta(tmp_path / f"{k:02}.jpg", (1, 60)) for k in range(MAX_FRAMES + 1)]
    assert f"{MAX_FRAMES + 1} pictures are too many" in refusal([tmp_path])
    assert f"{MAX_FRAMES + 1} pictures are too many" in refusal(files)


def test_frames_without_exposure_time(three: list[Path]) -> None:
    folder = three[0].parent
    bare = [theta(folder / f"bare{k}.jpg", None) for k in range(2)]
    said = refusal([*three, bare[0]])
    assert "bare0.jpg does not record an exposure time" in said
    assert "--times" in said
    assert "None of the pictures records its exposure time" in refusal(bare)


def test_given_times_win(three: list[Path]) -> None:
    bracket = read_bracket(three, [0.5, 0.125, 0.03125])
    assert [frame.path.name for frame in bracket.frames] == ["R0.JPG", "R1.JPG", "R2.JPG"]
    assert np.diff(bracket.stops) == pytest.approx([-2.0, -2.0])
    assert bracket.frames[0].exposure is not None
    assert bracket.frames[0].exposure.iso == 64.0
    assert bracket.frames[0].exposure.known
    (warning,) = sentences(bracket.warnings)
    assert "R0.JPG (0.5 s, not 0.01667 s)" in warning


def test_given_times_that_agree_are_silent(three: list[Path]) -> None:
    assert read_bracket(three, [0.0167, 0.0667, 0.004]).warnings == ()


def test_times_of_a_folder_go_by_name(three: list[Path]) -> None:
    assert names([three[0].parent], [1.0, 4.0, 16.0]) == ["R2.JPG", "R1.JPG", "R0.JPG"]
    assert names(three[::-1], [1.0, 4.0, 16.0]) == ["R0.JPG", "R1.JPG", "R2.JPG"]


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf, 1e-300, 1e300])
def test_impossible_times(three: list[Path], bad: float) -> None:
    assert "not a valid exposure time" in refusal(three, [1.0, bad, 2.0])


def test_wrong_number_of_times(three: list[Path]) -> None:
    assert "2 exposure times for 3 pictures" in refusal(three, [1.0, 2.0])
    assert "1 exposure time for 3 pictures" in refusal(three, [1.0])
    # The copy has a time of its own: times go with the names given.
    assert "3 exposure times for 4 pictures" in refusal([*three, three[0]], [1.0, 2.0, 4.0])
    assert len(names([*three, three[0]], [1.0, 2.0, 4.0, 1.0])) == 3


def test_times_serve_pictures_without_exif(tmp_path: Path) -> None:
    files = []
    for k in range(3):
        files.append(tmp_path / f"{k}.png")
        cv2.imwrite(str(files[-1]), np.full((48, 40, 3), 40 * k + 10, np.uint8))
    bracket = read_bracket(files, [1.0, 4.0, 16.0])
    assert bracket.stops == pytest.approx((4.0, 2.0, 0.0))
    assert not bracket.panorama
    assert all(frame.exposure and not frame.exposure.known for frame in bracket.frames)
    assert bracket.warnings == (TagsUnstated(iso=True, aperture=True),)


def test_an_aperture_that_nobody_states(tmp_path: Path) -> None:
    files = [theta(tmp_path / f"{k}.jpg", (1, 60), iso=100 * 4**k, aperture=None) for k in range(3)]
    bracket = read_bracket(files)
    assert np.diff(bracket.stops) == pytest.approx([-2.0, -2.0])
    assert not any(frame.exposure and frame.exposure.known for frame in bracket.frames)
    assert bracket.warnings[0] == TagsUnstated(iso=False, aperture=True)


def test_what_one_frame_lacks_is_taken_from_the_others(three: list[Path]) -> None:
    bare = theta(three[0].parent / "bare.jpg", (1, 4), iso=None, aperture=None)
    bracket = read_bracket([*three, bare])
    assert bracket.frames[0].path == bare
    assert bracket.frames[0].exposure is not None
    assert bracket.frames[0].exposure.iso == 64.0
    assert bracket.frames[0].exposure.aperture == 2.0
    assert bracket.warnings == (
        TagAssumed("iso", ("bare.jpg",), 64.0),
        TagAssumed("aperture", ("bare.jpg",), 2.0),
    )


def test_what_one_frame_lacks_cannot_be_guessed_when_the_others_differ(tmp_path: Path) -> None:
    files = [
        theta(tmp_path / "a.jpg", (1, 60), iso=100),
        theta(tmp_path / "b.jpg", (1, 60), iso=400),
        theta(tmp_path / "c.jpg", (1, 60), iso=None),
    ]
    assert "(ISO 100 to ISO 400)" in refusal(files)
    bracket = read_bracket(files, [1.0, 2.0, 4.0])
    assert bracket.stops == pytest.approx([0.0, -1.0, -2.0])  # f/2 counts: all state it.
    assert any(
        "Only the exposure times you gave" in warning for warning in sentences(bracket.warnings)
    )


def test_iso_and_aperture_count(tmp_path: Path) -> None:
    files = [
        theta(tmp_path / "a.jpg", (1, 60), 100, (56, 10)),
        theta(tmp_path / "b.jpg", (1, 60), 100, (28, 10)),
        theta(tmp_path / "c.jpg", (1, 60), 800, (56, 10)),
    ]
    bracket = read_bracket(files)
    assert [frame.path.name for frame in bracket.frames] == ["c.jpg", "b.jpg", "a.jpg"]
    assert np.diff(bracket.stops) == pytest.approx([-1.0, -2.0])


def test_equal_exposures_are_no_bracket(tmp_path: Path) -> None:
    files = [theta(tmp_path / f"{k}.jpg", (1, 60)) for k in range(3)]
    said = refusal(files)
    assert "All 3 frames have the same exposure: the camera did not bracket" in said
    assert "the same exposure" in refusal(files, [2.0, 2.0, 2.0])
    assert len(names(files, [1.0, 2.0, 4.0])) == 3


def test_some_equal_exposures_are_used(three: list[Path]) -> None:
    again = theta(three[0].parent / "again.jpg", (1, 60))
    bracket = read_bracket([*three, again])
    assert [frame.path.name for frame in bracket.frames] == [
        "R1.JPG",
        "R0.JPG",
        "again.jpg",
        "R2.JPG",
    ]
    assert bracket.warnings == (SameExposure(("R0.JPG", "again.jpg")),)


def test_lenses_exposed_differently_are_named(three: list[Path]) -> None:
    auto = theta(three[0].parent / "auto.jpg", (1, 1000), note=THETA_V)
    (warning,) = sentences(read_bracket([*three, auto]).warnings)
    assert "auto.jpg: the two lenses were exposed 0.3 stops apart (ISO 64 and 80)" in warning


def test_exif_against_maker_note(three: list[Path]) -> None:
    note: list[Entry] = [
        (0x0101, SHORT, (125, 125)),
        (0x0103, SRATIONAL, (1, 8, 1, 8)),
    ]
    lying = theta(three[0].parent / "lying.jpg", (1, 30), note=note)
    assert read_bracket([*three, lying]).warnings == (
        NoteContradiction("shutter", ("lying.jpg",), (1 / 30,), (1 / 8,)),
        NoteContradiction("iso", ("lying.jpg",), (64.0,), (125.0,)),
    )


def test_a_nominal_time_does_not_contradict_the_exact_one(tmp_path: Path) -> None:
    note: list[Entry] = [(0x0103, RATIONAL, (1, 64, 1, 64))]
    files = [
        theta(tmp_path / "a.jpg", (1, 60), note=note),
        theta(tmp_path / "b.jpg", (1, 15), note=LEVEL),
    ]
    assert read_bracket(files).warnings == ()


def test_contradictions_within_exif_are_named(three: list[Path]) -> None:
    more: list[Entry] = [(0x9201, SRATIONAL, (7, 1))]
    lying = theta(three[0].parent / "lying.jpg", (1, 8), more=more)
    assert read_bracket([*three, lying]).warnings == (TwoTimes("lying.jpg", 1 / 8, 1 / 128),)


@pytest.mark.parametrize("tag", [0x0002, 0x0008, 0x000E])
def test_tone_mapped_frames_are_refused(three: list[Path], tag: int) -> None:
    mapped = theta(three[0].parent / "hdr.jpg", (1, 30), note=[(tag, SHORT, (1,))])
    assert "hdr.jpg was taken with the camera's HDR" in refusal([*three, mapped])


def test_originals_are_not_touched(three: list[Path]) -> None:
    before = [(path.read_bytes(), path.stat().st_mtime_ns) for path in three]
    read_bracket(three, [1.0, 2.0, 3.0])
    assert [(path.read_bytes(), path.stat().st_mtime_ns) for path in three] == before


@given(
    st.lists(
        st.tuples(st.integers(1, 4000), st.sampled_from([64, 100, 400])), min_size=2, max_size=6
    ),
    st.randoms(use_true_random=False),
)
@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_order_given_never_matters(
    tmp_path_factory: pytest.TempPathFactory,
    exposures: list[tuple[int, int]],
    shuffler: object,
) -> None:
    folder = tmp_path_factory.mktemp("bracket")
    files = [theta(folder / f"{k}.jpg", (1, time), iso) for k, (time, iso) in enumerate(exposures)]
    values = [math.log2(iso / time) for time, iso in exposures]
    if max(values) - min(values) < 0.05:
        assert "did not bracket" in refusal(files)
        return
    expected = read_bracket(files)
    shuffled = list(files)
    getattr(shuffler, "shuffle")(shuffled)  # noqa: B009
    assert read_bracket(shuffled) == expected
    assert list(expected.stops) == sorted(expected.stops, reverse=True)
    assert {frame.path for frame in expected.frames} == set(files)


@needs_shared
def test_of_the_memorial_church_folder_the_bracket_is_taken() -> None:
    folder = SHARED / "brackets" / "memorial"
    times = [32.0 / 2**k for k in range(16)]
    files = sorted(folder.glob("*.png"))
    assert [frame.path for frame in read_bracket([folder], times).frames] == files
    assert NotOfBracket(("memorial.hdr",)) in (read_bracket([folder], times).warnings)
    bracket = read_bracket(files, times)
    assert [frame.path for frame in bracket.frames] == files
    assert bracket.stops == pytest.approx([5.0 - k for k in range(16)])
    assert bracket.shape == (768, 512)


@needs_shared
def test_real_thetas_do_not_go_together() -> None:
    folder = SHARED / "theta"
    mixed = [folder / "theta_s_tilted_R0010298.JPG", folder / "theta_v_R0014760.JPG"]
    assert "is from a RICOH THETA V, but" in refusal(mixed)
    thumbs = sorted(folder.glob("theta_x_thumb*.JPG"))
    assert "R0010016.JPG was taken with the camera's HDR" in refusal(thumbs)
    assert names(thumbs[:2]) == ["theta_x_thumb_R0010005.JPG", "theta_x_thumb_R0010001.JPG"]
