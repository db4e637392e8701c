"""The user's own data are for the user alone; a command's outputs are ordinary files."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from app.core.base.atomic_files import atomic_write_text, file_opener, make_folder
from app.core.base.imaging.images import write_png
from app.core.base.progress import Token
from app.core.painting.canvas import make_canvas
from app.core.painting.draft_file import Draft, save_draft
from app.core.painting.user_styles import save_user_style, update_user_style
from app.core.places.files.light import store_environment
from app.core.places.files.originals import adopt_files
from app.core.places.place_folder import create_place
from app.core.places.place_list import delete_place
from app.core.storage.privacy import tighten
from app.core.storage.settings import Settings
from app.core.storage.settings_file import FILE, write_settings
from app.devices.capture.session import Session

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="permissions as on POSIX")

NOON = datetime(2026, 5, 4, 12, tzinfo=UTC)


@pytest.fixture(params=[0o022, 0o000, 0o077, 0o177])
def umask(request: pytest.FixtureRequest) -> Iterator[int]:
    mask: int = request.param
    before = os.umask(mask)
    yield mask
    os.umask(before)


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def mode(path: Path) -> int:
    return stat.S_IMODE(path.lstat().st_mode)


def open_to_others(folder: Path) -> list[Path]:
    return [each for each in (folder, *folder.rglob("*")) if mode(each) & 0o077]


def fill(home: Path, places: Path, photo: Path) -> Path:
    """Make one of everything."""
    write_settings(home / FILE, Settings(theme="light"))
    gone = create_place(places, "Gone", NOON)
    place = create_place(places, "Café", NOON)
    light = np.full((64, 128, 3), 0.5, np.float32)
    store_environment(place, light)
    adopt_files(place, [photo])
    Session.create(place / "capture")
    delete_place(gone)
    layer = np.linspace(-1, 1, 256 * 256, dtype=np.float32).reshape(256, 256)
    canvas = make_canvas(layer, np.zeros_like(layer), layer, np.zeros_like(layer))
    style = save_user_style(home / "styles", canvas, "Mine")
    other = make_canvas(-layer, np.zeros_like(layer), layer, np.zeros_like(layer))
    update_user_style(home / "styles", style, other)
    make_folder(home / "drafts")
    save_draft(home / "drafts" / "paint.npz", Draft(canvas))
    return place


@pytest.mark.parametrize("elsewhere", [False, True])
def test_what_is_kept_is_private_whatever_the_umask(
    umask: int, home: Path, tmp_path: Path, elsewhere: bool
) -> None:
    photo = tmp_path / "photo.jpg"
    photo.write_bytes(b"a photo")
    photo.chmod(0o644)
    places = tmp_path / "chosen" if elsewhere else home / "places"
    place = fill(home, places, photo)
    with open(place / "capture" / "part.jpg", "wb", opener=file_opener) as stream:
        stream.write(b"half")
    assert open_to_others(home) == []
    assert open_to_others(places) == []
    folders = [each for each in (home, *home.rglob("*")) if each.is_dir()]
    assert {mode(each) for each in folders} == {0o700}
    assert mode(photo) == 0o644


def test_an_output_of_a_command_is_an_ordinary_file(umask: int, home: Path, tmp_path: Path) -> None:
    if umask & 0o700:
        pytest.skip("nobody has such a mask and writes files")
    write_png(tmp_path / "sheet.png", np.zeros((4, 4, 3), np.uint8))
    atomic_write_text(tmp_path / "answer.txt", "yes")
    assert {mode(each) for each in tmp_path.iterdir() if each.is_file()} == {0o666 & ~umask}


def test_a_folder_from_before_is_closed_once(home: Path, tmp_path: Path) -> None:
    photo = tmp_path / "photo.jpg"
    photo.write_bytes(b"a photo")
    chosen = tmp_path / "chosen"
    place = fill(home, chosen, photo)
    (chosen / "invoices").mkdir()
    (chosen / "invoices" / "may.txt").write_text("not ours")
    (place / "link.jpg").symlink_to(photo)
    os.link(photo, place / "same.jpg")
    (place / "protected.txt").write_text("")
    for root in (home, chosen):
        for each in (root, *root.rglob("*")):
            if not each.is_symlink():
                each.chmod(0o755 if each.is_dir() else 0o644)
    (place / "protected.txt").chmod(0o444)
    assert tighten(home, chosen, Token()) > 0
    theirs = {chosen, chosen / "invoices", chosen / "invoices" / "may.txt", place / "same.jpg"}
    assert {each for each in open_to_others(chosen) if not each.is_symlink()} == theirs
    assert open_to_others(home) == []
    assert mode(photo) == 0o644
    assert mode(place / "protected.txt") == 0o400
    assert tighten(home, chosen, Token()) == 0


def test_a_home_with_other_things_in_it_stays_open(home: Path) -> None:
    write_settings(home / FILE, Settings(theme="light"))
    (home / "bin").mkdir()
    (home / "bin" / "tool").write_text("")
    for each in (home, home / FILE, home / "bin", home / "bin" / "tool"):
        each.chmod(0o755)
    tighten(home, home / "places", Token())
    assert open_to_others(home) == [home, home / "bin", home / "bin" / "tool"]
