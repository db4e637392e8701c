"""Places whose files were damaged, or kept by a newer version: what is fit is kept."""

from __future__ import annotations

import json
import math
import os
from dataclasses import replace
from datetime import UTC
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.places.place_folder import create_place, read_place, write_place
from app.core.places.place_list import list_places
from app.core.places.remarks import PartLost
from app.core.places.saved.place_json import to_json
from app.words.remarks import sentences
from tests.helpers.cases import sample_first
from tests.unit.test_places_store import NOON, POSIX, SHARED, full_place


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


# -- newer versions ----------------------------------------------------------------------------


def test_what_a_newer_version_wrote_survives(kept: Path) -> None:
    facts = json.loads((kept / "place.json").read_text("utf-8"))
    facts["format_version"] = 7
    facts["optics"] = {"k1": [0.1, None]}
    facts["location"]["street"] = "Rue X"
    facts["capture"]["frames"][0]["lens"] = "left"
    facts["results"][1]["ratio"] = 2.5
    (kept / "place.json").write_text(json.dumps(facts), "utf-8")
    place = read_place(kept)
    assert place.name == "Café de l’Été"
    assert any("newer version of Turnlight" in remark for remark in sentences(place.remarks))
    assert list_places(kept.parent)[0].state == "newer"
    write_place(kept, replace(place, notes="new", location=replace(place.location, sun=False)))
    facts["notes"] = "new"
    facts["location"]["sun"] = False
    assert json.loads((kept / "place.json").read_text("utf-8")) == facts
    # A change and its undoing end where they began.
    write_place(kept, replace(place, notes=full_place().notes))
    assert json.loads((kept / "place.json").read_text("utf-8"))["notes"] == full_place().notes


def test_a_file_without_newer_entries_is_written_as_this_version_does(kept: Path) -> None:
    before = (kept / "place.json").read_bytes()
    write_place(kept, read_place(kept))
    assert (kept / "place.json").read_bytes() == before


# -- damage ------------------------------------------------------------------------------------

DAMAGE: dict[str, list[Any]] = {
    "name": [None, 3, [], "x" * 5000],
    "made_at": [None, "yesterday", "2026-06-21T12:00:00", "9999-12-31T23:00:00-12:00", 5],
    "environment": ["../x.exr", "/etc/passwd", "environment/../x.exr", "notes.txt", None, "a\0"],
    "fingerprint": ["short", None, 5],
    "measured_at": ["later", 5],
    "front_deg": ["12", None, True, math.nan, math.inf, 1e9],
    "head": [None, 7, {}],
    "notes": [None, ["a"], 5],
    "tags": [None, "north", [5], ["x" * 500], ["y"] * 1000],
    "location": [[], 5, {"kind": "sea"}, {"sun": "yes"}, {"latitude_deg": 91}],
    "asked": [5, {}, {"head": "generic", "objective": "best"}],
    "results": [{}, 5, [5], [{"name": "x"}]],
    "chosen": [5, []],
    "needle_deg": ["x", math.nan],
    "goal_deg": [[], math.inf],
    "capture": [[], 5, {"frames": 5}, {"frames": [{}]}, {"warnings": [5]}, {"camera": None}],
    "spot": [None, 5],
}


_FIRST = [(key, values[0]) for key, values in DAMAGE.items()]
_FURTHER = [(key, value) for key, values in DAMAGE.items() for value in values[1:]]


@pytest.mark.slow
@pytest.mark.parametrize(("key", "value"), _FIRST + sample_first(_FURTHER, 0))
def test_unfit_field_costs_that_field_only(kept: Path, key: str, value: object) -> None:
    facts = json.loads((kept / "place.json").read_text("utf-8"))
    damaged = json.dumps(facts | {key: value}).encode()
    (kept / "place.json").write_bytes(damaged)
    place = read_place(kept)
    assert len(place.remarks) >= 2, place.remarks
    assert "could not be read" in sentences(place.remarks)[0]
    assert "place.json.bak" in sentences(place.remarks)[1]
    assert (kept / "place.json.bak").read_bytes() == damaged
    again = to_json(replace(place, source=None))
    for other in set(facts) - {key}:
        assert again[other] == facts[other], other
    # Once written, it is whole again.
    write_place(kept, place)
    assert read_place(kept).remarks == ()
    if key not in ("name", "made_at"):
        write_place(kept, replace(read_place(kept), notes="x"))
        assert list_places(kept.parent)[0].state == "whole"


def test_lost_name_of_the_light_is_found_again(kept: Path) -> None:
    facts = json.loads((kept / "place.json").read_text("utf-8"))
    (kept / "place.json").write_text(json.dumps(facts | {"environment": 5}), "utf-8")
    place = read_place(kept)
    assert place.environment == "environment-0123456789ab.exr"
    assert "was found in" in sentences(place.remarks)[-1]


def test_light_of_another_name_is_not_taken_for_ours(kept: Path) -> None:
    (kept / "environment-0123456789ab.exr").rename(kept / "environment of mine.exr")
    (kept / "place.json").write_bytes(b"{")
    place = read_place(kept)
    assert place.environment == ""
    write_place(kept, place)


def test_bad_results_are_dropped_one_by_one(kept: Path) -> None:
    facts = json.loads((kept / "place.json").read_text("utf-8"))
    facts["results"][1]["match"] = "high"
    (kept / "place.json").write_text(json.dumps(facts), "utf-8")
    place = read_place(kept)
    assert [each.name for each in place.results] == [
        facts["results"][0]["name"],
        facts["results"][2]["name"],
    ]
    assert "1 of 3 results" in sentences(place.remarks)[0]
    write_place(kept, place)
    assert read_place(kept).remarks == ()


@pytest.mark.parametrize("share", [0.005, 0.02, 0.05, 0.2, 0.9, 0.9999])
def test_cut_off_file_leaves_the_light_and_what_the_folder_says(kept: Path, share: float) -> None:
    whole = (kept / "place.json").read_bytes()
    (kept / "place.json").write_bytes(whole[: int(len(whole) * share)])
    listed = list_places(kept.parent)[0]
    assert listed.state == "damaged"
    assert isinstance(listed.trouble, PartLost)
    assert "damaged or incomplete" in listed.trouble.why
    assert listed.folder == kept
    place = read_place(kept)
    assert "place.json.bak" in "".join(sentences(place.remarks))
    assert place.made_at.astimezone(UTC).year == 2026
    assert place.name == "cafe"
    assert place.environment == "environment-0123456789ab.exr"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "it is empty"),
        (b"\0" * 512, "it is empty"),
        (b"[1, 2]", "it has the wrong content"),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", "it is not plain text"),
        (b'{"a":' * 5000, "nested too deeply"),
        (b"x" * (17 << 20), "far too large"),
    ],
    ids=["empty", "zeros", "list", "picture", "deep", "huge"],
)
def test_file_that_is_something_else(kept: Path, content: bytes, words: str) -> None:
    (kept / "place.json").write_bytes(content)
    listed = list_places(kept.parent)[0]
    assert listed.state == "damaged"
    assert words in str(listed.trouble)
    assert listed.name == "cafe"
    assert listed.has_light
    place = read_place(kept)
    assert words in sentences(place.remarks)[0]
    assert (kept / "place.json.bak").stat().st_size == len(content)
    assert place.name == "cafe"
    assert place.made_at.hour == 12
    assert place.environment == "environment-0123456789ab.exr"
    write_place(kept, place)
    assert read_place(kept).remarks == ()
    assert list_places(kept.parent)[0].state == "whole"


def test_deep_nesting_is_damage(kept: Path) -> None:
    facts = json.loads((kept / "place.json").read_text("utf-8"))
    deep: Any = 1
    for _ in range(60):
        deep = [deep]
    (kept / "place.json").write_text(json.dumps(facts | {"notes": deep}), "utf-8")
    place = read_place(kept)
    assert place.notes == ""
    assert "nested too deeply" in sentences(place.remarks)[0]
    assert "place.json.bak" in sentences(place.remarks)[1]


@pytest.mark.slow
@SHARED
@given(st.binary(max_size=60), st.integers(0, 10**6), st.integers(0, 200))
def test_no_damage_makes_it_fail(tmp_path: Path, patch: bytes, where: int, cut: int) -> None:
    folder = tmp_path / "places" / "2026-06-21-1205-x"
    folder.mkdir(parents=True, exist_ok=True)
    write_place(folder, replace(full_place(), results=full_place().results[:1]))
    whole = (folder / "place.json").read_bytes()
    where %= len(whole)
    (folder / "place.json").write_bytes(whole[:where] + patch + whole[where + cut :])
    listed = list_places(tmp_path / "places")
    assert [each.folder for each in listed] == [folder]
    place = read_place(folder)
    write_place(folder, place)
    assert read_place(folder).remarks == ()
    for path in folder.iterdir():
        path.unlink()


@POSIX
@pytest.mark.parametrize("kind", ["pipe", "folder", "device"])
def test_place_file_that_is_no_file(kept: Path, kind: str) -> None:
    (kept / "place.json").unlink()
    if kind == "pipe":
        os.mkfifo(kept / "place.json")
    elif kind == "folder":
        (kept / "place.json").mkdir()
    else:
        (kept / "place.json").symlink_to("/dev/zero")
    listed = list_places(kept.parent)[0]
    assert listed.state == "damaged"
    assert "not an ordinary file" in str(listed.trouble)
    assert read_place(kept).environment == "environment-0123456789ab.exr"
