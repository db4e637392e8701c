"""What commands refuse before any work: files they read as files to write, pictures without Qt."""

from __future__ import annotations

import ctypes
import os
import sys
import unicodedata
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.commands.shared.arguments import check_outputs
from app.core.base.errors import CoreError
from tests.helpers.hostile_files import write_picture


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "place.exr"
    path.write_bytes(b"light")
    return path


def refused(outputs: list[Path | None], inputs: list[Path], *members: str) -> str:
    with pytest.raises(CoreError) as caught:
        check_outputs(outputs, inputs, members)
    return str(caught.value)


def test_by_name_and_by_way(source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "deep").mkdir()
    assert "one of the input files" in refused([source], [source])
    assert "one of the input files" in refused([tmp_path / "deep" / ".." / "place.exr"], [source])
    monkeypatch.chdir(tmp_path)
    assert "one of the input files" in refused([Path("place.exr")], [source])
    check_outputs([None, tmp_path / "other.exr"], [source])


def test_by_links(source: Path, tmp_path: Path) -> None:
    hard, soft, folder = tmp_path / "hard.exr", tmp_path / "soft.exr", tmp_path / "folder"
    os.link(source, hard)
    soft.symlink_to(source)
    folder.symlink_to(tmp_path)
    for other in (hard, soft, folder / "place.exr"):
        assert "(place.exr)" in refused([other], [source]) or other.name == "place.exr"
        assert "one of the input files" in refused([source], [other])


def test_in_another_case_or_composition(tmp_path: Path) -> None:
    """Some file systems know no difference; where both are there, both are files."""
    name = unicodedata.normalize("NFC", "café.exr")
    source = tmp_path / name
    source.write_bytes(b"light")
    assert "one of the input files" in refused([tmp_path / name.upper()], [source])
    other = unicodedata.normalize("NFD", name)
    assert "one of the input files" in refused([tmp_path / other], [source])


def test_as_a_member_of_a_folder(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    os.link(source, out / "same.exr")
    assert "one of the input files" in refused([source], [tmp_path], ".exr")
    assert "(place.exr)" in refused([out / "same.exr"], [tmp_path], ".exr")
    check_outputs([tmp_path / "new.exr"], [tmp_path], (".exr",))
    check_outputs([source], [tmp_path], (".png",))


def test_two_outputs_are_two_files(tmp_path: Path) -> None:
    assert "twice" in refused([tmp_path / "a.exr", tmp_path / "A.exr"], [])
    (tmp_path / "b.exr").symlink_to(tmp_path / "a.exr")
    assert "twice" in refused([tmp_path / "a.exr", tmp_path / "b.exr"], [])


def test_what_cannot_be_followed(source: Path, tmp_path: Path) -> None:
    loop = tmp_path / "loop.exr"
    loop.symlink_to(loop)
    assert "Cannot write" in refused([loop], [source])
    check_outputs([tmp_path / "out.exr"], [loop, tmp_path / "missing.exr", tmp_path / "\0"])


@pytest.mark.parametrize(
    "words",
    [
        "render light.exr --turn 0 -o light.exr",
        "solve light.exr --sheet light.png",
        "merge . -o a.hdr --times 0.1,0.02",
        "merge a.png b.png --times 0.1,0.02 -o out.exr --preview b.png",
        "merge a.png b.png --times 0.1,0.02 -o out.exr --mask light.png --preview light.png",
        "align a.png b.png -o b.png",
        "capture --watch . -o light.exr",
        "evaluate --scenes . -o light.exr",
        "evaluate --scenes . -o out.html --json out.html",
        "bake --head T.npz -o T.npz",
        "bake --head T.styles.npz -o T.npz",
        "bake --head scene/meshes/skin.ply --export-scene scene",
        "render light.exr --head T.npz --turn 0 -o links-to-head.exr",
    ],
)
def test_every_command_that_writes(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    light = np.ones((16, 32, 3), np.float32)
    write_picture(tmp_path / "light.exr", light, "float")
    for name in ("a.png", "b.png"):
        write_picture(tmp_path / name, np.full((16, 32, 3), 9, np.uint8), "uint8")
    os.link("a.png", "a.hdr")
    os.link("light.exr", "light.png")
    (tmp_path / "scene" / "meshes").mkdir(parents=True)
    for name in ("T.npz", "T.styles.npz", "T.shape.npz", "scene/meshes/skin.ply"):
        (tmp_path / name).write_bytes(b"mine")
    os.link("T.shape.npz", "links-to-head.exr")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert main(words.split()) == 2
    assert "one of the input files" in (said := capsys.readouterr().err) or "twice" in said
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before


@pytest.mark.skipif(sys.platform != "linux", reason="others bring all that Qt needs")
@pytest.mark.parametrize(
    "command",
    ["solve {place} --sheet {folder}/sheet.png", "merge {place} -o {folder}/m.exr --preview p.png"],
)
def test_a_library_that_pictures_need_is_named(
    source: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
) -> None:
    def load(name: str) -> object:
        raise OSError("libEGL.so.1: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(ctypes, "CDLL", load)
    words = command.format(place=source, folder=source.parent)
    assert main(words.split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "libEGL.so.1" in line
    assert "sudo apt install libegl1" in line
    assert sorted(path.name for path in source.parent.iterdir()) == ["place.exr"]
