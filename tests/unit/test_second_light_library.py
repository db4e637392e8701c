"""The library of captured lamps: kept exactly, never lost, salvaged; and what can be compared."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from app.core.base.errors import CoreError
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, make_lamp
from app.core.second_light.captured_lamps.lamp_capture import read_lamp_file
from app.core.second_light.captured_lamps.lamp_library import (
    add_lamp,
    delete_lamp,
    lamps_folder,
    list_lamps,
    read_lamp,
    rename_lamp,
    restore_lamp,
    update_lamp,
)
from app.core.second_light.place_brightness import Unknown, compare, with_lux
from app.words.lamps import comparison_words
from tests.helpers.dark_room import phone, room

SHAPE = (64, 128)


def lamp(seed: int = 0, white: float | None = 123.4567) -> CapturedLamp:
    light, truth = room(phone(0.15, 40.0), 0.05, shape=SHAPE, seed=seed)
    alpha = truth.astype(np.float32)
    alpha[0, 0] = 0.25
    return make_lamp(
        "any", light, alpha, title="My phone", white_cd_m2=white, distance_m=0.15, camera="THETA V"
    )


def same(one: CapturedLamp, other: CapturedLamp) -> bool:
    words = ("name", "title", "white_cd_m2", "distance_m", "camera")
    return all(getattr(one, key) == getattr(other, key) for key in words) and bool(
        np.array_equal(one.radiance, other.radiance) and np.array_equal(one.alpha, other.alpha)
    )


def test_a_lamp_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    folder = tmp_path / "lamps"
    kept = add_lamp(folder, lamp())
    assert kept.name == "my-phone"
    assert same(read_lamp(folder, "my-phone"), kept)
    assert same(read_lamp(folder, "MY PHONE"), kept)
    (entry,), damaged = list_lamps(folder)
    assert not damaged
    assert (entry.name, entry.title, entry.distance_m) == ("my-phone", "My phone", 0.15)
    assert entry.lux == pytest.approx(kept.lux)
    assert entry.picture is not None
    picture = np.asarray(oiio.ImageBuf(str(entry.picture)).get_pixels("uint8"))
    assert picture.shape == (256, 256, 3)
    # The lamp is in the middle and white, the room around it dark.
    assert picture[118:138, 118:138].min() > 200
    assert picture[:10, :10].max() < 100


def test_captures_are_rgba_that_others_can_read(tmp_path: Path) -> None:
    kept = add_lamp(tmp_path, lamp())
    (file,) = tmp_path.glob("*.exr")
    assert tuple(oiio.ImageBuf(str(file)).spec().channelnames) == ("R", "G", "B", "A")
    capture = read_lamp_file(file)
    again = capture.lamp
    assert (capture.warnings, capture.mask) == ((), None)
    np.testing.assert_array_equal(again.radiance, kept.radiance)
    np.testing.assert_array_equal(again.alpha, kept.alpha)
    assert again.white_cd_m2 == pytest.approx(kept.white_cd_m2)


def test_names_are_new_and_never_those_of_kinds(tmp_path: Path) -> None:
    titles = [add_lamp(tmp_path, lamp(), title).title for title in ("Phone", "phone", "Fläche 2")]
    assert titles == ["Phone", "phone 2", "Fläche 2"]
    names = [entry.name for entry in list_lamps(tmp_path)[0]]
    assert sorted(names) == ["flache-2", "my-phone", "phone-2"]
    for bad, words in (("", "name is missing"), (" \n", "name is missing"), ("x" * 99, "longer")):
        with pytest.raises(CoreError, match=words):
            add_lamp(tmp_path, replace(lamp(), title=bad))


def test_deleted_lamps_come_back(tmp_path: Path) -> None:
    kept = add_lamp(tmp_path, lamp())
    gone = delete_lamp(tmp_path, "my-phone")
    assert list_lamps(tmp_path) == ((), ())
    with pytest.raises(CoreError, match="no lamp 'my-phone'"):
        read_lamp(tmp_path, "my-phone")
    other = add_lamp(tmp_path, lamp(1))
    back = restore_lamp(tmp_path, gone)
    assert (other.name, back.name, back.title) == ("my-phone", "my-phone-2", "My phone 2")
    np.testing.assert_array_equal(read_lamp(tmp_path, back.name).radiance, kept.radiance)


def test_renaming_keeps_the_name_in_files(tmp_path: Path) -> None:
    add_lamp(tmp_path, lamp())
    add_lamp(tmp_path, lamp(1), "Other")
    assert rename_lamp(tmp_path, "my-phone", "Tablet").name == "my-phone"
    assert read_lamp(tmp_path, "tablet").title == "Tablet"
    with pytest.raises(CoreError, match="already taken"):
        rename_lamp(tmp_path, "my-phone", "OTHER")


def test_corrected_lamps_leave_the_old_one_in_the_trash(tmp_path: Path) -> None:
    kept = add_lamp(tmp_path, lamp())
    alpha = kept.alpha.copy()
    alpha[0, 0] = 0.0
    corrected = replace(kept, alpha=alpha)
    update_lamp(tmp_path, corrected)
    assert same(read_lamp(tmp_path, kept.name), corrected)
    assert len(list(tmp_path.glob("*.exr"))) == 1
    assert same(read_lamp(tmp_path / "trash" / kept.name, kept.name), kept)


def test_a_full_disk_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = add_lamp(tmp_path, lamp())
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(CoreError, match="not saved"):
        add_lamp(tmp_path, lamp(2), "New")
    with pytest.raises(CoreError, match="not saved"):
        rename_lamp(tmp_path, kept.name, "Other")
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir() if p.is_file()} == before


def test_a_damaged_text_is_salvaged_from_the_capture(tmp_path: Path) -> None:
    kept = add_lamp(tmp_path, lamp())
    text = tmp_path / "my-phone.json"
    whole = text.read_bytes()
    for damage in (whole[:60], b"\0" * 50, whole.replace(b"sha256", b"sha25x"), None):
        text.unlink() if damage is None else text.write_bytes(damage)
        (entry,), bad = list_lamps(tmp_path)
        assert not bad
        again = read_lamp(tmp_path, "my-phone")
        np.testing.assert_array_equal(again.radiance, kept.radiance)
        np.testing.assert_array_equal(again.alpha, kept.alpha)
        assert again.white_cd_m2 == pytest.approx(kept.white_cd_m2)
        if damage is None or damage[0] == 0:
            assert entry.damage is not None
            assert again.distance_m is None


def test_a_damaged_capture_is_said_and_left(tmp_path: Path) -> None:
    add_lamp(tmp_path, lamp())
    (file,) = tmp_path.glob("*.exr")
    data = bytearray(file.read_bytes())
    data[-9] ^= 0x40
    file.write_bytes(data)
    with pytest.raises(CoreError, match="checksum"):
        read_lamp(tmp_path, "my-phone")
    file.write_bytes(data[:1000])
    with pytest.raises(CoreError, match="damaged"):
        read_lamp(tmp_path, "my-phone")
    file.unlink()
    (damaged,) = list_lamps(tmp_path)[1]
    assert "missing" in damaged.reason


def test_nothing_outside_the_folder_is_touched(tmp_path: Path) -> None:
    folder = tmp_path / "lamps"
    add_lamp(folder, lamp())
    (tmp_path / "secret-0123456789ab.exr").write_bytes(b"secret")
    text = folder / "my-phone.json"
    facts = json.loads(text.read_text())
    text.write_text(json.dumps({**facts, "sha256": "../secret"}))
    assert read_lamp(folder, "my-phone").title == "My phone"
    for name in ("../secret", "my-phone/../x", ""):
        with pytest.raises(CoreError, match="no lamp"):
            read_lamp(folder, name)


def test_newer_texts_are_not_guessed(tmp_path: Path) -> None:
    add_lamp(tmp_path, lamp())
    text = tmp_path / "my-phone.json"
    text.write_text(json.dumps({**json.loads(text.read_text()), "format": 9}))
    assert "newer" in list_lamps(tmp_path)[1][0].reason


def test_the_folder_is_the_users_own(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path))
    assert lamps_folder() == tmp_path / "lamps"
    assert list_lamps(lamps_folder()) == ((), ())


def test_light_is_added_only_where_both_scales_are_known() -> None:
    known, unknown = lamp(), lamp(white=None)
    assert compare(50.0, known).possible
    assert comparison_words(compare(50.0, known)) == ""
    verdict = compare(50.0, unknown)
    assert not verdict.possible
    assert "The brightness of “My phone”" in comparison_words(verdict)
    assert "light meter" in comparison_words(verdict)
    verdict = compare(None, known)
    assert not verdict.possible
    assert "in lux" in comparison_words(verdict)
    assert compare(None, unknown).unknown is Unknown.BOTH


def test_other_cameras_are_told() -> None:
    assert compare(50.0, lamp(), place_camera="THETA X").cameras == ("THETA V", "THETA X")
    assert compare(50.0, lamp(), place_camera="theta v").cameras is None
    assert compare(50.0, replace(lamp(), camera="")).cameras is None


def test_a_meter_reading_gives_the_scale() -> None:
    metered = with_lux(lamp(white=None), 70.0)
    assert metered.lux == pytest.approx(70.0)
    assert compare(50.0, metered).possible
    for lux in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(CoreError, match="No lamp gives"):
            with_lux(lamp(), lux)
