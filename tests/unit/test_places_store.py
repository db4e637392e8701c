"""Places on the disk: made, listed, read again as they were, and salvaged when damaged."""

from __future__ import annotations

import errno
import json
import math
import os
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given
from hypothesis import settings as limits
from hypothesis import strategies as st

from app.core.base.remarks import PlainRemark
from app.core.measure.bracket.remarks import MuchMotion
from app.core.places.place import AnswerBasis, CaptureFacts, FrameFacts, Location, Place, PlaceError
from app.core.places.place_folder import (
    capture_folders,
    change_place,
    create_place,
    new_capture_folder,
    read_place,
    write_place,
)
from app.core.places.place_list import list_places
from app.core.places.place_verdict import verdict_of
from app.core.places.remarks import FolderUnreadable, JudgedAnew, LightMissing, Unfinished
from app.core.places.saved.place_json import to_json
from app.core.places.saved.saved_verdict import SavedAnswer, saved_answers
from app.core.portrait.ratio_and_glare import Flow
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.solve import solve_all
from app.core.styles.lamps import Studio
from app.core.styles.style_pack_file import load_named_pack
from tests.unit.test_places_results import RESULTS

POSIX = pytest.mark.skipif(os.name != "posix", reason="permissions, pipes and links as on POSIX")
SHARED = limits(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    deadline=None,
    max_examples=40,
)
NOON = datetime(2026, 6, 21, 12, 5, 7, 123456, tzinfo=timezone(timedelta(hours=2)))

TEXTS = st.text(max_size=40)
PRINTABLE = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=60)
ANGLES = st.floats(-179.9, 180.0)
TIMES = st.datetimes(
    datetime(1900, 1, 1),
    datetime(2200, 1, 1),
    timezones=st.integers(-720, 720).map(lambda minutes: timezone(timedelta(minutes=minutes))),
)
SHARES = st.floats(0.0, 1.0)
LOCATIONS = st.builds(
    Location,
    st.sampled_from(["unknown", "indoor", "outdoor"]),
    st.none() | st.booleans(),
    st.none() | ANGLES,
    st.none() | st.floats(-90.0, 90.0),
    st.none() | st.floats(-90.0, 90.0),
    st.none() | st.floats(-180.0, 180.0),
)
FRAMES = st.builds(
    FrameFacts,
    st.sampled_from(["R0010001.JPG", "Bild – 2.jpg"]),
    st.floats(1e-6, 60.0),
    st.floats(0.0, 1e5),
    st.floats(0.0, 32.0),
    st.floats(-20.0, 20.0),
    SHARES,
)
REMARKS = st.lists(
    st.builds(PlainRemark, PRINTABLE) | st.builds(MuchMotion, SHARES), max_size=2
).map(tuple)
CAPTURES = st.builds(
    CaptureFacts,
    TEXTS,
    st.sampled_from(["", "paper", "full", "files"]),
    st.lists(FRAMES, max_size=4).map(tuple),
    st.none() | SHARES,
    st.none() | st.floats(0.0, 1e6),
    REMARKS,
    REMARKS,
    REMARKS,
)
PLACES = st.builds(
    Place,
    name=st.text(max_size=150),
    made_at=TIMES,
    environment=st.sampled_from(["", "environment.exr", "environment-0123456789ab.exr"]),
    fingerprint=st.sampled_from(["", "ab" * 32]),
    measured_at=st.none() | TIMES,
    front_deg=st.floats(-1e4, 1e4),
    head=st.sampled_from(["generic", "female"]),
    notes=st.text(max_size=200),
    tags=st.lists(st.text(max_size=80), max_size=20).map(tuple),
    location=LOCATIONS,
    asked=st.none()
    | st.builds(
        AnswerBasis,
        st.just("male"),
        st.sampled_from(["picture", "paper"]),
        st.floats(0.0, 100.0),
        st.floats(0.0, 100.0),
    ),
    results=st.lists(RESULTS, max_size=1).map(tuple),
    before=st.lists(RESULTS, max_size=1).map(tuple),
    flow=st.none() | st.builds(Flow, ANGLES, st.floats(-90.0, 90.0), st.floats(0.0, 4.0)),
    chosen=st.none() | st.just("left-loop"),
    needle_deg=st.none() | ANGLES,
    goal_deg=st.none() | ANGLES,
    capture=st.none() | CAPTURES,
    spot=st.sampled_from(["", "0af3"]),
    lens=st.builds(
        LensWish,
        st.floats(-45.0, 45.0) | st.sampled_from(["auto", "short", "broad"]),
        st.none() | st.tuples(ANGLES, ANGLES),
    ),
)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def full_place() -> Place:
    """A place with something in every field."""
    light = np.random.default_rng(5).gamma(0.3, size=(32, 64))
    frames = (FrameFacts("R1.JPG", 0.01, 100.0, 2.0, 0.0, 0.02), FrameFacts("R2.JPG", 0.04))
    return Place(
        name="Café de l’Été",
        made_at=NOON,
        environment="environment-0123456789ab.exr",
        fingerprint="cd" * 32,
        flow=Flow(30.0, -10.0, 1.2),
        measured_at=NOON + timedelta(minutes=3),
        front_deg=12.345678901234567,
        head="female",
        notes="Under the arch.\nAsk for the key.",
        tags=("north light", "brick"),
        location=Location("outdoor", True, -33.3, 51.5, 48.85, 2.35),
        asked=AnswerBasis("female", "paper", 40.0, 10.0),
        results=solve_all(load_named_pack("generic"), light)[:3],
        before=solve_all(load_named_pack("generic"), light)[:3],
        chosen="left-loop",
        needle_deg=-7.1,
        goal_deg=96.4,
        capture=CaptureFacts(
            "RICOH THETA X",
            "full",
            frames,
            0.01,
            850.0,
            (PlainRemark("Moved."),),
            (PlainRemark("More."),),
        ),
        said_white_cd_m2=412.5,
        spot="0af3",
        studios={"": Studio(30.0, None), "left-loop": Studio(math.pi, 4.0)},
        lens=LensWish("short", (101.25, -170.5)),
    )


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "places"


@pytest.fixture
def kept(root: Path) -> Path:
    """Folder of a place with something in every field."""
    folder = create_place(root, "Café", NOON)
    write_place(folder, full_place())
    (folder / "environment-0123456789ab.exr").write_bytes(b"light")
    return folder


# -- making ------------------------------------------------------------------------------------


@SHARED
@given(st.text(max_size=300), TIMES)
@example("../../etc/passwd", NOON)
@example("con", NOON)
@example(" . ", NOON)
@example("\ud800\x00\u202e", NOON)
@example("日本の家", NOON)
@example("C:\\x:y|z*?", NOON)
def test_any_name_makes_a_safe_folder(tmp_path: Path, name: str, when: datetime) -> None:
    root = tmp_path / "places"
    folder = create_place(root, name, when)
    assert folder.parent == root
    # Letters that every file system takes and none changes the case of.
    assert re.fullmatch(r"\d{4}-\d\d-\d\d-\d{4}-[a-z0-9][a-z0-9-]{0,60}", folder.name)
    place = read_place(folder)
    assert place.made_at == when
    assert place.made_at.utcoffset() == when.utcoffset()
    assert place.remarks == ()
    assert 1 <= len(place.name) <= 120
    assert not set(place.name) & set("\n\r\t\0")


def test_name_is_kept_as_it_was_typed(root: Path) -> None:
    folder = create_place(root, "  Zoë’s\tgarden ", NOON)
    assert read_place(folder).name == "Zoë’s garden"
    assert folder.name == "2026-06-21-1205-zoes-garden"


def test_same_name_and_minute_give_folders_of_their_own(root: Path) -> None:
    folders = [create_place(root, "Court", NOON) for _ in range(3)]
    assert [folder.name[16:] for folder in folders] == ["court", "court-2", "court-3"]
    assert len({read_place(folder).spot for folder in folders}) == 3
    assert names(root) == sorted(folder.name for folder in folders)


def test_a_folder_that_is_in_the_way_is_left_alone(root: Path) -> None:
    (root / "2026-06-21-1205-court").mkdir(parents=True)
    assert create_place(root, "Court", NOON).name == "2026-06-21-1205-court-2"
    assert names(root / "2026-06-21-1205-court") == []


def test_second_capture_of_a_spot_is_linked(root: Path) -> None:
    first = read_place(create_place(root, "Court", NOON))
    second = create_place(root, "Court later", NOON, spot=first.spot)
    assert first.spot
    assert read_place(second).spot == first.spot
    assert {summary.spot for summary in list_places(root)} == {first.spot}


def test_time_without_offset_is_refused(root: Path) -> None:
    with pytest.raises(ValueError, match="offset"):
        create_place(root, "x", datetime(2026, 1, 1))
    with pytest.raises(ValueError, match="offset"):
        replace(full_place(), measured_at=datetime(2026, 1, 1))


@pytest.mark.parametrize("angle", [math.nan, math.inf])
def test_angle_that_is_none_is_refused(angle: float) -> None:
    with pytest.raises(ValueError, match="angle"):
        replace(full_place(), front_deg=angle)


def test_place_in_a_file_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "places").write_bytes(b"")
    with pytest.raises(PlaceError, match=r"Cannot create a place .* Choose another places folder"):
        create_place(tmp_path / "places", "x", NOON)


def test_full_disk_leaves_no_half_place(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root.mkdir()

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(PlaceError, match="no space left"):
        create_place(root, "x", NOON)
    assert names(root) == []


# -- reading and writing -----------------------------------------------------------------------


@SHARED
@given(PLACES)
def test_any_place_comes_back_as_it_was(tmp_path: Path, place: Place) -> None:
    write_place(tmp_path, place)
    again = read_place(tmp_path)
    assert again.remarks == ()
    # Every field: an entry of the file for each, and equal floats are equal to the last bit.
    assert to_json(again) == to_json(place)
    assert -180.0 < again.front_deg <= 180.0
    write_place(tmp_path, again)
    assert to_json(read_place(tmp_path)) == to_json(place)


def test_every_field_is_in_the_file() -> None:
    others = {"remarks", "source"}
    facts = to_json(full_place())
    assert set(facts) == {*Place.__slots__, "format_version"} - others
    empty = Place("x", NOON)
    for key in set(facts) - {"format_version", "made_at"}:
        # So that a comparison of files above compares something.
        assert facts[key] != to_json(empty)[key], key


def test_write_replaces_and_leaves_nothing_else(kept: Path) -> None:
    before = names(kept)
    write_place(kept, replace(read_place(kept), notes="new"))
    assert names(kept) == before
    assert read_place(kept).notes == "new"


def test_answers_by_an_earlier_rule_are_kept_and_told_once(kept: Path) -> None:
    light = np.random.default_rng(3).uniform(0.1, 9.0, (32, 64))
    results = solve_all(load_named_pack("generic"), light, styles=["butterfly", "left-loop"])
    old = tuple(replace(each, grade=None) for each in results)
    write_place(kept, replace(read_place(kept), results=old))
    opened = read_place(kept)
    assert [each.name for each in opened.before] == ["butterfly", "left-loop"]
    assert any(isinstance(each, JudgedAnew) for each in opened.remarks)
    write_place(kept, replace(opened, results=results))
    again = read_place(kept)
    assert again.remarks == ()
    assert [each.grade for each in again.before] == [None, None]
    assert [each.turn_deg for each in again.before] == [each.turn_deg for each in old]


def test_rename_keeps_the_folder(kept: Path) -> None:
    place = change_place(kept, name="Arcade")
    assert place.name == read_place(kept).name == "Arcade"
    assert list_places(kept.parent)[0].folder == kept


def test_what_could_not_be_read_again_is_not_written(kept: Path) -> None:
    before = (kept / "place.json").read_bytes()
    place = read_place(kept)
    for bad in (
        replace(place, notes="x" * 100_001),
        replace(place, environment="../../secret.exr"),
        replace(place, fingerprint="xyz"),
        replace(place, head="x" * 300),
        replace(place, location=Location(sun_elevation_deg=91.0)),
    ):
        with pytest.raises(PlaceError):
            write_place(kept, bad)
    assert (kept / "place.json").read_bytes() == before


def test_long_words_of_a_camera_are_cut_rather_than_refused(kept: Path) -> None:
    capture = CaptureFacts("X" * 999, warnings=(PlainRemark("w" * 9999),) * 999)
    write_place(kept, replace(read_place(kept), capture=capture))
    again = read_place(kept)
    assert again.remarks == ()
    assert again.capture is not None
    assert len(again.capture.camera) == 200
    assert len(again.capture.warnings) == 200


def test_numbers_of_numpy_are_taken(kept: Path) -> None:
    frame = FrameFacts("a.jpg", np.float32(0.25), clipped_share=np.float64(0.5))  # type: ignore[arg-type]
    location = Location(sun=np.bool_(True), sun_azimuth_deg=np.float32(0.5))  # type: ignore[arg-type]
    place = replace(read_place(kept), capture=CaptureFacts(frames=(frame,)), location=location)
    write_place(kept, place)
    again = read_place(kept)
    assert again.capture is not None
    assert again.capture.frames == (FrameFacts("a.jpg", 0.25, clipped_share=0.5),)
    assert again.location == Location(sun=True, sun_azimuth_deg=0.5)


def test_full_disk_leaves_the_place_as_it_was(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (kept / "place.json").read_bytes()
    place = replace(read_place(kept), notes="new")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(PlaceError, match=r"was not saved.*no space left.*unchanged"):
        write_place(kept, place)
    assert (kept / "place.json").read_bytes() == before


def test_missing_and_other_folders_are_sentences(tmp_path: Path) -> None:
    with pytest.raises(PlaceError, match="There is no place"):
        read_place(tmp_path / "gone")
    (tmp_path / "holiday").mkdir()
    (tmp_path / "holiday" / "beach.jpg").write_bytes(b"x")
    with pytest.raises(PlaceError, match="is not a place"):
        read_place(tmp_path / "holiday")


# -- listing -----------------------------------------------------------------------------------


def test_lists_the_newest_first_across_offsets(root: Path) -> None:
    east = timezone(timedelta(hours=11))
    for name, when in [
        ("b", datetime(2026, 6, 21, 12, tzinfo=UTC)),
        ("c", datetime(2026, 6, 21, 22, tzinfo=east)),  # an hour before b
        ("a", datetime(2026, 6, 21, 12, 30, tzinfo=UTC)),
    ]:
        create_place(root, name, when)
    assert [each.name for each in list_places(root)] == ["a", "b", "c"]


def test_lists_what_a_card_needs(kept: Path) -> None:
    (kept / "thumbnail.png").write_bytes(b"png")
    listed = list_places(kept.parent)[0]
    assert listed.name == "Café de l’Été"
    assert listed.made_at == NOON
    assert listed.thumbnail == kept / "thumbnail.png"
    assert (listed.state, listed.trouble, listed.has_light) == ("whole", None, True)
    assert listed.spot == "0af3"


def test_a_list_has_the_verdict_about_a_place(kept: Path) -> None:
    place = read_place(kept)
    (one,) = list_places(kept.parent)
    assert verdict_of(one.answers, one.flow) == verdict_of(place.results, place.flow)
    flow = Flow(-40.0, 20.0, 2.5)
    change_place(kept, flow=flow)
    (one,) = list_places(kept.parent)
    assert (one.flow, read_place(kept).flow) == (flow, flow)


@pytest.mark.parametrize(
    ("results", "answers"),
    [
        (
            [{"attainable": True, "name": "left-loop", "title": "Loop", "match": 10**400}],
            (SavedAnswer("left-loop", "Loop", True, 0.0, None),),
        ),
        (
            [
                {"name": "flat", "attainable": True, "grade": "nearly", "match": 9.0},
                {"name": "below", "attainable": 1, "grade": "yes", "match": math.nan},
                {"name": "top", "title": ["Top"], "grade": ["yes"], "attainable": True},
                {"attainable": True, "title": "Split"},
                "nothing",
            ],
            (
                SavedAnswer("flat", "", True, 9.0, "soft"),
                SavedAnswer("below", "", False, 0.0, "yes"),
                SavedAnswer("top", "", True, 0.0, None),
            ),
        ),
        ({"attainable": True}, ()),
        (None, ()),
    ],
)
def test_answers_of_any_file(results: object, answers: tuple[SavedAnswer, ...]) -> None:
    assert saved_answers({"results": results}) == answers


@pytest.mark.parametrize(
    "flow",
    [
        "left",
        {},
        {"azimuth_deg": 0.0, "elevation_deg": 0.0},
        {"azimuth_deg": 0.0, "elevation_deg": 200.0, "strength": 1.0},
        {"azimuth_deg": math.inf, "elevation_deg": 0.0, "strength": 1.0},
    ],
)
def test_a_damaged_flow_is_no_loss(kept: Path, flow: object) -> None:
    file = kept / "place.json"
    file.write_text(json.dumps(json.loads(file.read_text("utf-8")) | {"flow": flow}), "utf-8")
    (one,) = list_places(kept.parent)
    assert (one.flow, one.trouble) == (None, None)
    place = read_place(kept)
    assert (place.flow, place.remarks) == (None, ())


def test_missing_light_is_said(kept: Path) -> None:
    (kept / "environment-0123456789ab.exr").unlink()
    listed = list_places(kept.parent)[0]
    assert not listed.has_light
    assert listed.trouble == LightMissing()


def test_new_place_without_light_is_no_trouble(root: Path) -> None:
    create_place(root, "x", NOON)
    listed = list_places(root)[0]
    assert (listed.state, listed.trouble, listed.has_light) == ("whole", None, False)


def test_lists_nothing_that_never_was_a_place(root: Path) -> None:
    assert list_places(root) == ()
    (root / "holiday").mkdir(parents=True)
    (root / "holiday" / "beach.jpg").write_bytes(b"x")
    (root / ".hidden").mkdir()
    (root / "file").write_bytes(b"x")
    assert list_places(root) == ()


def test_root_that_is_a_file_is_told_and_not_raised(root: Path) -> None:
    root.write_bytes(b"")
    (listed,) = list_places(root)
    assert isinstance(listed.trouble, FolderUnreadable)


@pytest.mark.parametrize("inside", ["capture", "capture-3", "."])
def test_capture_that_was_broken_off_is_offered(root: Path, inside: str) -> None:
    folder = root / "2026-06-21-1205-old-court"
    (folder / inside).mkdir(parents=True)
    (folder / inside / "session.json").write_text("{}", "utf-8")
    (listed,) = list_places(root)
    assert listed.state == "unfinished"
    assert listed.captures == ((folder / inside),)
    assert listed.name == "old court"
    place = read_place(folder)
    assert place.remarks[0] == Unfinished()
    assert (place.made_at.hour, place.made_at.minute) == (12, 5)
    write_place(folder, place)
    assert list_places(root)[0].state == "whole"


def test_captures_have_folders_of_their_own(kept: Path) -> None:
    first = new_capture_folder(kept)
    assert first == kept / "capture"
    first.mkdir()
    assert new_capture_folder(kept) == first
    (first / "session.json").write_text("{}", "utf-8")
    second = new_capture_folder(kept)
    assert second == kept / "capture-2"
    second.mkdir()
    (second / "session.json").write_text("{}", "utf-8")
    os.utime(first / "session.json", (1, 1))
    assert capture_folders(kept) == (first, second)


def test_hundred_places_are_listed_at_once(root: Path) -> None:
    for number in range(100):
        folder = root / f"2026-06-21-1205-x-{number}"
        folder.mkdir(parents=True)
        (folder / "place.json").write_bytes(
            b'{"name": "x", "made_at": "2026-06-21T12:00:00+00:00"}'
        )
        (folder / "environment.exr").write_bytes(b"x" * 1000)
    opened: list[str] = []
    read = Path.open

    def counted(self: Path, *args: Any, **more: Any) -> Any:
        opened.append(self.name)
        return read(self, *args, **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "open", counted)
        assert len(list_places(root)) == 100
    # One small file of each and no light at all: the time goes with the number of places alone.
    assert opened == ["place.json"] * 100
