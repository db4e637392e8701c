"""The light of a place: what is read again is what was in memory, to the last bit."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as limits
from hypothesis import strategies as st
from numpy.typing import NDArray

from app.core.base.colour import luminance
from app.core.base.imaging.image_input import open_image
from app.core.base.imaging.images import write_exr
from app.core.environment.environment import Environment, from_radiance, reduce
from app.core.environment.environment_file import read_panorama
from app.core.places.files import light as light_module
from app.core.places.files.light import fingerprint_of, read_light, storable, store_environment
from app.core.places.place import Place, PlaceError
from app.core.places.place_folder import create_place, drop_merged, read_place, write_place
from app.core.places.place_list import list_places
from app.core.places.remarks import LightChanged
from app.core.places.saved.result_json import results_to_json
from app.core.second_light.place_brightness import stated_white
from app.core.solver.solve import solve_all
from app.core.styles.style_pack_file import load_named_pack

SHARED = limits(
    suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=30
)


def some_light(seed: int = 1, rows: int = 64) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    values: NDArray[np.float32] = rng.gamma(0.2, size=(rows, 2 * rows, 3)).astype(np.float32)
    return values


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return create_place(tmp_path / "places", "Court", datetime(2026, 6, 21, 12, tzinfo=UTC))


def keep(folder: Path, radiance: NDArray[np.float32]) -> Place:
    stored = store_environment(folder, radiance)
    place = replace(
        read_place(folder), environment=stored.environment, fingerprint=stored.fingerprint
    )
    write_place(folder, place)
    return place


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@SHARED
@given(st.integers(0, 2**32 - 1), st.integers(8, 40))
def test_any_bits_of_light_come_back(tmp_path: Path, seed: int, rows: int) -> None:
    # Any bit pattern that is a finite number from 0 up: subnormal ones and 1e38 among them.
    rng = np.random.default_rng(seed)
    bits = rng.integers(0, 0x7F7FFFFF, size=(rows, 2 * rows, 3), dtype=np.uint32)
    radiance = bits.view(np.float32)
    stored = store_environment(tmp_path, radiance)
    place = Place("x", datetime.now(UTC), stored.environment, stored.fingerprint)
    environment, remarks = read_light(tmp_path, place)
    assert remarks == ()
    assert environment.radiance.tobytes() == radiance.tobytes()


def test_half_floats_would_not_do() -> None:
    # Why 32 bits: the same light through half floats is another light.
    radiance = some_light()
    assert not np.array_equal(radiance.astype(np.float16).astype(np.float32), radiance)


def test_reopened_place_gives_identical_numbers(folder: Path) -> None:
    pack = load_named_pack("generic")

    def answers(environment: Environment) -> list[dict[str, Any]]:
        light = luminance(reduce(environment)).astype(np.float64)
        return results_to_json(solve_all(pack, light, front_deg=33.3))

    memory = from_radiance(some_light(), "Court")
    before = answers(memory)
    keep(folder, memory.radiance)
    again, remarks = read_light(folder, read_place(folder))
    assert remarks == ()
    assert again.name == "Court"
    assert again.repairs.total == 0
    assert answers(again) == before


def test_light_is_not_changed_by_keeping_it(folder: Path) -> None:
    radiance = some_light()
    radiance.flags.writeable = False
    keep(folder, radiance)
    assert np.array_equal(radiance, some_light())


def test_light_that_is_not_in_one_piece(folder: Path) -> None:
    wide = np.concatenate([some_light(), some_light(2)], axis=2)[..., 1:4]
    assert not wide.flags.c_contiguous
    place = keep(folder, wide)
    assert np.array_equal(read_light(folder, place)[0].radiance, wide)
    assert place.fingerprint == fingerprint_of(np.ascontiguousarray(wide))


def test_new_light_does_not_replace_the_old_one(folder: Path) -> None:
    first = keep(folder, some_light(1))
    second = store_environment(folder, some_light(2))
    # Until the place says so, it has the light it had; and afterwards the old one is still there.
    assert np.array_equal(read_light(folder, read_place(folder))[0].radiance, some_light(1))
    assert second.environment != first.environment
    keep(folder, some_light(2))
    assert np.array_equal(read_light(folder, read_place(folder))[0].radiance, some_light(2))
    assert (folder / first.environment).is_file()


def test_same_light_twice_is_one_file(folder: Path) -> None:
    keep(folder, some_light())
    before = names(folder)
    keep(folder, some_light())
    assert names(folder) == before


def test_fingerprint_knows_size_and_bits() -> None:
    light = some_light()
    other = light.copy()
    other[5, 5, 1] = np.nextafter(other[5, 5, 1], np.float32(9))
    assert len({fingerprint_of(x) for x in (light, other, light.reshape(32, 256, 3))}) == 3
    # By hand: it must stay the same on every computer and in every version.
    by_hand = hashlib.sha256(b"(1, 2, 3)" + b"\x00\x00\x80\x3f" * 6).hexdigest()
    assert fingerprint_of(np.ones((1, 2, 3), np.float32)) == by_hand


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0, -np.inf])
def test_light_that_would_be_repaired_when_read_is_refused(folder: Path, bad: float) -> None:
    radiance = some_light()
    radiance[3, 4, 1] = bad
    with pytest.raises(PlaceError, match="not saved"):
        store_environment(folder, radiance)
    assert names(folder) == ["place.json"]


@pytest.mark.parametrize(
    "radiance",
    [
        np.zeros((16, 32, 3), np.float32),
        np.ones((16, 33, 3), np.float32),
        np.ones((4, 8, 3), np.float32),
        np.ones((16, 32), np.float32),
        np.ones((16, 32, 4), np.float32),
        np.ones((16, 32, 3), np.float64),
        np.ones((0, 0, 3), np.float32),
    ],
    ids=["black", "not 2:1", "small", "grey", "alpha", "double", "empty"],
)
def test_what_cannot_be_read_again_is_refused(folder: Path, radiance: NDArray[np.float32]) -> None:
    with pytest.raises(PlaceError, match="not saved"):
        store_environment(folder, radiance)
    assert names(folder) == ["place.json"]


def test_disk_that_lies_is_found_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def flawed(path: Path, picture: NDArray[np.float32], *rest: Any, **more: Any) -> None:
        wrong = picture.copy()
        wrong[0, 0, 0] += 1.0
        write_exr(path, wrong, *rest, **more)

    monkeypatch.setattr(light_module, "write_exr", flawed)
    with pytest.raises(PlaceError, match="returned different data"):
        store_environment(folder, some_light())
    assert names(folder) == ["place.json"]


def test_full_disk_is_a_sentence(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(PlaceError, match=r"no space left.*still in memory"):
        store_environment(folder, some_light())
    assert names(folder) == ["place.json"]


# -- reading -----------------------------------------------------------------------------------


def test_place_without_light(folder: Path) -> None:
    with pytest.raises(PlaceError, match=r"at “Court” yet\. Capture the place"):
        read_light(folder, read_place(folder))


def test_missing_light_names_the_next_step(folder: Path) -> None:
    place = keep(folder, some_light())
    (folder / place.environment).unlink()
    with pytest.raises(PlaceError, match=r"is missing.* Capture the place"):
        read_light(folder, place)
    (folder / "originals").mkdir()
    (folder / "originals" / "R1.JPG").write_bytes(b"x")
    with pytest.raises(PlaceError, match=r"The originals are in"):
        read_light(folder, place)
    (folder / "capture" / "originals").mkdir(parents=True)
    (folder / "capture" / "session.json").write_text("{}", "utf-8")
    with pytest.raises(PlaceError, match=r"camera’s files are still here"):
        read_light(folder, place)


@pytest.mark.parametrize("content", [b"", b"x" * 100, b"\x76\x2f\x31\x01" + b"\0" * 50])
def test_damaged_light_is_a_sentence(folder: Path, content: bytes) -> None:
    place = keep(folder, some_light())
    (folder / place.environment).write_bytes(content)
    with pytest.raises(PlaceError, match="The light of “Court” cannot be read"):
        read_light(folder, place)


def test_cut_off_light_is_a_sentence(folder: Path) -> None:
    place = keep(folder, some_light())
    whole = (folder / place.environment).read_bytes()
    (folder / place.environment).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(PlaceError, match="cannot be read"):
        read_light(folder, place)


def test_light_that_was_changed_outside_is_said(folder: Path) -> None:
    place = keep(folder, some_light(1))
    write_exr(folder / place.environment, some_light(2))
    environment, remarks = read_light(folder, place)
    assert np.array_equal(environment.radiance, some_light(2))
    assert isinstance(remarks[0], LightChanged)


@pytest.mark.parametrize("name", ["../../light.exr", "/etc/passwd", "environment/../x.exr"])
def test_no_way_out_of_the_folder(folder: Path, name: str) -> None:
    place = replace(read_place(folder), environment=name)
    with pytest.raises(PlaceError, match="invalid file name"):
        read_light(folder, place)


# -- thumbnails --------------------------------------------------------------------------------


def test_thumbnail_is_the_panorama_made_small(folder: Path) -> None:
    display = np.zeros((512, 1024, 3), np.uint8)
    display[:, :512] = (200, 100, 50)
    stored = store_environment(folder, some_light(), display)
    assert stored.thumbnail == folder / "thumbnail.png"
    assert list_places(folder.parent)[0].thumbnail == stored.thumbnail
    picture = cv2.imread(str(stored.thumbnail))
    assert picture is not None
    assert picture.shape == (256, 512, 3)
    assert picture[128, 100].tolist() == [50, 100, 200]
    assert picture[128, 400].tolist() == [0, 0, 0]


def test_thumbnail_is_made_of_the_light_where_no_picture_is_given(folder: Path) -> None:
    radiance = np.full((64, 128, 3), 0.01, np.float32)
    radiance[:, 64:] = 1.0
    picture = cv2.imread(str(store_environment(folder, radiance).thumbnail))
    assert picture is not None
    assert picture[:, :200].mean() + 50 < picture[:, 300:].mean()


def test_thumbnail_that_cannot_be_written_costs_nothing_else(folder: Path) -> None:
    (folder / "thumbnail.png").mkdir()
    stored = store_environment(folder, some_light())
    assert stored.thumbnail is None
    assert (folder / stored.environment).is_file()
    assert list_places(folder.parent)[0].thumbnail is None


def sunny(largest: float) -> NDArray[np.float32]:
    radiance = some_light()
    radiance[10:12, 40:44] = largest
    return radiance


@pytest.mark.parametrize("largest", [0.03, 1.0, 30.0, 65504.0, 4e5, 1e9])
def test_new_light_is_saved_in_half_the_bits_and_comes_back_whole(
    folder: Path, largest: float
) -> None:
    measured = sunny(largest) if largest > 1 else np.minimum(some_light(), np.float32(largest))
    light = storable(measured)
    place = keep(folder, light)
    again, remarks = read_light(folder, place)
    assert remarks == ()
    assert again.radiance.tobytes() == light.tobytes()
    assert storable(light).tobytes() == light.tobytes()
    # Half floats have 11 bits, and 2**-14 is the smallest number that has them all.
    seen = measured > (2.0**-14 if 1.0 <= largest <= 2.0**15 else largest * 2.0**-28)
    assert np.abs(light[seen] / measured[seen] - 1.0).max() <= 2.0**-11
    source = open_image(folder / place.environment)
    assert source is not None
    with contextlib.closing(source):
        assert str(source.spec().format) == "half"
        assert source.spec().getattribute("compression") == "piz"


def test_other_programs_read_the_same_luminance(folder: Path) -> None:
    light = storable(sunny(4e5))
    stored = store_environment(folder, light, white_cd_m2=120.0)
    file = folder / stored.environment
    white = stated_white(file)
    assert white is not None
    in_file = read_panorama(file).radiance
    assert in_file.max() < 65504.0
    assert np.allclose(in_file * np.float32(white), light * np.float32(120.0), rtol=1e-6)


def test_light_of_a_place_from_before_stays_as_it_is(folder: Path) -> None:
    radiance = sunny(4e5)
    write_exr(folder / "environment-0123456789ab.exr", radiance)
    old = Place("x", datetime.now(UTC), "environment-0123456789ab.exr", fingerprint_of(radiance))
    light, remarks = read_light(folder, old)
    assert remarks == ()
    assert light.radiance.tobytes() == radiance.tobytes()
    # Saved elsewhere it still has every bit.
    again, _ = read_light(folder, keep(folder, light.radiance))
    assert again.radiance.tobytes() == radiance.tobytes()


def test_a_capture_leaves_one_copy_of_its_light(folder: Path) -> None:
    session = folder / "capture"
    (session / "originals").mkdir(parents=True)
    (session / "session.json").write_text("{}")
    (session / "environment.exr").write_bytes(b"light")
    drop_merged(folder)
    assert (session / "environment.exr").exists()
    (session / "originals" / "R1.JPG").write_bytes(b"frame")
    drop_merged(folder)
    assert names(session) == ["originals", "session.json"]
