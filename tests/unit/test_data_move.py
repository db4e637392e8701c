"""The data folder of an earlier version on Windows, by doubles of its folders."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pytest

from app.core.storage.data_move import settle_data


@pytest.fixture
def env(tmp_path: Path) -> dict[str, str]:
    return {"APPDATA": str(tmp_path / "Roaming"), "LOCALAPPDATA": str(tmp_path / "Local")}


@pytest.fixture
def old(tmp_path: Path) -> Path:
    folder = tmp_path / "Roaming" / "turnlight"
    (folder / "places" / "café").mkdir(parents=True)
    (folder / "places" / "café" / "place.json").write_text("{}")
    facts = {"last_place": str(folder / "places" / "café"), "theme": "light"}
    (folder / "settings.json").write_text(json.dumps(facts))
    return folder


def contents(folder: Path) -> set[str]:
    return {each.relative_to(folder).as_posix() for each in folder.rglob("*")}


WHOLE = {"places", "places/café", "places/café/place.json", "settings.json"}


@pytest.mark.parametrize("other_disk", [False, True])
def test_roaming_data_move_to_local_once(
    tmp_path: Path,
    env: dict[str, str],
    old: Path,
    other_disk: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rename = os.rename

    def across(source: Path, target: Path) -> None:
        if source == old:
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))
        rename(source, target)

    if other_disk:
        monkeypatch.setattr(os, "rename", across)
    settle_data(env)
    new = tmp_path / "Local" / "turnlight"
    assert contents(new) == WHOLE
    assert not old.exists()
    assert "TURNLIGHT_HOME" not in env
    facts = json.loads((new / "settings.json").read_text())
    assert facts == {"last_place": str(new / "places" / "café"), "theme": "light"}
    assert os.listdir(new.parent) == ["turnlight"]
    # What an older version writes afterwards is not taken for the data.
    old.mkdir(parents=True)
    settle_data(env)
    assert contents(new) == WHOLE


def test_a_folder_in_use_stays_and_is_used(
    tmp_path: Path, env: dict[str, str], old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(source: Path, target: Path) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(os, "rename", refuse)
    settle_data(env)
    assert env["TURNLIGHT_HOME"] == str(old)
    assert contents(old) == WHOLE
    assert not (tmp_path / "Local" / "turnlight").exists()


def test_a_copy_that_fails_leaves_everything(
    tmp_path: Path, env: dict[str, str], old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def across(source: Path, target: Path) -> None:
        raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))

    monkeypatch.setattr(os, "rename", across)
    settle_data(env)
    assert env["TURNLIGHT_HOME"] == str(old)
    assert contents(old) == WHOLE
    assert os.listdir(tmp_path / "Local") == []


def test_a_chosen_folder_and_a_first_start_move_nothing(
    tmp_path: Path, env: dict[str, str], old: Path
) -> None:
    settle_data(env | {"TURNLIGHT_HOME": str(tmp_path / "mine")})
    assert contents(old) == WHOLE
    settle_data({"APPDATA": str(tmp_path / "none"), "LOCALAPPDATA": str(tmp_path / "none")})
    assert contents(old) == WHOLE
    assert not (tmp_path / "none").exists()
