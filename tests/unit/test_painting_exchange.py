"""Styles handed to a friend: whole, bounded, and nothing inside the file decides where it goes."""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.core.base.errors import CoreError, StyleError
from app.core.painting.canvas import make_canvas
from app.core.painting.user_style import UserStyle, write_layers
from app.core.painting.user_styles import (
    EXPORT_ENDING,
    export_style,
    import_style,
    list_user_styles,
    save_user_style,
)


@pytest.fixture
def style(tmp_path: Path) -> UserStyle:
    rng = np.random.default_rng(0)
    canvas = make_canvas(rng.uniform(-1, 1, (32, 32)), rng.random((32, 32)))
    return save_user_style(tmp_path / "mine", canvas, "My look", side="left", note="Soft.")


def exported(style: UserStyle, tmp_path: Path) -> Path:
    file = tmp_path / f"look{EXPORT_ENDING}"
    export_style(style, file, replace=True)
    return file


def members(file: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(file: Path, parts: list[tuple[str, bytes]], method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, data in parts:
            archive.writestr(name, data)
    return file


def refused(folder: Path, file: Path) -> str:
    with pytest.raises(StyleError) as found:
        import_style(folder, file)
    assert not folder.exists()
    return str(found.value)


def test_there_and_back(style: UserStyle, tmp_path: Path) -> None:
    file = exported(style, tmp_path)
    friend = tmp_path / "friend"
    one, two = import_style(friend, file), import_style(friend, file)
    np.testing.assert_array_equal(one.weights, style.weights)
    np.testing.assert_array_equal(one.ignore, style.ignore)
    assert (one.title, one.side, one.note) == ("My look", "left", "Soft.")
    assert (two.name, two.title) == ("my-look-2", "My look 2")
    assert len(list_user_styles(friend)[0]) == 2
    assert members(file).keys() == {"style.toml", "weights.exr"}


def test_the_same_style_gives_the_same_file(style: UserStyle, tmp_path: Path) -> None:
    parts = members(exported(style, tmp_path))
    again = members(exported(style, tmp_path))
    assert parts["style.toml"] == again["style.toml"]


def test_a_file_is_replaced_only_when_asked(style: UserStyle, tmp_path: Path) -> None:
    file = tmp_path / "letter.txt"
    file.write_text("dear", encoding="utf-8")
    with pytest.raises(StyleError, match="already exists"):
        export_style(style, file)
    assert file.read_text(encoding="utf-8") == "dear"
    with pytest.raises(CoreError, match="does not exist"):
        export_style(style, tmp_path / "no" / "where.turnstyle")


def test_paths_inside_mean_nothing(style: UserStyle, tmp_path: Path) -> None:
    parts = members(exported(style, tmp_path))
    for name in ("../weights.exr", "/weights.exr", "a/weights.exr", "WEIGHTS.EXR"):
        file = tmp_path / "evil.turnstyle"
        packed(file, [("style.toml", parts["style.toml"]), (name, parts["weights.exr"])])
        assert "not an exported style" in refused(tmp_path / "friend", file)
    assert not (tmp_path / "weights.exr").exists()


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_other_members_are_refused(style: UserStyle, tmp_path: Path) -> None:
    parts = list(members(exported(style, tmp_path)).items())
    for wrong in (parts[:1], [*parts, ("more.txt", b"")], [*parts, parts[0]], []):
        refused(tmp_path / "friend", packed(tmp_path / "wrong.turnstyle", wrong))


def test_zip_bombs_are_refused(style: UserStyle, tmp_path: Path) -> None:
    text = members(exported(style, tmp_path))["style.toml"]
    bomb = packed(
        tmp_path / "bomb.turnstyle", [("style.toml", text), ("weights.exr", bytes(50_000_000))]
    )
    assert bomb.stat().st_size < 100_000
    refused(tmp_path / "friend", bomb)
    # One that lies about its size: the directory says 1,000 bytes.
    lying = bytearray(bomb.read_bytes())
    size = struct.pack("<I", 50_000_000)
    while (place := lying.find(size)) >= 0:
        lying[place : place + 4] = struct.pack("<I", 1000)
    bomb.write_bytes(lying)
    refused(tmp_path / "friend", bomb)


def test_large_files_are_not_read(tmp_path: Path) -> None:
    file = tmp_path / "large.turnstyle"
    with file.open("wb") as stream:
        stream.truncate(200_000_000)
    assert "too large" in refused(tmp_path / "friend", file)


def test_unknown_methods_are_refused(style: UserStyle, tmp_path: Path) -> None:
    parts = list(members(exported(style, tmp_path)).items())
    refused(tmp_path / "friend", packed(tmp_path / "x.turnstyle", parts, zipfile.ZIP_LZMA))


def test_newer_and_mixed_up_styles_are_said(style: UserStyle, tmp_path: Path) -> None:
    parts = members(exported(style, tmp_path))
    newer = parts["style.toml"].replace(b"format = 1", b"format = 7")
    file = packed(
        tmp_path / "n.turnstyle", [("style.toml", newer), ("weights.exr", parts["weights.exr"])]
    )
    assert "(format 7)" in refused(tmp_path / "friend", file)
    other = tmp_path / "other.exr"
    write_layers(other, style.weights[::-1], style.ignore)
    mixed = [("style.toml", parts["style.toml"]), ("weights.exr", other.read_bytes())]
    file = packed(tmp_path / "m.turnstyle", mixed)
    assert "damaged" in refused(tmp_path / "friend", file)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1.5, -2.0])
def test_numbers_that_are_no_weights_are_refused(
    style: UserStyle, tmp_path: Path, value: float
) -> None:
    parts = members(exported(style, tmp_path))
    weights = style.weights.copy()
    weights[3, 3] = value
    bad = tmp_path / "bad.exr"
    write_layers(bad, weights, style.ignore)
    members_now = [("style.toml", parts["style.toml"]), ("weights.exr", bad.read_bytes())]
    file = packed(tmp_path / "b.turnstyle", members_now)
    assert "not painted weights" in refused(tmp_path / "friend", file)


def test_things_that_are_not_there_or_not_files(tmp_path: Path) -> None:
    assert "no file" in refused(tmp_path / "friend", tmp_path / "nothing")
    assert "no file" in refused(tmp_path / "friend", tmp_path)


@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data())
def test_damaged_files_end_in_a_sentence(
    style: UserStyle, tmp_path: Path, data: st.DataObject
) -> None:
    whole = exported(style, tmp_path).read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    value = data.draw(st.binary(min_size=1, max_size=8))
    cut = data.draw(st.booleans())
    file = tmp_path / "damaged.turnstyle"
    file.write_bytes(whole[:place] + (b"" if cut else value + whole[place + len(value) :]))
    try:
        taken = import_style(tmp_path / "friend", file)
    except StyleError:
        return
    np.testing.assert_array_equal(taken.weights, style.weights)


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.binary(max_size=300))
def test_noise_is_no_style(tmp_path: Path, noise: bytes) -> None:
    file = tmp_path / "noise.turnstyle"
    file.write_bytes(noise)
    refused(tmp_path / "friend", file)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("style.toml", noise)
        archive.writestr("weights.exr", b"\x76\x2f\x31\x01" + noise)
    file.write_bytes(stream.getvalue())
    refused(tmp_path / "friend", file)
