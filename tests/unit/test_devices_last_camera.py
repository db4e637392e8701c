"""The camera that was used last: kept without a password, read without trust."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.devices.theta.camera_identity import FoundCamera, described
from app.devices.theta.endpoint import ACCESS_POINT, Endpoint
from app.devices.theta.last_camera import FILE, last_camera, remember
from app.devices.theta.messages import Info


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def test_the_last_camera_is_kept_without_a_password(home: Path) -> None:
    assert last_camera() is None
    camera = described(Endpoint("10.0.0.9", 8080), "network", Info("RICOH THETA V", "00105377"))
    assert remember(camera)
    kept = last_camera()
    assert kept is not None
    assert (kept.endpoint, kept.model, kept.serial, kept.source) == (
        Endpoint("10.0.0.9", 8080),
        "RICOH THETA V",
        "00105377",
        "remembered",
    )
    facts = json.loads((home / FILE).read_text("utf-8"))
    assert set(facts) == {"format", "host", "port", "model", "serial"}


def test_a_camera_far_away_is_not_kept() -> None:
    far = FoundCamera("x", Endpoint("8.8.8.8"), "RICOH THETA V", "1", "typed")
    assert not remember(far)
    assert last_camera() is None


def test_a_folder_that_cannot_be_written_is_no_error(home: Path) -> None:
    home.write_text("not a folder")
    assert not remember(described(ACCESS_POINT, "access point", Info("RICOH THETA V", "1")))
    assert last_camera() is None


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        '{"host": "8.8.8.8", "port": 80}',
        '{"host": "evil.example", "port": 80}',
        '{"host": "10.0.0.9"}',
        '{"host": "10.0.0.9", "port": 0}',
        '{"host": "10.0.0.9", "port": 99999}',
        '{"host": "10.0.0.9", "port": "80"}',
        '{"host": ["10.0.0.9"], "port": 80}',
        '{"host": "10.0.0.9", "port": 80, "model": "' + "x" * 5000 + '"}',
        "[" * 3000,
        "\x00\xff",
    ],
)
def test_a_damaged_file_of_the_last_camera_is_as_none(home: Path, text: str) -> None:
    home.mkdir()
    (home / FILE).write_text(text, "latin-1")
    assert last_camera() is None


def test_odd_words_in_the_file_of_the_last_camera_do_no_harm(home: Path) -> None:
    home.mkdir()
    facts = {"host": "10.0.0.9", "port": 80, "model": "RICOH\x1b[2J", "serial": 7}
    (home / FILE).write_text(json.dumps(facts), "utf-8")
    kept = last_camera()
    assert kept is not None
    assert kept.name.isprintable()
    assert kept.serial == ""
