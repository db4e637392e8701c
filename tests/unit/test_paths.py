"""Where the program's and the user's files are."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.core.base.errors import CoreError
from app.core.base.paths import resources, user_data

HOME = Path("home") / "ann"


def test_this_project_has_its_resources() -> None:
    folder = resources()
    assert (folder / "styles" / "butterfly.toml").is_file()
    assert (folder / "demo" / "scenes" / "courtyard.exr").is_file()


def test_clone_has_them_beside_the_package(tmp_path: Path) -> None:
    (tmp_path / "app").mkdir()
    (tmp_path / "resources").mkdir()
    assert resources(tmp_path / "app") == tmp_path / "resources"


def test_wheel_has_them_inside_whatever_lies_beside(tmp_path: Path) -> None:
    (tmp_path / "app" / "_resources").mkdir(parents=True)
    (tmp_path / "resources").mkdir()
    assert resources(tmp_path / "app") == tmp_path / "app" / "_resources"


def test_damaged_installation_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match=r"own files are missing.*Reinstall Turnlight"):
        resources(tmp_path / "app")


@pytest.mark.parametrize(
    ("platform", "environ", "expected"),
    [
        ("linux", {}, HOME / ".local" / "share" / "turnlight"),
        ("linux", {"XDG_DATA_HOME": "data"}, Path("data") / "turnlight"),
        ("linux", {"XDG_DATA_HOME": ""}, HOME / ".local" / "share" / "turnlight"),
        ("darwin", {}, HOME / "Library" / "Application Support" / "turnlight"),
        ("win32", {"APPDATA": "r", "LOCALAPPDATA": "local"}, Path("local") / "turnlight"),
        ("win32", {}, HOME / "AppData" / "Local" / "turnlight"),
        ("win32", {"TURNLIGHT_HOME": "mine", "LOCALAPPDATA": "local"}, Path("mine")),
    ],
)
def test_user_data(platform: str, environ: dict[str, str], expected: Path) -> None:
    assert user_data(platform, environ, HOME) == expected


def test_user_data_by_default_is_this_machine_s(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TURNLIGHT_HOME", "elsewhere")
    assert user_data() == Path("elsewhere")
    for name in ("TURNLIGHT_HOME", "XDG_DATA_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    assert user_data().is_relative_to(Path.home())
